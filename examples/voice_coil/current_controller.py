"""A digital current controller, as an FMU made by pythonfmu.

At each sample, at the start of a communication step,

    voltage = gain (wanted - current) + integral,       limited to +- limit.

The integral is constant while the voltage is limited.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CurrentController(Fmi2Slave):
    """PI controller with a limit."""

    author = "the prbm-impact examples"
    description = "Controls the current of a coil"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.rate, self.limit = 4.0, 8e3, 12.0
        self.wanted, self.current, self.voltage, self.integral = 0.1, 0.0, 0.0, 0.0
        for name, causality, text in (
            ("gain", "parameter", "Voltage per current error [V/A]"),
            ("rate", "parameter", "Rate of the voltage per current error [V/(A s)]"),
            ("limit", "parameter", "Largest voltage [V]"),
            ("wanted", "parameter", "Set point of the current [A]"),
            ("current", "input", "Measured current [A]"),
            ("voltage", "output", "Voltage during the next step [V]"),
        ):
            kind = Fmi2Variability.fixed if causality == "parameter" else Fmi2Variability.continuous
            self.register_variable(
                Real(name, causality=Fmi2Causality[causality], variability=kind, description=text)
            )

    def do_step(self, current_time, step_size):
        """Sample the current and set the voltage."""
        error = self.wanted - self.current
        integral = self.integral + self.rate * error * step_size
        voltage = self.gain * error + integral
        if abs(voltage) <= self.limit:
            self.integral = integral
        self.voltage = min(max(voltage, -self.limit), self.limit)
        return True
