"""Nominal values of the states, from which solvers derive their absolute tolerances."""

import re
from collections import defaultdict

import numpy as np
import pytest

from native_host import Instance
from support import case, each_shipped, record

pytestmark = [pytest.mark.fmu, pytest.mark.native]

KINDS = {
    "angle": r"\.angle$", "rate": r"\.(omega|strain_rate)$", "strain": r"\.strain$",
    "energy": r"^energy\.dissipated$",
}  # fmt: skip
RATIO_MAX = 100.0


def kind_of(name: str) -> str:
    return next((kind for kind, pattern in KINDS.items() if re.search(pattern, name)), "work")


@each_shipped
def test_nominal_values_are_of_the_order_of_the_motion(native, model):
    """Each is compared with the largest change of a state of the same kind.

    Rates are compared up to the first impact, which excites modes of high frequency.
    """
    it = case(model)
    smooth = record(model)[0].time
    rows, times = [], np.linspace(0.0, it.end, 301)[1:]
    with Instance(native[model, 3], "cs").initialize() as instance:
        states = [u.variable.derivative for u in instance.description.derivatives]
        names = [s.name for s in states]
        for time in times:
            rows.append(instance.get(*names))
            instance.advance(time)
    nominal, moved = defaultdict(list), defaultdict(list)
    for state, column in zip(states, np.transpose(rows), strict=True):
        kind = kind_of(state.name)
        nominal[kind].append(float(state.nominal))
        moved[kind].append(np.ptp(column[times < smooth] if kind == "rate" else column))
    for kind in nominal.keys() - {"work"}:
        (value,) = {*nominal[kind]}
        assert 1 / RATIO_MAX < max(moved[kind]) / value < RATIO_MAX, kind


def test_a_smaller_amplitude_has_smaller_nominal_values(native):
    """Angles and rates are proportional to it, energies to its square."""
    found = []
    for displacement in (-0.018, -0.0018):
        with Instance(native["PRBDM2R", 3], "me") as instance:
            instance.initialize(values={"release.displacement": displacement})
            found.append(nominals(instance))
    large, small = found
    assert large[0] / small[0] == pytest.approx(10.0)
    assert large[5] / small[5] == pytest.approx(10.0)
    assert large[-2] / small[-2] == pytest.approx(100.0)


def nominals(instance: Instance) -> np.ndarray:
    count = instance.description.numberOfContinuousStates
    values = np.zeros(count)
    pointer = np.ctypeslib.as_ctypes(values)
    instance.fmu.getNominalsOfContinuousStates(pointer, count)
    return values


def test_nominal_values_are_part_of_a_saved_state(native):
    changed = {"release.displacement": -0.0018}
    with Instance(native["PRBDM2R", 3], "me").initialize(values=changed) as instance:
        instance.advance(0.01)
        expected, data = nominals(instance), instance.saved()
    with Instance(native["PRBDM2R", 3], "me") as other:
        other.restore(data)
        assert [*nominals(other)] == [*expected]
