"""FMUs log an unstable equilibrium and an unstable shape at release, as the Python engine does."""

import pytest

import fmu_host
import prbm
from native_host import INTERFACES, Instance
from prbm.hybrid.simulation import Simulation

pytestmark = [pytest.mark.fmu, pytest.mark.native]

HEAVY = {"gravity.x": 0.0, "gravity.y": -1600.0, "release.displacement": -1e-3}


@pytest.fixture(scope="module")
def sentences():
    """Return the sentences of the Python engine."""
    found = Simulation(prbm.load("PRBDM2R"), HEAVY).instability()
    assert found.rest > found.release > 0
    return found.sentences


@pytest.mark.parametrize(("fmi", "kind"), INTERFACES)
def test_native_fmus_log_the_instability_of_the_python_engine(native, fmi, kind, sentences):
    with Instance(native["PRBDM2R", fmi], kind).initialize(values=HEAVY) as instance:
        assert all(instance.logged(sentence) for sentence in sentences)
    with Instance(native["PRBDM2R", fmi], kind).initialize() as instance:
        assert not instance.logged("is unstable")


def test_a_python_fmu_logs_the_instability_of_the_python_engine(fmus, sentences):
    with fmu_host.Instance(fmus["PRBDM2R"]) as instance:
        instance.set(HEAVY)
        instance.initialize()
        logged = "\n".join(instance.messages)
        assert all(sentence in logged for sentence in sentences)
