"""A struck body with a second mass behind it: its contact is free before the gap opens."""

import dataclasses
import math

import pytest
from scipy.integrate import solve_ivp

from point_mass import LENGTH, point_mass
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.compliance import damping_factor
from prbm.mechanics.modal import modes_at
from prbm.mechanism.parts import Body, Flexure
from support import energy_balance

STIFFNESS = 1e5  # N/m
SPEED = 0.02  # m/s


def coupled(ratio, young, restitution):
    """Return a mass of 1 kg with a second one behind it, at rest, on springs between them.

    The second mass is ``ratio`` kg, and ``young`` is the modulus of the springs [Pa].
    """
    own = point_mass(
        mass=1.0, displacement=-1e-9, velocity=SPEED, stiffness=STIFFNESS, restitution=restitution
    )
    half, (leaf,) = LENGTH / 2, own.flexure_types
    points = {"left": (-half, 2 * LENGTH), "right": (half, 2 * LENGTH)}
    second = Body("second", ratio, 0.01 * ratio * LENGTH**2, (0.0, 2 * LENGTH), points)
    spring = dataclasses.replace(leaf, name="spring", thickness=1e-3, youngs_modulus=young)
    springs = [Flexure(f"spring_{p}", "spring", f"mass.{p}", f"second.{p}") for p in points]
    return dataclasses.replace(
        own,
        bodies=(*own.bodies, second),
        flexure_types=(leaf, spring),
        flexures=(*own.flexures, *springs),
    )


def with_spring(ratio, share, restitution):
    """Return the two masses; the spring between them has a share of the contact stiffness."""
    trial = Simulation(coupled(ratio, 1e11, restitution))
    omega = 2 * math.pi * modes_at(trial.system, trial.state()[: trial.system.n]).frequency.max()
    young = 1e11 * share * STIFFNESS * (1 + 1 / ratio) / omega**2
    return coupled(ratio, young, restitution)


def integrated(ratio, share, restitution, speed):
    """Return duration, loss, rebound speed and impulse of the contact.

    The independent integration has the states x, x', y, y', v0, loss and impulse.
    """
    k, a = STIFFNESS, damping_factor(restitution)

    def rate(t, state):
        x, u, y, w, v0, _, _ = state
        force = k * max(x, 0.0) * max(0.0, 1 + a * u / max(v0, u))
        acceleration = share * k * (y - x) - force
        rise = acceleration if u >= v0 and acceleration > 0 else 0.0
        return u, acceleration, w, share * k * (x - y) / ratio, rise, (force - k * x) * u, force

    opens = lambda t, state: state[0]  # noqa: E731
    opens.terminal, opens.direction = True, -1
    path = solve_ivp(
        rate, (0, 1), (1e-12, speed, 0, 0, speed, 0, 0), "DOP853", events=opens, rtol=1e-10,
        atol=1e-15, max_step=0.02 / math.sqrt(k),
    )  # fmt: skip
    _, u, _, _, _, loss, impulse = path.y[:, -1]
    return path.t[-1], loss, -u, impulse


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize(
    ("ratio", "share", "restitution"),
    [(1.0, 3.0, 0.3), (0.5, 3.0, 0.3), (0.5, 1.0, 0.05)],
)
def test_a_second_mass_ends_the_force_before_the_gap_opens(engine, ratio, share, restitution):
    """Up to a quarter of the energy is then in the indentation, which recovers without force."""
    sim = engine(with_spring(ratio, share, restitution))
    start, free = energy_balance(sim.outputs()), 0
    sim.advance(1e-4)
    while sim.outputs()["stop.contact"]:
        sim.advance(sim.time + 2e-4)
        out = sim.outputs()
        free += out["stop.force"] == 0.0 and out["stop.gap"] < 0.0
        assert energy_balance(out) == pytest.approx(start, rel=3e-5)
    expected = integrated(ratio, share, restitution, out["stop.approach_speed"])
    found = [
        out[f"stop.{name}"]
        for name in ("contact_duration", "energy_lost", "rebound_speed", "impulse")
    ]
    assert found == pytest.approx(expected, rel=5e-5)
    assert out["stop.impact_count"] == 1
    assert free > 5
