"""The default experiment of mechanisms of any size, and its reference results."""

import dataclasses
import itertools
import time

import numpy as np
import pytest

from prbm.files.mechanism_file import shipped
from prbm.fmu import reference_results as reference
from prbm.fmu.documentation import native_page, page
from prbm.fmu.export import Export
from prbm.fmu.native_fmu import described
from prbm.fmu.start import interface
from prbm.hybrid.simulation import Simulation
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Flexure, FlexureType, Release, Stop
from prbm.runs.experiment import Experiment, experiment
from prbm.runs.run import simulate
from support import COSTLY_MODELS, mechanism


def guide(size, model="2R", **section):
    """Return a steel guide of a size [m]; guides of all sizes are geometrically similar."""
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


FAST = {"CurvedBistable": 0.1, "NotchGuide": 0.2}  # Ten periods [s] of more than 25 Hz.


@pytest.mark.parametrize("name", shipped())
def test_default_experiments_of_shipped_mechanisms_take_one_second_or_ten_periods(name):
    assert experiment(mechanism(name)) == Experiment(FAST.get(name, 1.0))
    assert Experiment().step == 1e-3


@pytest.mark.parametrize("size", [2e-5, 2e-4, 0.02, 0.2, 20.0])
def test_default_experiments_have_1_to_25_periods_at_any_size(size):
    """If an experiment is not one second, it has about ten periods, each of 40 rows or more."""
    scaled = guide(size)
    chosen = experiment(scaled)
    frequency = Simulation(scaled).outputs()["mode.frequency"]
    assert 1.0 <= chosen.stop_time * frequency <= 25.0
    assert chosen.step * frequency <= 1.0 / 40.0
    if not 1.0 <= frequency <= 25.0:
        assert 5.0 <= chosen.stop_time * frequency <= 20.0
    assert chosen.step == pytest.approx(chosen.stop_time / 1000, rel=1e-15)


def test_motion_scales_with_the_size_of_the_mechanism():
    """Without gravity, lengths and times are proportional to the size, energies to its cube."""
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


@pytest.mark.slow
@pytest.mark.parametrize(("links", "axial"), [(40, True), (12, False)])
def test_reference_results_are_omitted_if_they_take_minutes(links, axial, monkeypatch):
    """The first chain is excluded by its frequencies, the second one after 5,000 steps."""
    monkeypatch.setattr(reference, "STEPS_MAX", 2.5e4)
    messages: list[str] = []
    chain = guide(0.1, "nR", n=links, axial=axial)
    taken = []
    take_step = Simulation._take_step
    monkeypatch.setattr(Simulation, "_take_step", lambda sim: [taken.append(1), take_step(sim)])
    assert reference.reference(chain, {}, (), experiment(chain), messages.append) == ()
    assert len(taken) < 5_100 if links == 12 else not taken
    assert messages[-1] == f"no reference results: {reference.SLOW}"


def test_reference_results_of_shipped_mechanisms_are_not_excluded_by_their_frequencies():
    for name in ("PRBDM2R", *COSTLY_MODELS):
        assert reference.steps(mechanism(name), {}, Experiment()) < reference.STEPS_MAX


@pytest.mark.slow
def test_versions_of_fmi_share_the_reference_results_of_many_mechanisms(monkeypatch):
    """All FMUs of one version are built before those of the next."""
    computed: list[str] = []
    simulate = reference.simulate

    def counted(one, *arguments, **options):
        computed.append(one.name)
        return simulate(one, *arguments, **options)

    monkeypatch.setattr(reference, "simulate", counted)
    short = Experiment(0.003)
    chosen = [dataclasses.replace(mechanism("PRBDM"), name=f"Guide{k}") for k in range(8)]
    for _ in ("FMI 2.0", "FMI 3.0"):
        for one in chosen:
            assert reference.reference(one, {}, interface(one, {}), short)
    assert computed == [one.name for one in chosen]


@pytest.mark.slow
def test_the_computation_of_reference_results_reports_its_progress(monkeypatch):
    """The clock advances by a second at each of the 1001 communication points."""
    clock = itertools.count()
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    messages: list[str] = []
    small = mechanism("PRBDM")
    variables = interface(small, {})
    assert reference.reference(
        small, {"stop.offset": 1e-3}, variables, Experiment(), messages.append
    )
    assert messages[0] == "reference results   0% done"
    assert "reference results  50% done, 8 min left" in messages
    assert len(messages) == 200


def test_damping_increases_the_estimated_number_of_steps():
    """The step is limited to 1/(beta omega^2) of the fastest mode."""
    quiet = dataclasses.replace(guide(0.1), damping_beta=0.0)
    plain = reference.steps(quiet, {}, Experiment())
    omega = plain * reference.STABLE_STEP_FACTOR
    damped = reference.steps(quiet, {"damping.beta": 10 / omega}, Experiment())
    assert damped == pytest.approx(10 * plain)


@pytest.mark.parametrize("inside", [True, False])
def test_the_documentation_shows_the_experiment_and_included_results(inside):
    small = guide(1e-5)
    chosen = experiment(small)
    native = described(Export(small), 3)
    html = native_page(small, native, 3, ["x86_64-linux"], chosen, inside)
    assert f"stop_time={chosen.stop_time:g}," in html
    assert ("reference results" in html) == inside
    assert f"stop_time={chosen.stop_time:g}," in page(small, interface(small, {}), chosen)
