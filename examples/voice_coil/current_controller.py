"""A digital controller of a current, as an FMU: runs inside pythonfmu.

At each sample, which is the beginning of a communication step,

    voltage = gain (wanted - current) + integral,       limited to +- limit

where the integral stands still while the voltage is limited.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CurrentController(Fmi2Slave):
    """PI with a limit."""

    author = "the prbm-impact examples"
    description = "Holds the current of a coil"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.rate, self.limit = 4.0, 8e3, 12.0
        self.wanted, self.current, self.voltage, self.integral = 0.1, 0.0, 0.0, 0.0
        for name, causality, text in (
            ("gain", "parameter", "Voltage for a missing current [V/A]"),
            ("rate", "parameter", "Rate of the voltage for a missing current [V/(A s)]"),
            ("limit", "parameter", "Largest voltage [V]"),
            ("wanted", "parameter", "Current that is wanted [A]"),
            ("current", "input", "Current that is measured [A]"),
            ("voltage", "output", "For the step that begins [V]"),
        ):
            kind = Fmi2Variability.fixed if causality == "parameter" else Fmi2Variability.continuous
            self.register_variable(
                Real(name, causality=Fmi2Causality[causality], variability=kind, description=text)
            )

    def do_step(self, current_time, step_size):
        """Take a sample, choose the voltage."""
        missing = self.wanted - self.current
        integral = self.integral + self.rate * missing * step_size
        voltage = self.gain * missing + integral
        if abs(voltage) <= self.limit:
            self.integral = integral
        self.voltage = min(max(voltage, -self.limit), self.limit)
        return True
