"""Mechanisms with guides."""

import math
from dataclasses import replace

from many_parts import anvil
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Force, Guide, Joint, Probe, Release, Spring
from prbm.runs.engine import simulation

CRANK, ROD = 0.1, 0.3  # m, lengths of the links of the slider-crank.


def mechanism(name, bodies, guides, release, **parts):
    """Return a mechanism of bodies and guides."""
    given = {
        "name": name, "title": "A mechanism with guides", "ground": {"o": (0.0, 0.0)},
        "bodies": bodies, "flexure_types": (), "flexures": (), "guides": guides,
        "release": release,
    }  # fmt: skip
    return Mechanism(**given | parts)


def incline(angle=30.0, springs=(), *, turning=False, **release):
    """Return a block of 2 kg on a line at an angle [deg], with or without springs along it."""
    u = complex(math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    return mechanism(
        "Incline", (Body("block", 2.0, 3e-3, (0.0, 0.0), {"c": (0.0, 0.0)}),),
        (Guide("way", "block.c", "ground.o", "ground.up", turning),),
        Release("block", angle, **release), springs=springs,
        ground={"o": (0.0, 0.0), "up": (0.2 * u.real, 0.2 * u.imag)},
        forces=(Force("push", "block"),), gravity=(0.0, -9.81),
    )  # fmt: skip


def slider_crank(angle=90.0, velocity=2.0, gravity=(0.0, -9.81), **parts):
    """Return a slider-crank drawn at an angle of the crank [deg], with a slider along x."""
    p = CRANK * complex(math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    q = p.real + math.sqrt(ROD**2 - p.imag**2)
    across = angle + 90.0
    return mechanism(
        "SliderCrank", (
            Body("crank", 0.3, 4e-4, (0.5 * p.real, 0.5 * p.imag), {
                "o": (0.0, 0.0), "p": (p.real, p.imag)}),
            Body("rod", 0.2, 1.5e-3, (0.5 * (p.real + q), 0.5 * p.imag), {
                "p": (p.real, p.imag), "q": (q, 0.0)}),
            Body("slider", 0.5, 2e-4, (q + 0.01, 0.02), {"q": (q, 0.0)}),
        ),
        (Guide("way", "slider.q", "ground.o", "ground.a", turning=False),),
        Release("crank", across, velocity=velocity, point=(p.real, p.imag)),
        ground={"o": (0.0, 0.0), "a": (0.4, 0.0)},
        joints=(
            Joint("main", "ground.o", "crank.o"), Joint("pin", "crank.p", "rod.p"),
            Joint("wrist", "rod.q", "slider.q"),
        ),
        forces=(Force("gas", "slider", (q, 0.0)),), probes=(Probe("wrist_point", "slider.q"),),
        gravity=gravity, **parts,
    )  # fmt: skip


def trammel(a=0.2, b=0.3, angle=40.0, **release):
    """Return a rod of an elliptic trammel: its ends stay on the axes x and y, drawn at an angle."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    end = (a + b) * c, 0.0
    top = 0.0, (a + b) * s
    pen = b * c, a * s  # The distance a from the end on x, b from that on y.
    return mechanism(
        "Trammel", (Body("rod", 0.7, 5e-3, pen, {"x": end, "y": top, "pen": pen}),),
        (Guide("level", "rod.x", "ground.o", "ground.a"),
         Guide("upright", "rod.y", "ground.o", "ground.b")),
        Release("rod", **release), ground={"o": (0.0, 0.0), "a": (1.0, 0.0), "b": (0.0, 1.0)},
        probes=(Probe("pen", "rod.pen"),), forces=(Force("push", "rod"),),
    )  # fmt: skip


def slotted_arm(springs=(), gravity=(0.0, 0.0), stay=(0.25, 0.3), **release):
    """Return a pin, a body that flies otherwise, in a slot of an arm on a pivot."""
    given = {"velocity": 0.5, "direction": 90.0} | release
    return mechanism(
        "Slot", (
            Body("arm", 1.0, 0.02, (0.1, 0.0), {
                "o": (0.0, 0.0), "a": (0.05, 0.02), "b": (0.3, 0.02)}),
            Body("pin", 0.4, 1e-4, (0.12, 0.02), {"c": (0.12, 0.02), "e": (0.13, 0.03)}),
        ),
        (Guide("slot", "pin.c", "arm.a", "arm.b"),), Release("pin", **given),
        joints=(Joint("pivot", "ground.o", "arm.o"),), springs=springs, gravity=gravity,
        ground={"o": (0.0, 0.0), "stay": stay}, forces=(Force("push", "pin", (0.125, 0.02)),),
    )  # fmt: skip


def cart(gravity=(0.0, -9.81)):
    """Return a cart on a line between springs, and a tray in a slot of it that keeps its angle."""
    return mechanism(
        "Cart", (
            Body("cart", 0.8, 2e-3, (0.0, 0.0), {
                "c": (0.0, 0.0), "a": (-0.05, 0.02), "b": (0.1, 0.08)}),
            Body("tray", 0.3, 5e-4, (0.03, 0.06), {"c": (0.025, 0.05), "e": (0.05, 0.07)}),
        ),
        (Guide("rail", "cart.c", "ground.l", "ground.r", turning=False),
         Guide("ramp", "tray.c", "cart.a", "cart.b", turning=False)),
        Release("cart", displacement=0.01, velocity=0.2),
        ground={"l": (-0.2, 0.0), "r": (0.2, 0.0)},
        springs=(
            Spring("left", "ground.l", "cart.c", 300.0, 0.19, damping=0.3),
            Spring("right", "cart.c", "ground.r", 200.0, cubic_stiffness=1e4),
            Spring("inner", "cart.a", "tray.e", 150.0, 0.08),
        ),
        gravity=gravity, forces=(Force("push", "tray", (0.04, 0.06)),),
        probes=(Probe("corner", "tray.e"),),
    )  # fmt: skip


def beaded():
    """Return a stage and a hammer on flexures, a bead in a slot of the stage, and a slider."""
    bead = Body("bead", 4e-3, 2e-7, (0.032, "L + 1e-3"), {"c": (0.03, "L"), "e": (0.034, "L")})
    rider = Body("rider", 3e-3, 1e-7, (0.03, "L + 0.012"), {"c": (0.031, "L + 0.01")})
    return replace(
        anvil(), name="Beaded", bodies=(*anvil().bodies, bead, rider),
        ground={**anvil().ground, "post": (0.031, "L + 0.01"), "far": (0.08, "L + 0.02")},
        guides=(
            Guide("slot", "bead.c", "stage.left", "stage.right", friction=0.25),
            Guide("rail", "rider.c", "ground.post", "ground.far", turning=False),
        ),
        springs=(
            Spring("coil", "stage.left", "bead.e", 40.0, damping=0.01),
            Spring("pair", "bead.e", "rider.c", 30.0, 0.011),
        ),
    )  # fmt: skip


def various():
    """Return the beaded mechanism with a flap on a joint with torsion, and springs of each kind."""
    model = beaded()
    stage = next(body for body in model.bodies if body.name == "stage")
    x, y = stage.points["left"]
    flap = Body(
        "flap", 3e-3, 1e-7, (f"{x} + 0.002", y), {"h": (x, y)}, start_omega=0.3,
    )  # fmt: skip
    coil, pair = model.springs
    return replace(
        model, name="Various", bodies=(*model.bodies, flap),
        joints=(*model.joints, Joint("hinge", "stage.left", "flap.h", 1e-3, 0.1, 1e-6)),
        springs=(replace(coil, acts="tension"), replace(pair, acts="compression")),
    )  # fmt: skip


def rough(model, friction):
    """Return a mechanism whose guides have a coefficient of friction."""
    return replace(model, guides=tuple(replace(g, friction=friction) for g in model.guides))


def start(model, engine, tolerance=1e-11, changes=None):
    """Return a simulation of a mechanism in an engine."""
    return simulation(model, changes or {}, engine=engine, tolerance=tolerance)


def energy(out):
    """Return kinetic, elastic, gravitational and dissipated energy [J], without the work."""
    kinds = ("kinetic", "elastic", "gravitational", "dissipated")
    return sum(out[f"energy.{kind}"] for kind in kinds)
