"""A moving coil in the field of a magnet, as an FMU made by pythonfmu.

    L di/dt = u - R i - k v,        force = k i

The voltage u and the velocity v are constant within a step.  The current is then an exponential,
and the integrals over the step are exact.  The output force is the mean over the step.
"""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

VARIABLES = (
    ("resistance", "parameter", "Resistance of the winding [Ohm]"),
    ("inductance", "parameter", "Inductance of the winding [H]"),
    ("constant", "parameter", "Force per current, equal to voltage per velocity [N/A, V s/m]"),
    ("voltage", "input", "Voltage at the terminals [V]"),
    ("velocity", "input", "Velocity of the coil in the field [m/s]"),
    ("current", "output", "Current in the winding at the end of the step [A]"),
    ("force", "output", "Force on the moving coil, mean over the step [N]"),
    ("supplied", "output", "Energy supplied at the terminals [J]"),
    ("heat", "output", "Energy dissipated in the resistance [J]"),
    ("magnetic", "output", "Energy in the inductance [J]"),
)


class Coil(Fmi2Slave):
    """Current, force and energies of a voice coil."""

    author = "the prbm-impact examples"
    description = "Voice coil: resistance, inductance, force constant"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.resistance, self.inductance, self.constant = 4.0, 2e-3, 2.0
        self.voltage = self.velocity = self.current = self.force = 0.0
        self.supplied = self.heat = self.magnetic = 0.0
        for name, causality, text in VARIABLES:
            kind = Fmi2Variability.fixed if causality == "parameter" else Fmi2Variability.continuous
            self.register_variable(
                Real(name, causality=Fmi2Causality[causality], variability=kind, description=text)
            )

    def do_step(self, current_time, step_size):
        """Continue the current i = final + difference exp(-t / T)."""
        h, T = step_size, self.inductance / self.resistance
        final = (self.voltage - self.constant * self.velocity) / self.resistance
        difference = self.current - final
        decay = math.exp(-h / T)
        # Integrals of the decaying difference and of its square over the step.
        integral = difference * T * (1.0 - decay)
        square = difference**2 * T * (1.0 - decay**2) / 2.0
        self.supplied += self.voltage * (final * h + integral)
        self.heat += self.resistance * (final**2 * h + 2.0 * final * integral + square)
        self.current = final + difference * decay
        self.magnetic = 0.5 * self.inductance * self.current**2
        self.force = self.constant * (final + integral / h)
        return True
