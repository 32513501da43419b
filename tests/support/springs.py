"""Mechanisms with coil springs and with torsion at joints."""

from dataclasses import replace

from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Force, Joint, Probe, Release, Spring


def oscillator(stiffness=200.0, displacement=0.02, parts=(), **law):
    """Return a block of 2 kg on a spring along x, 0.1 m long, released at a displacement [m]."""
    given = {
        "name": "Oscillator",
        "title": "A block on a spring",
        "ground": {"anchor": (0.0, 0.0)},
        "bodies": (Body("block", 2.0, 0.01, (0.1, 0.0), {"eye": (0.1, 0.0)}),),
        "flexure_types": (),
        "flexures": (),
        "springs": (Spring("coil", "ground.anchor", "block.eye", stiffness, **law),),
        "release": Release("block", displacement=displacement),
    }
    return Mechanism(**given | dict(parts))


def truss(height=0.05, half=0.2, stiffness=1e3, displacement=0.0, **law):
    """Return a shallow truss: two springs from the ground to a body at their apex, pushed down."""
    left, right = (
        Spring(name, f"ground.{name}", "apex.top", stiffness, **law) for name in ("left", "right")
    )
    return Mechanism(
        name="Truss", title="A shallow truss of two springs",
        ground={"left": (-half, 0.0), "right": (half, 0.0)},
        bodies=(Body("apex", 1.0, 1e-3, (0.0, height), {"top": (0.0, height)}),),
        flexure_types=(), flexures=(), springs=(left, right), forces=(Force("push", "apex"),),
        probes=(Probe("tip", "apex.top"),),
        release=Release("apex", -90.0, displacement=displacement),
    )  # fmt: skip


def web(gravity=(0.3, -2.0)):
    """Return two bodies in springs from the ground and between them, off their centres."""
    return Mechanism(
        name="Web", title="Bodies in a web of springs",
        ground={"left": (-0.1, 0.1), "right": (0.12, 0.1), "low": (0.0, -0.15)},
        bodies=(
            Body("plate", 0.3, 4e-4, (0.0, 0.0), {"a": (-0.03, 0.02), "b": (0.04, 0.01)}),
            Body("ring", 0.2, 2e-4, (0.02, -0.07), {"a": (0.03, -0.06), "b": (0.0, -0.08)}),
        ),
        flexure_types=(), flexures=(),
        springs=(
            Spring("one", "ground.left", "plate.a", 80.0, 0.1, 4e3, 0.05),
            Spring("two", "plate.b", "ground.right", 60.0, damping=0.02),
            Spring("three", "plate.b", "ring.a", 50.0, 0.05, 1e4),
            Spring("four", "ring.b", "plate.a", 40.0, damping=0.1),
            Spring("five", "ground.low", "ring.b", 70.0, 0.06),
        ),
        forces=(Force("push", "ring", (0.02, -0.06)),), probes=(Probe("eye", "ring.a"),),
        release=Release("plate", 20.0, displacement=0.01, velocity=0.1), gravity=gravity,
    )  # fmt: skip


def four_bar(**torsion):
    """Return three links between two pins of the ground, with torsion at the pin of the loop."""
    points = {"a": (0.0, 0.0), "b": (0.02, 0.1), "c": (0.15, 0.13), "d": (0.13, 0.0)}
    links = [
        Body(one + other, 0.1, 2e-4, tuple(0.5 * (x + y) for x, y in zip(points[one], points[other],
             strict=True)), {one: points[one], other: points[other]})
        for one, other in ("ab", "bc", "cd")
    ]  # fmt: skip
    return Mechanism(
        name="FourBar", title="Three links between two pins", flexure_types=(), flexures=(),
        gravity=(0.0, -3.0), bodies=tuple(links),
        ground={"a": points["a"], "d": points["d"]},
        joints=(
            Joint("first", "ground.a", "ab.a", 0.05, damping=2e-4),
            Joint("second", "ab.b", "bc.b"),
            Joint("third", "cd.c", "bc.c", **torsion),
            Joint("fourth", "cd.d", "ground.d"),
        ),
        forces=(Force("push", "bc"),), release=Release("ab", angle=0.3),
    )  # fmt: skip


def one_sided(sides, gravity=(0.3, -2.0)):
    """Return the web with springs that act on these sides."""
    model = web(gravity)
    springs = (replace(s, acts=acts) for s, acts in zip(model.springs, sides, strict=True))
    return replace(model, springs=tuple(springs))
