"""Mechanisms with parts of all kinds, for tests that compare the kernel with the package."""

import dataclasses

from prbm.mechanism.description import Mechanism
from prbm.mechanism.parameters import Parameter
from prbm.mechanism.parts import (
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Joint,
    Probe,
    Release,
    Spring,
    Stop,
)
from support import mechanism


def length(name, x):
    """Return a length [m] as a parameter."""
    return Parameter(name, x, "m", "A length", 1e-9, 1e3)


def rich(model="3R"):
    """Return a mechanism of two bodies with pins, two flexure models, two stops and friction."""
    return Mechanism(
        name="Rich",
        title="A stage on two leaves, with a pendulum on a third",
        ground={"left": (0.0, 0.0), "right": ("0.08", 0.003)},
        bodies=(
            Body(
                "stage", 0.05, "3e-5 + 1e-5*L", ("0.04", "L + 0.01"),
                {"left": (0.0, "L"), "right": ("0.08", "L"), "top": (0.03, "L + 0.02")},
            ),
            Body("tip", 0.004, 2e-7, ("0.03", "1.6*L + 0.02"), {"end": (0.03, "1.5*L + 0.02")}),
        ),
        flexure_types=(
            FlexureType("leaf", model, "L/400", 8e-3, 1.8e11, 7800.0, stress=True),
            FlexureType("thin", "1R", 1e-4, 8e-3, 1.8e11, 7800.0),
        ),
        flexures=(
            Flexure("one", "leaf", "ground.left", "stage.left"),
            Flexure("two", "thin", "stage.right", "ground.right", ("clamp", "pin")),
            Flexure("three", "leaf", "stage.top", "tip.end", ("clamp", "pin")),
        ),
        stops=(
            Stop("high", "stage", (0.08, "L"), 10.0, 2e-3, "L/8", 0.7, 0.2),
            Stop("low", "tip", (0.03, "1.6*L"), 180.0, 3e-3, 0.0, 0.4, 0.0),
        ),
        frictions=(Friction("rub", "stage", 20.0, 0.3, 0.4, 50.0), Friction("dry", "tip", 90.0)),
        forces=(Force("pull", "tip"), Force("push", "stage")),
        release=Release("stage", 15.0, -4e-3),
        geometry=(length("L", 0.04),),
        gravity=(1.0, -9.81),
        damping_beta=8e-6,
    )  # fmt: skip


