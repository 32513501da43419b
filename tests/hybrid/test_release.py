"""Releases by displacement of a point, by an angle and along a mode, in both engines."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from many_parts import cantilever
from prbm.base.errors import EquilibriumError, MechanismError, ParameterError, PrbmError
from prbm.files.mechanism_file import read_mechanism
from prbm.fmu.slave.resolved import mechanism_from, resolved
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from prbm.mechanics import independent as independent_coordinates
from prbm.mechanics.assembly import assemble
from prbm.mechanics.forces import springs
from prbm.mechanics.independent import independent
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.parts import Body, Release
from support import SUPPORT, mechanism

PIVOT = read_mechanism(SUPPORT / "pivot.toml")
FINGER = read_mechanism(SUPPORT / "finger.toml")
GUIDE = mechanism("PRBDM2R")
GUIDE = replace(GUIDE, stops=(replace(GUIDE.stops[0], position=0.1),))  # Behind the rest.
OFF_PIVOT = replace(
    PIVOT,
    geometry=tuple(
        replace(p, value=5e-3) if p.name == "eccentricity" else p for p in PIVOT.geometry
    ),
    release=Release("wheel", 90.0, 1e-4),
)
RIM, TIP = ("span", "span/2"), (0.02, -0.01)
FAR = {"stop.position": 0.1}


def released(model, release, changes=None):
    """Return a mechanism with another release, and the system with given parameters."""
    model = replace(model, release=release)
    return model, assemble(model, model.values(changes))


def stretching(model):
    return replace(model, flexure_types=tuple(replace(k, axial=True) for k in model.flexure_types))


STARTS = {
    "angle": (PIVOT, PIVOT.release),
    "angle, stretching": (stretching(PIVOT), PIVOT.release),
    "angle and velocity": (PIVOT, Release("wheel", 90.0, angle=0.03, velocity=-0.1, point=RIM)),
    "point": (PIVOT, Release("wheel", 90.0, -1e-3, point=RIM)),
    "point of a finger": (FINGER, Release("finger", 0.0, -2e-3, point=TIP)),
    "mode": (PIVOT, Release("wheel", 90.0, mode=1, amplitude=-1e-3, point=RIM)),
    "mode under gravity": (GUIDE, Release("shuttle", mode=1, amplitude=-15e-3)),
    "second mode": (stretching(FINGER), Release("finger", 90.0, mode=2, amplitude=-1e-5)),
}


@pytest.mark.parametrize("name", STARTS)
def test_the_kernel_releases_as_the_engine_does(name):
    model, release = STARTS[name]
    model = replace(model, release=release)
    engine, kernel = Simulation(model), KernelSimulation(model)
    for t in (0.0, 2e-3):
        engine.advance(t)
        kernel.advance(t)
        expected, found = engine.outputs(), kernel.outputs()
        for output in ("x", "y", "angle", "vx", "vy", "omega"):
            key = f"{release.body}.{output}"
            assert found[key] == pytest.approx(expected[key], rel=1e-7, abs=1e-10), (key, t)


@pytest.mark.parametrize("simulation", [Simulation, KernelSimulation])
@pytest.mark.parametrize("angle", [-3.0, math.pi, 6.0])
def test_a_body_is_released_from_a_rotation_near_half_a_turn_or_a_turn(simulation, angle):
    """The sine of the remaining angle also vanishes at half a turn."""
    model = mechanism("Cantilever")
    model = replace(model, release=Release("tip", angle=angle), stops=())
    assert simulation(model).outputs()["tip.angle"] == pytest.approx(angle, rel=1e-12)


@pytest.mark.parametrize("degrees", [-20.0, 5.0, 60.0])
@pytest.mark.parametrize("model", [PIVOT, stretching(PIVOT)])
def test_a_moment_holds_the_body_at_the_angle(model, degrees):
    """The moment is the derivative of the elastic energy by the angle."""
    _, system = released(model, replace(PIVOT.release, angle=0.0))

    def energy(angle):
        turned = equilibrium(system, angle).q - system.q0
        return -float(turned @ springs(system.K, turned)) / 2

    angle, step = math.radians(degrees), 1e-4
    shape = equilibrium(system, angle)
    assert system.amount(shape.q) == pytest.approx(angle, rel=1e-12)
    slope = (energy(angle + step) - energy(angle - step)) / (2 * step)
    assert shape.force == pytest.approx(slope, rel=1e-6)


def test_a_constant_moment_adds_no_stiffness():
    """The fundamental frequency about a held angle is that of its derivative by the angle."""
    _, system = released(PIVOT, replace(PIVOT.release, angle=0.0))
    wheel = PIVOT.values()["wheel.inertia"]
    for angle in (0.0, 0.1):
        behind, ahead = (equilibrium(system, angle + step).force for step in (-1e-4, 1e-4))
        stiffness = (ahead - behind) / 2e-4
        found = modes(system, equilibrium(system, angle)).frequency[0]
        assert found == pytest.approx(math.sqrt(stiffness / wheel) / (2 * math.pi), rel=0.01)


def test_the_released_point_has_the_displacement():
    """A force at the point holds it: the derivative of the elastic energy by the displacement."""
    _, system = released(FINGER, Release("finger", 30.0, point=TIP))
    frame, u = system.released, np.exp(1j * math.radians(30.0))
    tip = complex(*TIP) - frame.drawn

    def energy(x):
        turned = equilibrium(system, x).q - system.q0
        return -float(turned @ springs(system.K, turned)) / 2

    x, step = 1e-3, 1e-6
    shape = equilibrium(system, x)
    centre, _ = system.motion(frame, system.directions(shape.q), np.zeros(system.n))
    point = centre + tip * (np.exp(1j * shape.q[frame.j]) - 1)
    assert (u.conjugate() * point).real == pytest.approx(x, rel=1e-9)
    slope = (energy(x + step) - energy(x - step)) / (2 * step)
    assert shape.force == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_a_small_release_along_a_mode_vibrates_at_its_frequency(mode):
    """After one period the motion is back, and after half a period it is opposite."""
    amplitude = 1e-7
    direction, point = (90.0, None) if mode == 2 else (0.0, TIP)
    release = Release("finger", direction, mode=mode, amplitude=amplitude, point=point)
    model, system = released(stretching(FINGER), release, FAR)
    frequency = modes(system, equilibrium(system)).frequency[mode - 1]
    simulation = Simulation(model, FAR, tolerance=1e-12)
    centre = complex(0.018, 0.04)
    arm = 0j if point is None else complex(*point) - centre
    for periods, sign in ((0.0, 1.0), (0.5, -1.0), (1.0, 1.0)):
        simulation.advance(periods / frequency)
        x, y, angle = (simulation.outputs()[f"finger.{name}"] for name in ("x", "y", "angle"))
        moved = complex(x, y) + arm * (np.exp(1j * angle) - 1)
        found = moved.imag if direction else moved.real
        assert found == pytest.approx(sign * amplitude, rel=1e-6 if periods == 0.0 else 2e-3)


def test_a_release_along_a_mode_starts_from_the_rest_under_gravity():
    """The displacement from there is the amplitude, of any size."""
    for amplitude in (-15e-3, 0.0, 2e-3):
        release = Release("shuttle", mode=1, amplitude=amplitude)
        model, system = released(GUIDE, release, FAR)
        rest = system.amount(equilibrium(system).q)
        outputs = Simulation(model, FAR).outputs()
        assert outputs["shuttle.x"] == pytest.approx(rest + amplitude, abs=1e-11)


@pytest.mark.parametrize("direction", [0.0, 90.0])
@pytest.mark.parametrize("eccentricity", [0.0, 1e-6, 1e-4])
def test_a_displacement_of_a_body_that_turns_about_its_centre_is_rejected(eccentricity, direction):
    changes = {"eccentricity": eccentricity}
    _, system = released(PIVOT, Release("wheel", direction), changes)
    with pytest.raises(EquilibriumError, match=r"release.displacement = 0.0001 m: "):
        equilibrium(system, 1e-4)
    assert equilibrium(system, 0.0).force == pytest.approx(0.0, abs=1e-12)
    _, by_point = released(PIVOT, Release("wheel", 90.0, point=RIM), changes)
    turned = equilibrium(by_point, 1e-4).q[by_point.released.j]
    assert turned == pytest.approx(1e-4 / 20e-3, rel=0.1)


def test_a_centre_of_mass_off_the_pivot_can_be_displaced():
    _, system = released(PIVOT, Release("wheel", 90.0), {"eccentricity": 5e-3})
    assert equilibrium(system, 1e-4).q[system.released.j] == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize("simulation", [Simulation, KernelSimulation])
def test_a_body_that_flies_freely_does_not_change_whether_a_point_can_be_displaced(simulation):
    flying = Body("flying", 0.01, 1e-6, (0.1, 0.1), {})
    model = replace(OFF_PIVOT, bodies=(*PIVOT.bodies, flying))
    assert simulation(model).outputs()["wheel.angle"] == pytest.approx(0.02, rel=0.05)
    with pytest.raises((PrbmError, KernelMistake), match="turns the body wheel about its"):
        simulation(model, {"eccentricity": 1e-4})


@pytest.mark.parametrize("simulation", [Simulation, KernelSimulation])
def test_a_mode_with_the_frequency_of_another_one_has_no_shape_of_its_own(simulation):
    """Two equal pendulums have each frequency twice."""
    release = Release("tip", 90.0, mode=1, amplitude=1e-3)
    one = replace(cantilever(damping_beta=0.0), release=release)
    assert simulation(one).outputs()["tip.y"] != 0.0
    tip, leaf = one.bodies[0], one.flexures[0]
    two = replace(
        one,
        bodies=(tip, replace(tip, name="other")),
        flexures=(leaf, replace(leaf, name="leaf2", end="other.end")),
    )
    with pytest.raises((PrbmError, KernelMistake), match="another mode has the same frequency"):
        simulation(two)


def test_a_shape_on_the_way_to_the_release_need_not_exist(monkeypatch):
    """The motion begins in the released shape."""
    expected = independent(PIVOT)
    found = {1.0: None, 0.5: None, 0.0: None}

    def start_shape(system, values, fraction=1.0):
        if found[fraction] is None:
            raise EquilibriumError(f"no shape at {fraction}")
        return found[fraction]

    system = assemble(PIVOT, PIVOT.values())
    monkeypatch.setattr(independent_coordinates, "start_shape", start_shape)
    with pytest.raises(EquilibriumError, match=r"no shape at 1\.0"):
        independent(PIVOT)
    found[1.0] = system.q0
    assert independent(PIVOT) == expected


def test_the_kernel_rejects_starts_that_changed_parameters_make_impossible():
    """An FMU gets these values after its export."""
    guide = replace(GUIDE, release=Release("shuttle", 90.0, mode=1, amplitude=1e-5))
    for model, changes, message in (
        (OFF_PIVOT, {"eccentricity": 1e-4}, "turns the body wheel about its released point"),
        (guide, FAR | {"gravity.x": 0.0}, "this mode does not move the released point of shuttle"),
        (guide, FAR | {"release.amplitude": 0.01}, "no shape along mode 1 has this amplitude"),
    ):
        with pytest.raises(KernelMistake, match=message):
            KernelSimulation(model, changes)


MISTAKES = {
    "two starts": (
        {"displacement": 1e-3, "angle": 0.1},
        "release.angle excludes release.displacement",
    ),
    "angle and mode": ({"angle": 0.1, "mode": 1, "amplitude": 1e-3}, "excludes release.angle"),
    "mode alone": ({"mode": 1}, "release.mode is given without release.amplitude"),
    "amplitude alone": ({"amplitude": 1e-3}, "release.amplitude is given without release.mode"),
    "mode 0": ({"mode": 0, "amplitude": 1e-3}, "must be the number of a mode"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_an_inconsistent_release_is_rejected(mistake):
    keys, message = MISTAKES[mistake]
    with pytest.raises(MechanismError, match=message):
        replace(PIVOT, release=Release("wheel", **keys))


WITHOUT_MOTION = {
    "too many modes": (Release("shuttle", mode=9, amplitude=1e-3), "the mechanism has 5 modes"),
    "a mode across": (
        Release("shuttle", 90.0, mode=1, amplitude=1e-3),
        "this mode does not move the released point of shuttle",
    ),
    "too large an amplitude": (
        Release("shuttle", mode=1, amplitude=0.5),
        "release.amplitude = 0.5 m: no shape along mode 1",
    ),
    "a body that cannot turn": (Release("shuttle", angle=1e-3), "the body shuttle cannot turn"),
}


@pytest.mark.parametrize("mistake", WITHOUT_MOTION)
def test_a_release_without_motion_is_rejected_with_a_remedy(mistake):
    release, message = WITHOUT_MOTION[mistake]
    with pytest.raises(PrbmError, match=message):
        Simulation(replace(GUIDE, release=release), FAR | {"gravity.x": 0.0})


def test_the_start_is_a_parameter_with_its_unit():
    for release, name, unit in (
        (Release("wheel"), "displacement", "m"),
        (Release("wheel", angle=0.1), "angle", "rad"),
        (Release("wheel", mode=1, amplitude=1e-3, point=RIM, direction=90.0), "amplitude", "m"),
    ):
        known = {p.name: p for p in replace(PIVOT, release=release).parameters}
        starts = {key for key in known if key.startswith("release.")}
        assert starts == {f"release.{name}", "release.velocity"}
        assert known[f"release.{name}"].unit == unit


def test_a_python_fmu_keeps_the_release():
    for model, release in STARTS.values():
        model = replace(model, release=release)
        data = json.loads(json.dumps(resolved(model, interface(model, {}))))
        assert mechanism_from(data["mechanism"]).release == release


def test_a_file_names_the_point_and_gives_the_angle_in_degrees(tmp_path):
    text = (SUPPORT / "pivot.toml").read_text(encoding="utf-8")
    assert PIVOT.release.angle == pytest.approx(math.radians(-5.0), rel=1e-12)
    path = tmp_path / "pivot.toml"
    path.write_text(
        text.replace('angle = "-5 deg"', 'displacement = "-1 mm"\npoint = "wheel.rim"'),
        encoding="utf-8",
    )
    assert read_mechanism(path).release.point == RIM
    for old, message in (
        ('point = "wheel.hub"', r"release.point = 'wheel.hub' is not a point of the body wheel"),
        ("mode = 0\namplitude = 1e-3", "release.mode = 0"),
        ('angle = "5 mm"', "release.angle = '5 mm'"),
        ('displacement = "1 mm"\nangle = 0.1', "excludes release.displacement"),
    ):
        path.write_text(text.replace('angle = "-5 deg"', old), encoding="utf-8")
        with pytest.raises(MechanismError, match=message):
            read_mechanism(path)


def test_a_release_at_a_wall_is_rejected_with_the_penetration():
    model = replace(PIVOT, release=replace(PIVOT.release, angle=0.2))
    with pytest.raises(ParameterError, match="the wall stop is penetrated"):
        Simulation(model)
