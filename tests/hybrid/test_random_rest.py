"""Random mechanisms at rest with friction at stops and points obey the laws of all contacts."""

from dataclasses import replace

import numpy as np
import pytest

from kernel_simulation import KernelMistake, KernelSimulation
from prbm.base.errors import SimulationError
from prbm.base.tolerances import FRICTION_EXCESS_RTOL
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactMode
from support import mechanism

ERROR_SHARE_MAX = 0.0
"""Largest share of errors: no contact slides at rest, so that there is always a solution."""


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


def violations(sim):
    """Yield the laws that contacts violate."""
    equations, front, zero = sim.equations, sim.front, sim.configuration.scales.zero_acceleration
    a, lam, _, _ = equations.evaluate(front.time, front.q, front.v)
    opening = equations.gap_accelerations(front.time, front.e, front.v, a)
    forces, rubbing = equations.stop_forces(lam), [*equations.stop_friction, 0.3]
    for c, mode in enumerate(sim.contacts.modes):
        if c < 3 and mode.closed and forces[c] < -1e-9:  # N, round-off
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


def search(draws, seed, engines=(Simulation, KernelSimulation), compared=True):
    """Return the number of errors of each engine; if ``compared``, their motions must agree."""
    rng, guide, errors = np.random.default_rng(seed), walled(), [0] * len(engines)
    for _ in range(draws):
        values, ends = drawn(rng), []
        for k, engine in enumerate(engines):
            try:
                sim = engine(guide, values)
                if engine is Simulation:
                    assert not [*violations(sim)], values
                sim.advance(5e-5)
                ends.append([sim.outputs()[f"shuttle.{name}"] for name in ("vx", "vy", "omega")])
            except (SimulationError, KernelMistake):
                errors[k] += 1
        if compared and len(ends) == 2:
            assert ends[0] == pytest.approx(ends[1], rel=1e-5, abs=1e-9), values
    return errors


def test_a_random_mechanism_at_rest_obeys_all_laws():
    assert max(search(40, seed=0)) <= 40 * ERROR_SHARE_MAX


@pytest.mark.slow
def test_1000_random_mechanisms_at_rest_obey_all_laws():
    """The three stops share their load in more than one way: in some draws the engines differ."""
    assert max(search(1000, seed=1, compared=False)) <= 1000 * ERROR_SHARE_MAX
