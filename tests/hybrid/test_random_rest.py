"""Random mechanisms at rest with friction at stops and points obey the laws of all contacts.

At rest nothing slides, so that there always are forces: no draw may raise an error.
"""

from dataclasses import replace

import numpy as np
import pytest

from kernel_simulation import KernelSimulation
from prbm.base.tolerances import FRICTION_EXCESS_RTOL
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactMode
from support import mechanism


def walled():
    """Return a guide with three stops along one wall, apart from each other."""
    guide = mechanism("PRBDM2RAxial")
    stops = tuple(
        replace(guide.stops[0], name=f"wall{k}", offset=0.004 * (k - 1)) for k in range(3)
    )
    return replace(guide, name="Walled", stops=stops)


def drawn(rng):
    """Return loads and coefficients of friction."""
    values = {
        "release.displacement": 0.0, "friction.coefficient": 0.3,
        "friction.normal_force": rng.uniform(0.02, 1.0), "base.acceleration.x": rng.uniform(-15, 5),
        "force.y": 3.0 * rng.standard_normal(), "force.moment": 0.03 * rng.standard_normal(),
    }  # fmt: skip
    values |= {f"wall{k}.friction": rng.choice([0.0, rng.uniform(0.1, 1.5)]) for k in range(3)}
    return {name: float(x) for name, x in values.items()}


def violations(front, zero):
    """Yield the laws that contacts violate; accelerations up to ``zero`` are round-off."""
    equations, contacts = front.equations, front.contacts
    a, lam, *_ = equations.evaluate(front.time, front.q, front.v)
    opening = equations.gap_accelerations(front.time, front.e, front.v, a)
    forces, rubbing = equations.stop_forces(lam), [*equations.stop_friction, 0.3]
    for c, mode in enumerate(contacts.modes):
        if c < 3 and mode.closed and not forces[c] > 0.0:
            yield f"wall{c} pulls"
        if not mode.closed and opening[c] < -zero:
            yield f"wall{c} closes"
        if mode is ContactMode.STICK:
            friction, limit = equations.friction(c, front.e, lam)
            if abs(friction) > (1 + FRICTION_EXCESS_RTOL) * limit:
                yield f"contact {c} sticks beyond its limit"
        elif mode.closed and rubbing[c] > 0.0:
            rate = equations.slip_acceleration(c, front.e, front.v, a)
            if mode.slip * rate < -zero:
                yield f"contact {c} slips against its acceleration"


def search(draws, seed, compared=True):
    """Check the laws in both engines, whose motions may be compared."""
    rng, guide = np.random.default_rng(seed), walled()
    for _ in range(draws):
        values = drawn(rng)
        sims = Simulation(guide, values), KernelSimulation(guide, values)
        front, zero = sims[0].front, sims[0].configuration.scales.zero_acceleration
        assert not [*violations(front, zero)], values
        modes = tuple(ContactMode(mode) for mode in sims[1].modes())
        front = front.with_contacts(replace(front.contacts, modes=modes)).projected()
        assert not [*violations(front, zero)], values
        for sim in sims:
            sim.advance(5e-5)
        motions = [[sim.outputs()[f"shuttle.{v}"] for v in ("vx", "vy", "omega")] for sim in sims]
        if compared:
            assert motions[0] == pytest.approx(motions[1], rel=1e-5, abs=1e-9), values


@pytest.mark.slow
def test_a_random_mechanism_at_rest_obeys_all_laws():
    search(40, seed=0)


@pytest.mark.slow
def test_1000_random_mechanisms_at_rest_obey_all_laws():
    """Three stops share their load in more than one way: motions are not compared."""
    search(1000, seed=1, compared=False)
