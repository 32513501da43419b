"""The law of compliant stops: the factor of its damping, its forces and energies."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from prbm.mechanics.compliance import ComplianceLaw, damping_factor
from prbm.mechanics.contact_state import ContactPhase, Phase


def work_ratio(a, e):
    """Return the energies of a point mass before and after a contact, each over k d^(n+1)/(n+1).

    With u = d'/v0, m u du/(1 + a u) = -k d^n dd / v0^2, so that both integrals are equal.
    """
    before = quad(lambda u: u / (1 + a * u), 0, 1, epsabs=1e-14)[0]
    after = quad(lambda u: u / (1 + a * u), 0, -e, epsabs=1e-14)[0]
    return before, after


@pytest.mark.parametrize("e", [0.05, 0.3, 0.6, 0.9, 0.99, 0.999])
def test_the_factor_gives_the_restitution_of_a_point_mass(e):
    before, after = work_ratio(damping_factor(e), e)
    assert after == pytest.approx(before, rel=2e-6 if e < 0.1 else 1e-9)


@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0))
def test_the_factor_falls_with_the_restitution(e, other):
    low, high = sorted((e, other))
    assert damping_factor(low) >= damping_factor(high) * (1 - 1e-6)


@pytest.mark.parametrize("e", [0.03, 0.9999])
def test_the_factor_is_continuous_between_its_formulas(e):
    beside = damping_factor(e * (1 - 1e-9)), damping_factor(e * (1 + 1e-9))
    assert beside[0] == pytest.approx(beside[1], rel=1e-3 if e > 0.5 else 1e-7)


def test_the_phases_join_continuously():
    law = ComplianceLaw(1e6, 1.5, damping_factor(0.5))
    pressed, d = ContactPhase(Phase.PRESSED, 0.2), 1e-5
    rising = law.force(ContactPhase(Phase.RISING, 0.2), d, 0.3)
    assert law.force(pressed, d, 0.2) == pytest.approx(rising, rel=1e-14)
    free = law.force(ContactPhase(Phase.FREE, 0.2), d, -0.3)
    assert law.force(pressed, d, -0.2 / law.damping) == pytest.approx(free, abs=1e-12)


@given(st.floats(-1e-3, 1e-3), st.floats(1.0, 3.0))
def test_the_elastic_force_is_the_slope_of_the_energy(d, n):
    law, h = ComplianceLaw(1e6, n, 0.0), 1e-7
    slope = (law.energy(d + h) - law.energy(d - h)) / (2 * h)
    assert slope == pytest.approx(law.elastic_force(d), abs=1e-5 * 1e6 * 1e-3**n + 1e-1)


def test_the_tangent_is_the_slope_of_the_elastic_force():
    law, d, h = ComplianceLaw(2e6, 1.5, 0.3), 1e-4, 1e-8
    slope = (law.elastic_force(d + h) - law.elastic_force(d - h)) / (2 * h)
    assert slope == pytest.approx(law.tangent(d), rel=1e-7)
    assert math.copysign(1.0, law.elastic_force(-d)) == -1.0
