"""The default experiment shows the motion of a mechanism, be it of micrometres or of metres."""

import dataclasses

import numpy as np
import pytest

from prbm.files.mechanism_file import shipped
from prbm.fmu import reference_results as reference
from prbm.fmu.documentation import native_page, page
from prbm.fmu.native_fmu import described
from prbm.fmu.python_fmu import interface
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Release, Stop
from prbm.runs.experiment import Experiment, experiment
from prbm.runs.run import simulate
from support import COSTLY_MODELS, mechanism


def guide(size, model="2R", **section):
    """Return a steel guide of a size [m], similar to those of other sizes."""
    leaf = FlexureType("leaf", model, 0.01 * size, 0.1 * size, 2e11, 7800.0, **section)
    return Mechanism(
        name="Scaled",
        title="A guide of any size",
        ground={"a": (0.0, 0.0), "b": (size, 0.0)},
        bodies=(
            Body(
                "shuttle", 20.0 * size**3, 2.0 * size**5, (size / 2, 1.1 * size),
                {"p": (0.0, size), "q": (size, size), "nose": (1.1 * size, 1.1 * size)},
            ),
        ),
        flexure_types=(leaf,),
        flexures=(
            Flexure("f", "leaf", "ground.a", "shuttle.p"),
            Flexure("g", "leaf", "ground.b", "shuttle.q"),
        ),
        release=Release("shuttle", displacement=-0.05 * size),
        stops=(Stop("wall", "shuttle", (1.1 * size, 1.1 * size), position=0.0, rest_speed=0.0),),
    )  # fmt: skip


@pytest.mark.parametrize("name", shipped())
def test_of_the_shipped_mechanisms_it_is_a_second(name):
    assert experiment(mechanism(name)) == Experiment(1.0)
    assert Experiment().step == 1e-3


@pytest.mark.parametrize("size", [2e-5, 2e-4, 0.2, 20.0])
def test_it_shows_some_periods_at_any_size(size):
    """Between one and a thousand, and not one in a few communication steps."""
    scaled = guide(size)
    chosen = experiment(scaled)
    frequency = Simulation(scaled).outputs()["mode.frequency"]
    assert 1.0 <= chosen.stop_time * frequency <= 1000.0
    if not 1.0 <= frequency <= 1000.0:
        assert 5.0 <= chosen.stop_time * frequency <= 20.0
    assert chosen.step == pytest.approx(chosen.stop_time / 1000, rel=1e-15)


def test_similar_mechanisms_move_alike():
    """Without gravity lengths, times go with the size: displacements, impacts, energies scale."""
    small, large = 1e-4, 1.0
    found = []
    for size in (small, large):
        scaled = guide(size)
        period = 1 / Simulation(scaled).outputs()["mode.frequency"]
        result = simulate(scaled, stop_time=0.9 * period, step=0.03 * period)
        found.append((result, period))
    (a, t_a), (b, t_b) = found
    assert t_a / t_b == pytest.approx(small / large, rel=1e-9)
    x_a, x_b = a["shuttle.x"] / small, b["shuttle.x"] / large
    np.testing.assert_allclose(x_a, x_b, atol=1e-9)
    assert [i.time / t_a for i in a.impacts] == pytest.approx([i.time / t_b for i in b.impacts])
    assert len(a.impacts) >= 1
    energy_a, energy_b = (r["energy.elastic"] for r, _ in found)
    np.testing.assert_allclose(energy_a / small**3, energy_b / large**3, rtol=1e-6)


def test_reference_results_are_left_out_where_they_would_take_minutes():
    told: list[str] = []
    stiff = guide(0.1, "nR", n=40, axial=True)
    assert reference.reference(stiff, {}, (), experiment(stiff), told.append) == {}
    assert told == ["no reference results: the default experiment takes the Python engine minutes"]
    for name in ("PRBDM2R", *COSTLY_MODELS):
        assert reference.steps(mechanism(name), {}, Experiment()) < reference.STEPS_MAX


def test_damping_shortens_the_steps_that_are_expected():
    """By 1/(beta omega^2), of the fastest mode."""
    quiet = dataclasses.replace(guide(0.1), damping_beta=0.0)
    plain = reference.steps(quiet, {}, Experiment())
    omega = plain * reference.STABLE_STEP_FACTOR
    damped = reference.steps(quiet, {"damping.beta": 10 / omega}, Experiment())
    assert damped == pytest.approx(10 * plain)


@pytest.mark.parametrize("inside", [True, False])
def test_the_page_shows_the_experiment_and_tells_of_results_that_are_inside(inside):
    small = guide(1e-5)
    chosen = experiment(small)
    native = described(small, {}, 3)
    html = native_page(small, native, 3, ["x86_64-linux"], chosen, inside)
    assert f"stop_time={chosen.stop_time:g}," in html
    assert ("outputs of the default experiment" in html) == inside
    assert f"stop_time={chosen.stop_time:g}," in page(small, interface(small, {}), chosen)
