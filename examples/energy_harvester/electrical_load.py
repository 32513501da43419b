"""A coil near moving magnets, and the resistor that it feeds, as an FMU: runs inside pythonfmu.

    L di/dt = k v - (R + R_load) i,        force = -k i,        harvested' = R_load i^2

The velocity v is held within a step; then the current is an exponential, and the integrals over
the step are exact.  The force is its mean over the step.
"""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

VARIABLES = (
    ("resistance", "parameter", "Resistance of the coil [Ohm]"),
    ("load", "parameter", "Resistance of what uses the power [Ohm]"),
    ("inductance", "parameter", "Inductance of the coil [H]"),
    ("constant", "parameter", "Voltage for a velocity, force for a current [V s/m, N/A]"),
    ("velocity", "input", "Of the magnets [m/s]"),
    ("current", "output", "At the end of the step [A]"),
    ("force", "output", "On the magnets, mean over the step [N]"),
    ("harvested", "output", "Energy that the load got [J]"),
    ("heat", "output", "Energy that the coil itself took [J]"),
)


class ElectricalLoad(Fmi2Slave):
    """Current, force, and where the energy goes."""

    author = "the prbm-impact examples"
    description = "Coil of an energy harvester with a resistive load"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.resistance, self.load, self.inductance, self.constant = 50.0, 100.0, 0.02, 5.0
        self.velocity = self.current = self.force = self.harvested = self.heat = 0.0
        for name, causality, text in VARIABLES:
            kind = Fmi2Variability.fixed if causality == "parameter" else Fmi2Variability.continuous
            self.register_variable(
                Real(name, causality=Fmi2Causality[causality], variability=kind, description=text)
            )

    def do_step(self, current_time, step_size):
        """Continue the current, final + away exp(-t / T)."""
        total = self.resistance + self.load
        h, T = step_size, self.inductance / total
        final = self.constant * self.velocity / total
        away = self.current - final
        decay = math.exp(-h / T)
        first = away * T * (1.0 - decay)
        square = final**2 * h + 2.0 * final * first + away**2 * T * (1.0 - decay**2) / 2.0
        self.harvested += self.load * square
        self.heat += self.resistance * square
        self.current = final + away * decay
        self.force = -self.constant * (final + (first / h if h > 0.0 else away))
        return True
