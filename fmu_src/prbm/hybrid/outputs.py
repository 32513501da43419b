"""Outputs of a simulation by name, in SI units, at a time and a state."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..mechanics import contact, forces
from ..mechanics.arrays import Complex, Real
from ..mechanics.compliant_stops import CompliantState
from ..mechanics.dynamics import Equations, Evaluation, base_reaction
from ..mechanics.kinetics import kinetic_energy
from ..mechanics.stress import stresses
from ..mechanics.system import ANGLE, STRAIN, System
from ..mechanism.parts import value
from .front import Latched
from .peaks import PeakRecord, Sample

Outputs = dict[str, float | int | bool]

LATCHED = (
    "impact_count", "impact_time", "approach_speed", "rebound_speed", "impulse", "energy_lost",
    "modal_restitution", "impulse_sum",
)  # fmt: skip
"""Latched outputs of all stops."""
COMPLIANT = ("peak_force", "indentation", "contact_duration")
"""Further latched outputs of compliant stops."""


def all_outputs(
    equations: Equations,
    latched: Sequence[Latched],
    peaks: PeakRecord,
    t: float,
    y: Real,
    others: Mapping[str, float],
) -> Outputs:
    """Return all outputs.

    Parameters
    ----------
    equations : Equations
        Equations of motion at the time.
    latched : (s,) sequence of Latched
        The last impact of each stop.
    peaks : PeakRecord
        The peaks of the stress.
    t, y : float, (2 n + 2 + 4 c,)
        Time [s] and state.
    others : mapping
        Values of the constant outputs.
    """
    system, n = equations.system, equations.n
    q, v = y[:n], y[n : 2 * n]
    e = system.directions(q)
    evaluation, extras = equations.at(t, y), y[2 * n + 2 :]
    a, M, own = evaluation.a, evaluation.M, equations.compliant
    out: Outputs = {**motions(system, q, v, e)}
    out |= _stops(equations, t, y, e, evaluation)
    out |= _springs(equations, e, v)
    out |= _guides(system, evaluation.lam)
    force, moment = base_reaction(equations, q, v, a)
    out["base.force.x"], out["base.force.y"] = force.real, force.imag
    out["base.moment"] = moment
    out["energy.kinetic"] = kinetic_energy(M, v)
    contact_energy = own.energy(equations.gaps(t, e, extras)) if own.stops else 0.0
    out["energy.elastic"] = equations.elements.energy(q, e) + contact_energy
    out["energy.gravitational"] = forces.gravitational_energy(system, e)
    out["energy.dissipated"] = float(y[2 * n])
    out["energy.work"] = float(y[2 * n + 1])
    for i, stop in enumerate(system.mechanism.stops):
        out[f"{stop.name}.contact"] = equations.contacts.modes[i].closed
        names = LATCHED + (COMPLIANT if stop.compliant else ())
        out |= {f"{stop.name}.{name}": getattr(latched[i], name) for name in names}
        if stop.compliant:
            out[f"{stop.name}.impulse_sum"] = float(extras[own.index(i, CompliantState.IMPULSE)])
            out[f"{stop.name}.contact_loss"] = float(extras[own.index(i, CompliantState.LOSS)])
    out |= _links(system, q, v)
    out |= _stress(equations, peaks, t, q, v, evaluation)
    out |= others
    return out


def motions(system: System, q: Real, v: Real, e: Complex) -> dict[str, float]:
    """Return displacements from the straight shape and velocities of bodies and probes."""
    out = {}
    for name, frame in system.bodies.items():
        place, velocity = system.motion(frame, e, v)
        out[f"{name}.x"], out[f"{name}.y"] = place.real, place.imag
        out[f"{name}.angle"] = float(q[frame.j])
        out[f"{name}.vx"], out[f"{name}.vy"] = velocity.real, velocity.imag
        out[f"{name}.omega"] = float(v[frame.j])
    for frame in system.probes:
        place, velocity = system.motion(frame, e, v)
        out[f"{frame.name}.x"], out[f"{frame.name}.y"] = place.real, place.imag
        out[f"{frame.name}.vx"], out[f"{frame.name}.vy"] = velocity.real, velocity.imag
    return out


def _stops(
    equations: Equations, t: float, y: Real, e: Complex, evaluation: Evaluation
) -> dict[str, float]:
    """Return gaps, forces and the motions and mobilities of the hit points."""
    system = equations.system
    out = {}
    n, M = equations.n, evaluation.M
    v, extras = y[n : 2 * n], y[2 * n + 2 :]
    gaps, rates = equations.gaps(t, e, extras), equations.gap_rates(t, e, v, extras)
    places, speeds = system.gap_rows.values(e), system.gap_rows.rates(e, v)
    G, loops = system.gap_rows.jacobian(e), equations.rows.jacobian(e)[: len(system.loops)]
    pressed = equations.stop_forces(evaluation.lam, evaluation.pressure)
    scale = equations.scale[: n + len(loops)]
    mobilities = np.diag(G @ contact.response(M, loops, G, system.length, scale))
    for i, stop in enumerate(system.mechanism.stops):
        out[f"{stop.name}.gap"] = float(gaps[i])
        out[f"{stop.name}.gap_rate"] = float(rates[i])
        out[f"{stop.name}.force"] = float(pressed[i])
        drawn = value(stop, "position", system.values)
        out[f"{stop.name}.point.displacement"] = -float(places[i]) - drawn
        out[f"{stop.name}.point.velocity"] = -float(speeds[i])
        out[f"{stop.name}.point.mobility"] = float(mobilities[i])
    return out


def _springs(equations: Equations, e: Complex, v: Real) -> dict[str, float]:
    """Return the forces, lengths and rates of the springs."""
    springs = equations.elements.springs
    out: dict[str, float] = {}
    if springs is None:
        return out
    now, rates = springs.state(e), springs.length_rates(e, v)
    force = springs.forces(now, rates)
    for i, spring in enumerate(equations.system.mechanism.springs):
        out[f"{spring.name}.force"] = float(force[i])
        out[f"{spring.name}.length"] = float(now.length[i])
        out[f"{spring.name}.length_rate"] = float(rates[i])
    return out


def _guides(system: System, lam: Real) -> dict[str, float]:
    """Return the forces and moments of the guides."""
    out: dict[str, float] = {}
    for guide, rows in zip(system.mechanism.guides, system.guided, strict=True):
        out[f"{guide.name}.force"] = float(lam[rows.across])
        if rows.turn is not None:
            out[f"{guide.name}.moment"] = float(lam[rows.turn]) * system.length
    return out


def _links(system: System, q: Real, v: Real) -> dict[str, float]:
    """Return the angles and strains of the flexures, and their rates."""
    out = {}
    for group, names in ((system.links, ANGLE), (system.strains, STRAIN)):
        for j in group:
            for name, x in zip(names, (q, v), strict=True):
                out[f"{system.owners[j]}.{name}"] = float(x[j])
    return out


def _stress(
    equations: Equations, peaks: PeakRecord, t: float, q: Real, v: Real, evaluation: Evaluation
) -> dict[str, float]:
    """Return the stress of flexures and its peaks."""
    out, found = {}, stresses(equations, q, v, evaluation)
    now = peaks.between(tuple(Sample.of(t, one) for one in found.values()))
    for (name, one), peak in zip(found.items(), now.peaks, strict=True):
        out[f"{name}.stress_start"], out[f"{name}.stress_end"] = one.start, one.end
        out[f"{name}.stress"] = one.largest
        out[f"{name}.peak_stress"] = peak.stress
        out[f"{name}.peak_stress_time"] = peak.time
        out[f"{name}.peak_stress_position"] = peak.position
    return out
