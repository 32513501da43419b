"""The first impact after a release, and the energies of the modes before and after it."""

from ...base.errors import EquilibriumError
from ...hybrid.records import Impact
from ...mechanics.modal import modes_at
from ...mechanics.system import System
from ...mechanism.parts import value
from ...runs.engine import Engine
from .maps import Hit

PERIODS_MAX = 1.5  # Periods of the fundamental mode within which a wall must be reached.
STEPS_PER_PERIOD = 50


def first_impact(simulation: Engine, stop: int) -> Impact:
    """Advance a simulation to its first impact at a stop, and return this impact.

    Raises
    ------
    EquilibriumError
        If the wall is not reached in :data:`PERIODS_MAX` periods of the fundamental mode.
    """
    name = simulation.mechanism.stops[stop].name
    record: list[Impact] = []
    simulation.record = record
    period = 1.0 / simulation.frequency
    end = simulation.time + PERIODS_MAX * period
    while simulation.time < end:
        simulation.advance(min(end, simulation.time + period / STEPS_PER_PERIOD))
        for impact in record:
            if impact.stop == name:
                return impact
    release = simulation.mechanism.release
    amount = value(release, release.start, simulation.values)
    raise EquilibriumError(
        f"the wall of {name} is not reached in {PERIODS_MAX:g} periods from release.{release.start}"
        f" = {amount:g} {'rad' if release.turns else 'm'}: release further from the wall"
    )


def mode_energies(system: System, impact: Impact) -> Hit:
    """Return the energies of the modes before and after an impact, at its shape.

    Parameters
    ----------
    system : System
        The simulated mechanism.
    impact : Impact
        Impact from the record of a :func:`prbm.Simulation`.

    Returns
    -------
    Hit
        Energies in units of the arriving energy; position and offset of the wall from the
        parameters.
    """
    found = modes_at(system, impact.q)
    rates = [found.shape.T @ (found.M @ v) for v in (impact.before, impact.after)]
    before, after = (rate**2 / 2 for rate in rates)
    arriving = float(before.sum())
    values = system.values
    wall, offset = (
        value(next(s for s in system.mechanism.stops if s.name == impact.stop), name, values)
        for name in ("position", "offset")
    )
    return Hit(
        wall, offset, impact.latched.modal_restitution, found.frequency,
        before / arriving, after / arriving, impact.latched.energy_lost / arriving,
    )  # fmt: skip
