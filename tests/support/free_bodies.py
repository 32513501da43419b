"""Mechanisms with bodies that nothing connects to the ground, and pendulums."""

from dataclasses import replace

import numpy as np

from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import (
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Joint,
    Probe,
    Release,
    Stop,
)


def ball(restitution=0.7, gravity=(0.0, -9.81), **parts):
    """Return the BouncingBall of the Reference FMUs: its centre is 1 m above a floor."""
    return Mechanism(**{
        "name": "Ball",
        "title": "A ball falls on a floor",
        "ground": {},
        "bodies": (Body("ball", 1.0, 1.0, (0.0, 1.0)),),
        "flexure_types": (),
        "flexures": (),
        "stops": (Stop("floor", "ball", (0.0, 1.0), -90.0, 1.0, restitution=restitution),),
        "release": Release("ball"),
        "gravity": gravity,
    } | parts)  # fmt: skip


def row_of_balls(masses, restitution=1.0, gaps=0.1, degrees=0.0):
    """Return balls in a row, each with a wall for the next one; the first moves at 1 m/s."""
    u = np.exp(1j * np.radians(degrees))
    centres = [0.2 * k * u for k in range(len(masses))]
    points = [z + 0.05 * u for z in centres]
    bodies = [
        Body(f"ball{k}", m, 1e-4 * m, (z.real, z.imag))
        for k, (m, z) in enumerate(zip(masses, centres, strict=True))
    ]
    stops = [
        Stop(
            f"hit{k}", f"ball{k}", (z.real, z.imag), degrees, gaps, restitution=restitution,
            on=f"ball{k + 1}",
        )
        for k, z in enumerate(points[:-1])
    ]  # fmt: skip
    return Mechanism(
        name="Row", title="Balls in a row", ground={}, bodies=tuple(bodies), flexure_types=(),
        flexures=(), stops=tuple(stops), release=Release("ball0", degrees, velocity=1.0),
    )  # fmt: skip


def pendulum(angle, length=0.3, inertia=2e-3):
    """Return a compound pendulum of 0.5 kg on a pin at the origin, released at an angle [rad]."""
    return Mechanism(
        name="Pendulum",
        title="A body that swings on a pin",
        ground={"pin": (0.0, 0.0)},
        bodies=(Body("bob", 0.5, inertia, (0.0, -length), {"pin": (0.0, 0.0)}),),
        flexure_types=(),
        flexures=(),
        joints=(Joint("pin", "ground.pin", "bob.pin"),),
        release=Release("bob", angle=angle),
        gravity=(0.0, -9.81),
    )


def flying(gravity=(0.3, -2.0)):
    """Return a stage on a leaf, and a free plate with a tip and a free ball that hit it."""
    leaf = FlexureType("leaf", "2R", 1e-3, 8e-3, 2e9, 1200.0, axial=True, stress=True)
    thin = FlexureType("thin", "beam", 8e-4, 8e-3, 2e9, 1200.0, axial=True)
    return Mechanism(
        name="Flying",
        title="Free bodies that hit each other and a stage",
        ground={"foot": (0.0, 0.0)},
        bodies=(
            Body("stage", 0.05, 3e-5, (0.0, 0.05), {"low": (0.0, 0.04), "top": (0.005, 0.06)}),
            Body("plate", 0.04, 2e-5, (0.03, 0.08), {"end": (0.04, 0.085), "pin": (0.02, 0.09)}),
            Body("tip", 0.01, 2e-6, (0.07, 0.09), {"end": (0.065, 0.09)}),
            Body("ball", 0.03, 4e-6, (0.02, 0.12), {"side": (0.015, 0.12)}),
        ),
        flexure_types=(leaf, thin),
        flexures=(
            Flexure("one", "leaf", "ground.foot", "stage.low"),
            Flexure("two", "thin", "plate.end", "tip.end"),
        ),
        stops=(
            Stop("face", "ball", (0.022, 0.115), -90.0, 2e-3, 1e-3, 0.6, 0.3, on="plate"),
            Stop("side", "ball", (0.015, 0.12), 180.0, 5e-3, 0.0, 0.5, 0.2, on="stage"),
            Stop("edge", "tip", (0.075, 0.09), 10.0, 4e-3, 1e-3, 0.5),
        ),
        frictions=(Friction("rub", "plate", 20.0, 0.2, 0.4, 5.0),),
        forces=(Force("push", "plate", (0.025, 0.082)), Force("blow", "ball")),
        probes=(Probe("end", "tip.end"),),
        release=Release("ball", -80.0, velocity=0.3),
        gravity=gravity,
        damping_beta=1e-5,
    )  # fmt: skip


def with_start(model, name, **start):
    """Return a mechanism whose body of a name has positions and velocities at the start."""
    bodies = [replace(body, **start) if body.name == name else body for body in model.bodies]
    return replace(model, bodies=tuple(bodies))


def double_pendulum(first=None, second=None, gravity=(0.0, -9.81)):
    """Return two equal rods on pins, with start values of each."""
    rods = [
        Body(name, 0.4, 3e-3, (0.0, -y), {"top": (0.0, 0.1 - y), "end": (0.0, -0.1 - y)}, **start)
        for name, y, start in (("upper", 0.1, first or {}), ("lower", 0.3, second or {}))
    ]
    return ball(
        gravity=gravity, stops=(), bodies=tuple(rods), ground={"pin": (0.0, 0.0)},
        joints=(Joint("hip", "ground.pin", "upper.top"), Joint("knee", "upper.end", "lower.top")),
        release=Release("upper"),
    )  # fmt: skip