def elastic():
    """Return a mechanism with flexures that stretch, joints, stops on bodies and two loops.

    Its bodies are

    - a stage on two flexures, one of which is a chain;
    - a hammer at the free end of a third flexure, which hits a wall on the stage;
    - a lever between a bar and a joint;
    - a pendulum on another joint.
    """
    return Mechanism(
        name="Elastic",
        title="Bodies that hit each other, on flexures that stretch",
        ground={"left": (0.0, 0.0), "right": (0.08, 0.002), "far": (0.115, "L - 0.03")},
        bodies=(
            Body(
                "stage", 0.05, 3e-5, (0.04, "L + 0.01"),
                {
                    "left": (0.0, "L"), "right": (0.08, "L"), "top": (0.03, "L + 0.02"),
                    "hinge": (0.09, "L + 0.01"), "hook": (0.02, "L"),
                },
            ),
            Body("hammer", 0.004, 2e-7, (0.032, "L + 0.055"), {"root": (0.03, "L + 0.05")}),
            Body(
                "lever", 0.003, 4e-7, (0.1, "L + 0.02"),
                {"pin": (0.09, "L + 0.01"), "end": (0.11, "L + 0.025")},
            ),
            Body("pendulum", 0.002, 1e-7, (0.021, "L - 0.012"), {"pin": (0.02, "L")}),
        ),
        flexure_types=(
            FlexureType(
                "leaf", "2R", "L/100", 8e-3, 3e9, 1200.0, axial=True, stress=True,
                initial_strain=-2e-5,
            ),
            FlexureType(
                "chain", "nR", "L/80", 8e-3, 3e9, 1200.0, n=4, axial=True, stress=True,
                initial_strain=1e-5,
            ),
            FlexureType("bar", "1R", 5e-4, 4e-3, 2e9, 1200.0, axial=True),
        ),
        flexures=(
            Flexure("one", "leaf", "stage.left", "ground.left", ("clamp", "pin")),
            Flexure("two", "chain", "ground.right", "stage.right"),
            Flexure("three", "leaf", "hammer.root", "stage.top", ("free", "clamp")),
            Flexure("strut", "bar", "lever.end", "ground.far", ("pin", "pin")),
        ),
        joints=(
            Joint("hinge", "stage.hinge", "lever.pin", "L/40", 0.02, "L/4000"),
            Joint("hook", "pendulum.pin", "stage.hook", damping=1e-6),
        ),
        springs=(
            Spring("coil", "stage.right", "hammer.root", "500*L", "1.75*L", 2e4, 0.03),
            Spring("cord", "pendulum.pin", "ground.far", 15.0, damping="L/2"),
        ),
        stops=(
            Stop("knock", "hammer", (0.035, "L + 0.055"), 5.0, 2e-3, "L/20", 0.7, 0.2, on="stage"),
            Stop("low", "stage", (0.08, "L"), 10.0, 2e-3, 0.0, 0.4, 0.0),
            Stop("tap", "stage", (0.02, "L - 0.02"), 160.0, 4e-3, 0.0, 0.5, 0.3, on="pendulum"),
        ),
        frictions=(
            Friction("rub", "hammer", 20.0, 0.3, 0.4, 50.0, point=(0.03, "L + 0.06")),
            Friction("dry", "pendulum", 90.0),
        ),
        forces=(Force("pull", "hammer", point=("0.03", "L + 0.06")), Force("push", "stage")),
        probes=(
            Probe("tip", "hammer.root"), Probe("eye", "lever.end"), Probe("still", "ground.left"),
        ),
        release=Release("stage", 15.0, -3e-3),
        geometry=(length("L", 0.04),),
        gravity=(1.0, -9.81),
        damping_beta=1e-7,
    )  # fmt: skip


def anvil():
    """Return a stage on two flexures that stretch; a hammer on a third falls on the stage."""
    return Mechanism(
        name="Anvil",
        title="A hammer that falls on the stage that carries it",
        ground={"left": (0.0, 0.0), "right": (0.06, 0.0)},
        bodies=(
            Body(
                "stage", 0.05, 3e-5, (0.03, "L + 0.01"),
                {"left": (0.0, "L"), "right": (0.06, "L"), "post": (0.005, "L + 0.02")},
            ),
            Body("hammer", 0.006, 3e-7, (0.05, "L + 0.02"), {"root": (0.045, "L + 0.02")}),
        ),
        flexure_types=(
            FlexureType("leaf", "1R", "L/100", 8e-3, 1e9, 1200.0, axial=True, stress=True),
            FlexureType("arm", "2R", "L/100", 8e-3, 5e9, 1200.0, axial=True, stress=True),
        ),
        flexures=(
            Flexure("one", "leaf", "ground.left", "stage.left"),
            Flexure("two", "leaf", "stage.right", "ground.right"),
            Flexure("three", "arm", "stage.post", "hammer.root", ("clamp", "free")),
        ),
        stops=(
            Stop("face", "hammer", (0.05, "L + 0.015"), -85.0, 2e-3, 1e-3, 0.5, 0.3, on="stage"),
            Stop("side", "stage", (0.06, "L"), 0.0, 2e-3, 0.0, 0.6, 0.0),
        ),
        frictions=(Friction("rub", "hammer", 80.0, 0.2, 0.05, 1.0, point=(0.05, "L + 0.03")),),
        forces=(Force("blow", "hammer", point=(0.052, "L + 0.025")),),
        probes=(Probe("tip", "hammer.root"),),
        release=Release("stage", 0.0, -2e-3),
        geometry=(length("L", 0.04),),
        gravity=(0.0, -1.0),
        damping_beta=1e-5,
    )  # fmt: skip


