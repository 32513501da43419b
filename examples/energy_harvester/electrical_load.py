"""A coil near moving magnets with a load resistor, as an FMU made by pythonfmu.

    L di/dt = k v - (R + R_load) i,        force = -k i,        harvested' = R_load i^2

L, R and k are inductance, resistance and constant of the coil, and i is the current.  The velocity
v is constant within a step.  The current is then an exponential, and the integrals over the step
are exact.  The output force is the mean over the step.
"""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

VARIABLES = (
    ("resistance", "parameter", "Resistance of the coil [Ohm]"),
    ("load", "parameter", "Resistance of the load [Ohm]"),
    ("inductance", "parameter", "Inductance of the coil [H]"),
    ("constant", "parameter", "Voltage per velocity, equal to force per current [V s/m, N/A]"),
    ("velocity", "input", "Velocity of the magnets [m/s]"),
    ("current", "output", "Current at the end of the step [A]"),
    ("force", "output", "Force on the magnets, mean over the step [N]"),
    ("harvested", "output", "Energy delivered to the load [J]"),
    ("heat", "output", "Energy dissipated in the coil [J]"),
)


class ElectricalLoad(Fmi2Slave):
    """Current, force and energies of the coil and its load."""

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
        """Continue the current i = final + difference exp(-t / T)."""
        total = self.resistance + self.load
        h, T = step_size, self.inductance / total
        final = self.constant * self.velocity / total
        difference = self.current - final
        decay = math.exp(-h / T)
        integral = difference * T * (1.0 - decay)
        square = final**2 * h + 2.0 * final * integral
        square += difference**2 * T * (1.0 - decay**2) / 2.0
        self.harvested += self.load * square
        self.heat += self.resistance * square
        self.current = final + difference * decay
        self.force = -self.constant * (final + (integral / h if h > 0.0 else difference))
        return True
