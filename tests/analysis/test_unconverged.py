"""Searches of the tools that do not converge are errors with a remedy."""

import numpy as np
import pytest

from prbm.analysis.fit import Free, Frequency, fit, problem, valley
from prbm.base.errors import EquilibriumError
from prbm.data.uncertainty import Estimate, EvaluationError
from prbm.drawing import motion
from prbm.mechanics.assembly import assemble
from prbm.references import beams
from prbm.systems.components import CouplingError
from prbm.systems.model_exchange import Model
from support import mechanism


def bistable():
    guide = mechanism("Bistable")
    return assemble(guide, guide.values())


@pytest.mark.slow
def test_a_valley_whose_fits_do_not_converge_is_rejected(monkeypatch):
    free = [Free("K_theta1", 1.0, 9.0), Free("K_theta2", 1.0, 9.0)]
    free = [Free(f"flexure.{one.name}", one.lower, one.upper) for one in free]
    found = fit(mechanism("PRBDM2R"), free, [Frequency(Estimate(5.0, 0.01))])
    monkeypatch.setattr(problem, "STEPS_MAX", 1)
    with pytest.raises(EvaluationError, match=r"the fit with flexure\.K_theta. = .* did not conv"):
        valley(found, points=3)


def test_stretches_that_are_not_found_are_rejected(monkeypatch):
    system = bistable()
    monkeypatch.setattr(motion, "STRETCH_ITERATIONS_MAX", 1)
    with pytest.raises(EquilibriumError, match="no stretches of the flexures place the bodies"):
        motion.stretched(system, system.q0[None], {"shuttle": np.array([-3e-3j])})


def test_a_mode_of_a_beam_that_is_not_found_is_rejected():
    with pytest.raises(EquilibriumError, match="mode 1 of a cantilever with mass = nan"):
        beams.wavenumber(1, mass=np.nan)


def test_the_fundamental_mode_under_a_large_mass_is_not_missed():
    """The beam acts as a massless spring, b^4 = 3/mu; its second mode has b = 3.93."""
    assert beams.wavenumber(1, mass=1e15) == pytest.approx((3e-15) ** 0.25, rel=1e-6)


def test_a_model_that_requests_endless_updates_is_rejected(monkeypatch):
    model = Model.__new__(Model)
    model.time = 0.5
    monkeypatch.setattr(Model, "call", lambda *_: (True, *[False] * 4, 0.0), raising=False)
    with pytest.raises(CouplingError, match=r"at 0\.5 s the model requests more than 1000 updates"):
        model.update()
