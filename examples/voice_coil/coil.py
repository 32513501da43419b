"""A moving coil in the field of a magnet, as an FMU: runs inside pythonfmu.

    L di/dt = u - R i - k v,        force = k i

The voltage u and the velocity v are held within a step.  Then the current is an exponential, and
all integrals over the step are exact; the force is its mean over the step.
"""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

VARIABLES = (
    ("resistance", "parameter", "Resistance of the winding [Ohm]"),
    ("inductance", "parameter", "Inductance of the winding [H]"),
    ("constant", "parameter", "Force for a current, voltage for a velocity [N/A, V s/m]"),
    ("voltage", "input", "At the terminals [V]"),
    ("velocity", "input", "Of the coil in the field [m/s]"),
    ("current", "output", "In the winding, at the end of the step [A]"),
    ("force", "output", "On the moving coil, mean over the step [N]"),
    ("supplied", "output", "Energy that came in at the terminals [J]"),
    ("heat", "output", "Energy that the resistance took [J]"),
    ("magnetic", "output", "Energy in the inductance [J]"),
)


class Coil(Fmi2Slave):
    """Current, force, and where the energy goes that is supplied."""

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
        """Continue the current, final + away exp(-t / T)."""
        h, T = step_size, self.inductance / self.resistance
        final = (self.voltage - self.constant * self.velocity) / self.resistance
        away = self.current - final
        decay = math.exp(-h / T)
        first = away * T * (1.0 - decay)  # integral of what is left of the difference
        second = away**2 * T * (1.0 - decay**2) / 2.0  # and of its square
        self.supplied += self.voltage * (final * h + first)
        self.heat += self.resistance * (final**2 * h + 2.0 * final * first + second)
        self.current = final + away * decay
        self.magnetic = 0.5 * self.inductance * self.current**2
        self.force = self.constant * (final + first / h)
        return True
