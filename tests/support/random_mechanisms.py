"""Random valid mechanisms: trees and loops of all kinds of parts.

The structure (connections, flexure models, ends) is drawn by hypothesis, which shrinks it, or from
a seed.  Lengths, masses and stiffnesses always come from a seed, so that no two points coincide by
chance::

    @given(mechanisms())                    # hypothesis
    def test_...(mechanism): ...

    mechanism = seeded(7)                   # the same mechanism each time
    mechanism = everything(7)               # the same with all kinds of parts and starts
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from prbm.base.errors import EquilibriumError, ParameterError, PrbmError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.contact import response
from prbm.mechanics.kinetics import inertia
from prbm.mechanics.positions import given_at_start
from prbm.mechanics.system import jacobian
from prbm.mechanism import flexure
from prbm.mechanism.description import Mechanism
from prbm.mechanism.flexure import CLAMP, FREE, PIN
from prbm.mechanism.parts import (
    COMPLIANT,
    GROUND,
    SIDES,
    VELOCITIES,
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Guide,
    Joint,
    Probe,
    Release,
    Spring,
    Stop,
    value,
)

Choose = Callable[[Sequence], object]
"""Function that picks an element of a sequence; the first element is the simplest."""

CELL = 0.06  # m; bodies are within a fifth of this length of the points of a lattice.
BEAMS = (
    {},
    {"profile": "taper", "end_thickness": 4e-4},
    {"profile": "notch", "notch_radius": 5e-4, "waist_length": 2e-3},
    {"curvature": 5.0},
    {"rise": -1e-3},
)
OPTIONS = {"nR": ({"n": 1}, {"n": 2}, {"n": 4}), "beam": BEAMS}
MODELS = tuple((name, given) for name in flexure.MODELS for given in OPTIONS.get(name, ({},)))
ENDS = ((CLAMP, CLAMP), (CLAMP, PIN), (PIN, CLAMP), (CLAMP, FREE), (FREE, CLAMP), (PIN, PIN))
RUBBER = {"thickness": (2e-3, 3e-3), "modulus": (5e6, 4e7)}  # Axial modes of some hundred Hz.
STEEL = {"thickness": (2e-4, 3e-4), "modulus": (1e9, 1e10)}
DIRECTIONS = (0.0, 90.0, 180.0, 31.7, 200.3)  # deg
MOBILITY_RATIO_MIN = 1e-2  # Mobility of the released body with loops over that without.


class _Builder:
    """Builder of a mechanism: ``choose`` selects the structure, ``rng`` draws the numbers."""

    def __init__(self, choose: Choose, rng: np.random.Generator) -> None:
        self.choose, self.rng = choose, rng
        self.ground: dict[str, tuple[float, float]] = {}
        self.centres: dict[str, complex] = {}
        self.points: dict[str, dict[str, tuple[float, float]]] = {}
        self.types: list[FlexureType] = []
        self.flexures: list[Flexure] = []
        self.joints: list[Joint] = []

    def real(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def disc(self, radius: float) -> complex:
        return self.real(0.2, 1.0) * radius * complex(np.exp(1j * self.real(0, 2 * math.pi)))

    def add_type(self) -> None:
        model, given = self.choose(MODELS)
        axial = self.choose((False, True)) and model != "1R"  # A 1R cantilever cannot stretch.
        section = RUBBER if axial or self.choose((False, True)) else STEEL
        self.types.append(
            FlexureType(
                f"type{len(self.types)}", model, self.real(*section["thickness"]),
                self.real(5e-3, 2e-2), self.real(*section["modulus"]), self.real(1e3, 8e3),
                axial=axial, stress=not self.types, **given,
            )
        )  # fmt: skip

    def add_body(self, cell: complex) -> str:
        name = f"body{len(self.centres)}"
        self.centres[name] = CELL * cell + self.disc(CELL / 5)
        self.points[name] = {}
        return name

    def point(self, owner: str, z: complex) -> str:
        """Add a point to a body or to the ground and return its reference."""
        named = self.ground if owner == GROUND else self.points[owner]
        name = f"p{len(named)}"
        named[name] = (z.real, z.imag)
        return f"{owner}.{name}"

    def near(self, body: str) -> complex:
        return self.centres[body] + self.disc(CELL / 6)

    def connect(self, first: str, second: str, *, joint: bool) -> None:
        """Connect a body or the ground to a body, by a joint or a flexure."""
        far = self.near(second)
        if joint:
            pair = [self.point(first, far), self.point(second, far)]
        else:
            root = far + self.disc(CELL) * 1.5 if first == GROUND else self.near(first)
            pair = [self.point(first, root), self.point(second, far)]
        if self.choose((False, True)):
            pair.reverse()
        if joint:
            self.joints.append(Joint(f"joint{len(self.joints)}", *pair))
        else:
            kind, ends = self.choose(self.types), self.choose(ENDS)
            name = f"flexure{len(self.flexures)}"
            self.flexures.append(Flexure(name, kind.name, *pair, ends=ends))


def build(
    choose: Choose,
    rng: np.random.Generator,
    *,
    bodies: int = 3,
    loops: int = 2,
    stops: int = 2,
    friction: bool = True,
    damping: bool = True,
    free: bool = False,
    springs: int = 0,
    guides: int = 0,
    torsion: bool = False,
    adrift: bool = False,
    varied: bool = False,
) -> Mechanism:
    """Return a mechanism, which may be over-constrained.

    ``bodies``, ``loops``, ``stops``, ``springs`` and ``guides`` are the largest numbers of these
    parts.  With ``free``, one or two more bodies fly freely, alone or connected to each other,
    unless springs or guides hold them.  With ``torsion``, joints have springs and dampers.  With
    ``adrift``, nothing joins a body to the ground, and there is no gravity.  With ``varied``, there
    are compliant stops, strained flexures, start values, weight, and all kinds of releases.
    """
    b = _Builder(choose, rng)
    grounds = () if adrift else (GROUND,)
    for _ in range(choose((1, 2, 3))):
        b.add_type()
    names: list[str] = []
    for k in range(choose(range(2 if adrift else 1, bodies + 1))):
        name = b.add_body(complex(k, (0, 1, 0, -1)[k % 4]))
        if names or grounds:
            parent = choose((*grounds, *names))
            b.connect(parent, name, joint=bool(names) and choose((False, True)))
        names.append(name)
    for _ in range(choose(range(loops + 1))):
        first, second = choose((*grounds, *names)), choose(names)
        if first != second:
            b.connect(first, second, joint=choose((False, False, True)))
    if free:
        names += _add_free_bodies(b)
    coefficient = (0.0, 0.3) if friction else (0.0,)
    walls = _stops(b, choose(range(stops + 1)), names, grounds, coefficient)
    rubs = _rubs(b, choose((0, 1)) if friction and not adrift else 0, names)
    pushes = []
    for i in range(choose((0, 1, 2))):
        z = b.near(body := choose(names))
        pushes.append(Force(f"force{i}", body, choose((None, (z.real, z.imag)))))
    if not b.points[names[-1]]:
        b.point(names[-1], b.near(names[-1]))
    probes = [Probe("probe", f"{names[-1]}.p0")]
    aimed = [(stop.body, stop.direction) for stop in walls]
    body, direction = choose((*aimed, *aimed, (choose(names), choose(DIRECTIONS))))
    pairs = not adrift or len(names) > 1
    coils = [
        _spring(b, i, names, grounds)
        for i in range(choose(range(1, springs + 1)) if springs and pairs else 0)
    ]
    along = (None, 0.0, 0.2) if friction else (None,)
    ways = [
        _guide(b, i, names, along, grounds)
        for i in range(choose(range(1, guides + 1)) if guides and pairs else 0)
    ]
    gravity = choose(((0.0, 0.0), (0.0, -1.0), (0.3, 0.4)))
    made = Mechanism(
        name="Random",
        title="A random mechanism",
        ground=b.ground,
        bodies=tuple(
            Body(name, b.real(0.02, 0.1), b.real(5e-6, 5e-5), (z.real, z.imag), b.points[name])
            for name, z in b.centres.items()
        ),
        flexure_types=tuple(b.types),
        flexures=tuple(b.flexures),
        joints=tuple(
            _torsion(b, joint, damped=damping) if torsion else joint for joint in b.joints
        ),
        springs=tuple(coils),
        guides=tuple(ways),
        stops=tuple(walls),
        frictions=tuple(rubs),
        forces=tuple(pushes),
        probes=tuple(probes),
        release=Release(body, direction, velocity=b.real(0.2, 0.6)),
        gravity=(0.0, 0.0) if adrift else gravity,
        damping_zeta=choose((0.0, 0.02)) if damping and not (free or adrift) else 0.0,
        damping_beta=choose((0.0, 1e-5)) if damping else 0.0,
    )
    return _varied(b, made, adrift=adrift) if varied else made


def _stops(
    b: _Builder,
    count: int,
    names: list[str],
    grounds: Sequence[str],
    coefficients: Sequence[float],
) -> list[Stop]:
    """Return stops on the ground or, if a body is drawn that is not the stopped one, on it."""
    walls = []
    for i in range(count):
        body, on = b.choose(names), b.choose((*grounds, *names))
        if not grounds and on == body:
            continue
        z = b.near(body)
        walls.append(
            Stop(
                f"stop{i}", body, (z.real, z.imag), b.choose(DIRECTIONS), b.real(1e-4, 8e-4),
                b.real(-3e-3, 3e-3), b.choose((0.6, 0.0, 1.0)), b.choose(coefficients),
                on=GROUND if on == body else on,
            )
        )  # fmt: skip
    return walls


def _rubs(b: _Builder, count: int, names: list[str]) -> list[Friction]:
    """Return friction points."""
    rubs = []
    for i in range(count):
        z = b.near(body := b.choose(names))
        point = b.choose((None, (z.real, z.imag)))
        rubs.append(Friction(f"rub{i}", body, b.choose(DIRECTIONS), 0.2, 0.1, 3.0, point))
    return rubs


def _varied(b: _Builder, made: Mechanism, *, adrift: bool) -> Mechanism:
    """Return the mechanism with more kinds of stops, flexures, guides, loads and starts."""
    stops = tuple(_law(b, stop) for stop in made.stops)
    types = tuple(
        replace(kind, initial_strain=b.choose((None, b.real(-1e-4, 1e-4)))) if kind.axial else kind
        for kind in made.flexure_types
    )
    guides = tuple(
        replace(one, friction=b.choose((None, 0.1, 0.4, 1.3))) if one.friction else one
        for one in made.guides
    )
    heavy = not adrift and b.choose((False, True))
    made = replace(made, stops=stops, flexure_types=types, guides=guides)
    made = replace(made, gravity=(1.7, -9.6)) if heavy else made
    body, release = b.choose(made.bodies), made.release
    kind = b.choose(("velocity", "velocity", "displacement", "angle", "mode", "positions", "rates"))
    if kind == "displacement":
        point = b.near(release.body)
        release = replace(release, displacement=b.real(-3e-4, 3e-4), point=(point.real, point.imag))
    elif kind == "angle":
        release = replace(release, displacement=None, angle=b.real(-0.01, 0.01))
    elif kind == "mode":
        release = replace(release, displacement=None, mode=1, amplitude=b.real(-3e-4, 3e-4))
    elif kind in ("positions", "rates"):
        made = replace(made, bodies=_started(b, made.bodies, body, velocity=kind == "rates"))
        release = replace(release, velocity=0.0) if kind == "rates" else release
    return replace(made, release=release)


def _law(b: _Builder, stop: Stop) -> Stop:
    """Return a stop with another law, shift of its hit point, and coefficient of friction."""
    friction = b.choose((stop.friction, 0.0, 0.9))
    stop = replace(stop, offset=b.choose((0.0, b.real(-2e-3, 2e-3))), friction=friction)
    exponent, stiffness = b.choose(((1.0, 3e4), (1.5, 2e6)))
    if b.choose((False, False, True)):
        restitution = max(0.3, float(stop.restitution))
        return replace(
            stop, law=COMPLIANT, restitution=restitution, exponent=exponent,
            stiffness=stiffness * b.real(0.5, 2.0),
        )  # fmt: skip
    return stop


def _started(
    b: _Builder, bodies: Sequence[Body], chosen: Body, *, velocity: bool
) -> tuple[Body, ...]:
    """Return the bodies of which one has positions at the start, or velocities."""
    size = 0.5 if velocity else 2e-4
    names = ("start_omega", "start_vx", "start_vy") if velocity else (
        "start_angle", "start_x", "start_y",
    )  # fmt: skip
    drawn = dict(zip(names, (b.real(-size, size) for _ in names), strict=True))
    first = b.choose((0, 1, 1, 3))  # Only the angle, only the displacement, or all.
    kept = names[:1] if first == 0 else names[1:] if first == 1 else names
    given = {name: drawn[name] for name in kept}
    return tuple(replace(body, **given) if body is chosen else body for body in bodies)


def _spring(b: _Builder, i: int, names: list[str], grounds: Sequence[str]) -> Spring:
    """Return a soft spring between two bodies, or a body and the ground, with pretension or not."""
    body = b.choose(names)
    other = b.choose([*grounds, *(name for name in names if name != body)])
    end = b.near(body)
    start = end + b.disc(CELL) if other == GROUND else b.near(other)
    free = b.choose((None, b.real(0.95, 1.05) * abs(end - start)))
    return Spring(
        f"coil{i}", b.point(other, start), b.point(body, end), b.real(5.0, 40.0), free,
        b.choose((0.0, b.real(1e3, 1e5))), b.choose((0.0, b.real(0.01, 0.2))),
        b.choose(tuple(SIDES)),
    )  # fmt: skip


def _torsion(b: _Builder, joint: Joint, *, damped: bool) -> Joint:
    """Return a joint with a soft torsion spring, with a moment in the drawn shape, and a damper."""
    stiffness = b.choose((None, b.real(1e-3, 2e-2)))
    free = None if stiffness is None else b.choose((None, b.real(-0.1, 0.1)))
    damping = b.choose((None, b.real(1e-6, 2e-5))) if damped else None
    return replace(joint, stiffness=stiffness, free_angle=free, damping=damping)


def _guide(
    b: _Builder,
    i: int,
    names: list[str],
    frictions: Sequence[float | None],
    grounds: Sequence[str],
) -> Guide:
    """Return a guide of a point of a body, on a line of the ground or of another body."""
    body = b.choose(names)
    other = b.choose([*grounds, *(name for name in names if name != body)])
    at = b.near(body)
    start = b.point(other, at)
    return Guide(
        f"guide{i}", b.point(body, at), start, b.point(other, at + b.disc(CELL)),
        b.choose((True, True, False)), b.choose(frictions),
    )  # fmt: skip


def _add_free_bodies(b: _Builder) -> list[str]:
    """Add bodies that nothing connects to the ground, and return their names."""
    names = [b.add_body(complex(k, 2)) for k in range(b.choose((1, 2)))]
    for name in names:
        b.point(name, b.near(name))
    if len(names) == 2 and b.choose((False, True)):
        b.connect(*names, joint=b.choose((False, True)))
    return names


def inputs(mechanism: Mechanism, seed: int) -> dict[str, float]:
    """Return random forces, moments and a base acceleration for a mechanism."""
    rng = np.random.default_rng(seed)
    given = {"base.acceleration.x": rng.uniform(-2, 2), "base.acceleration.y": rng.uniform(-2, 2)}
    for force in mechanism.forces:
        given |= {f"{force.name}.{axis}": rng.uniform(-0.05, 0.05) for axis in "xy"}
        given[f"{force.name}.moment"] = rng.uniform(-1e-3, 1e-3)
    return {name: float(x) for name, x in given.items()}


def assembles(mechanism: Mechanism) -> bool:
    """Return whether a mechanism can be assembled: not over-constrained, and able to move."""
    try:
        assemble(mechanism, mechanism.values())
    except PrbmError:
        return False
    return True


def starts(mechanism: Mechanism) -> bool:
    """Return whether a simulation can start and the released body can move along its release."""
    try:
        sim = Simulation(mechanism)
    except (EquilibriumError, ParameterError):
        return False
    return moves(sim)


def moves(sim: Simulation) -> bool:
    """Return whether the bodies can move along the release, and as they do at the start.

    A start across a direction that the constraints almost lock has rates and energies that no
    mechanism would survive.
    """
    system = sim.system
    e = system.directions(sim.front.q)
    M, _ = inertia(system.H, np.diag(system.J), e)
    release = jacobian(system.repeat_columns(system.release[None]), e)
    rows = np.vstack([system.loop_rows.by_direction(e), release])
    own = np.setdiff1d(np.arange(system.d), system.floats)  # No coordinate moves these directions.
    M, rows = M[np.ix_(own, own)], rows[:, own]
    left, free = (
        (rows[-1] @ response(M, held, rows[-1:], system.length)).item()
        for held in (rows[:-1], rows[:0])
    )
    return left > MOBILITY_RATIO_MIN * free and _starts_freely(sim)


def _starts_freely(sim: Simulation) -> bool:
    """Return whether given velocities have not far more energy than those of the bodies alone."""
    values, alone = sim.configuration.values, 0.0
    given = given_at_start(sim.mechanism, values, VELOCITIES)
    for x in given:
        alone += 0.5 * value(x.body, "inertia" if x.turns else "mass", values) * x.value**2
    return not given or alone > MOBILITY_RATIO_MIN * sim.outputs()["energy.kinetic"]


@st.composite
def mechanisms(draw, *, starting: bool = False, **most) -> Mechanism:
    """Draw mechanisms that can be assembled and, if ``starting``, also simulated."""
    most.setdefault("free", draw(st.booleans()))
    most.setdefault("torsion", draw(st.booleans()))

    def attempt() -> Mechanism | None:
        rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
        try:
            return build(lambda options: draw(st.sampled_from(options)), rng, **most)
        except PrbmError:  # Invalid structure: for example no flexure.
            return None

    made = attempt()
    assume(made is not None and assembles(made) and (not starting or starts(made)))
    return made


def attempts(seed: int, **most) -> Iterator[Mechanism]:
    """Yield valid mechanisms that can be assembled, which depend on the seed only."""
    rng = np.random.default_rng(seed)

    def choose(options: Sequence) -> object:
        return options[int(rng.integers(len(options)))]

    while True:
        try:
            made = build(choose, rng, **most)
        except PrbmError:
            continue
        if assembles(made):
            yield replace(made, name=f"Random{seed}")


def seeded(seed: int, *, starting: bool = True, **most) -> Mechanism:
    """Return a valid mechanism that depends on the seed only."""
    return next(made for made in attempts(seed, **most) if not starting or starts(made))


def varied_attempts(seed: int) -> Iterator[Mechanism]:
    """Yield mechanisms that can be assembled, with parts of all kinds; a quarter is adrift."""
    rng = np.random.default_rng([seed, 1])
    free, torsion, adrift = rng.uniform(size=3) < (0.4, 0.7, 0.25)
    springs, guides = int(rng.integers(3)), int(rng.integers(3))
    return attempts(
        seed, free=bool(free), torsion=bool(torsion), springs=springs, guides=guides,
        adrift=bool(adrift), varied=True,
    )  # fmt: skip


def everything(seed: int) -> Mechanism:
    """Return a mechanism with parts of all kinds, which depends on the seed only."""
    return next(made for made in varied_attempts(seed) if starts(made))