HIGH, LOW = (
    Stop(name, "shuttle", ("shuttle.width", "flexure.length + shuttle.com_height"), offset=offset)
    for name, offset in (("high", 0.01), ("low", -0.01))
)


def two_stops(model, **changes):
    """Return the guide with two stops, above and below the centre of mass."""
    stops = [dataclasses.replace(s, **changes.get(s.name, {})) for s in (HIGH, LOW)]
    return dataclasses.replace(mechanism(model), name="Two", stops=tuple(stops))


def cantilever(model="2R", **parts):
    """Return a flexure that is clamped to ground and has a body on its pinned end: no loop."""
    return Mechanism(
        name="cantilever",
        title="A flexure with a pendulum at its end",
        ground={"clamp": (0.0, 0.0)},
        bodies=(Body("tip", 0.02, 3e-6, ("L + 0.01", 0.004), {"end": ("L", 0.0)}),),
        flexure_types=(FlexureType("leaf", model, 2e-4, 1e-2, 2e11, 7800.0),),
        flexures=(Flexure("leaf1", "leaf", "ground.clamp", "tip.end", ("clamp", "pin")),),
        release=Release("tip", direction=90.0),
        geometry=(length("L", 0.05),),
        gravity=(1.0, -9.81),
        **parts,
    )


def beams(*, axial: bool = True) -> Mechanism:
    """Return a mechanism of beams with all types of ends, from either end."""
    links = elastic()
    orders = {"leaf": (3, None), "chain": (4, 8), "bar": (1, 3)}
    kinds = tuple(
        dataclasses.replace(
            kind,
            model="beam",
            n=0,
            order=order,
            nodes=nodes,
            axial=axial or order == 1,
            initial_strain=kind.initial_strain if axial else None,
        )
        for kind in links.flexure_types
        for order, nodes in [orders[kind.name]]
    )
    return dataclasses.replace(links, flexure_types=kinds)


def links_and_beams() -> Mechanism:
    """Return a mechanism of beams that do not stretch, and of links."""
    links = rich()
    kinds = tuple(
        dataclasses.replace(kind, model="beam", order=3) if kind.name == "leaf" else kind
        for kind in links.flexure_types
    )
    return dataclasses.replace(links, flexure_types=kinds)


def five_nodes() -> Mechanism:
    """Return the guide on beams of five nodes."""
    guide = mechanism("GuideBeam")
    (leaf,) = guide.flexure_types
    return dataclasses.replace(
        guide, flexure_types=(dataclasses.replace(leaf, nodes=5, stress=True),)
    )


def late_beam() -> Mechanism:
    """Return a mechanism whose last flexure, a beam, turns with the first body.

    Its coordinates are not consecutive: those of another flexure and body are between.
    """
    mixed = links_and_beams()
    one, two, three = mixed.flexures
    last = Flexure("two", "leaf", two.end, two.start)
    return dataclasses.replace(mixed, flexures=(one, three, last))


def profiles(*, axial: bool = True) -> Mechanism:
    """Return a mechanism of a notch, a taper, an arc, and a notch with fillets, from either end."""
    links = elastic()
    extra = {
        "leaf": {
            "order": 2, "profile": "taper", "end_thickness": "L/140", "end_width": 6e-3,
            "rise": 1e-3,
        },
        "chain": {
            "profile": "notch", "notch_radius": "L/80", "notch_depth": 1.5e-3, "waist_length": 0.02,
        },
        "bar": {"order": 1, "curvature": 12.0},
    }  # fmt: skip
    kinds = [
        dataclasses.replace(
            kind,
            model="beam",
            n=0,
            axial=axial,
            stress=True,
            initial_strain=kind.initial_strain if axial else None,
            **extra[kind.name],
        )
        for kind in links.flexure_types
    ]
    hinge = FlexureType(
        "neck", "beam", 6e-4, 8e-3, 3e9, 1200.0, stress=True, profile="notch", notch_radius=3e-3
    )
    flexures = [
        dataclasses.replace(f, type="neck") if f.name == "three" else f for f in links.flexures
    ]
    return dataclasses.replace(links, flexure_types=(*kinds, hinge), flexures=tuple(flexures))
