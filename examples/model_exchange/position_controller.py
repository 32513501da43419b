"""A position controller with a slow actuator, as an FMU made by pythonfmu.

    force' = (command - force) / lag,       command = gain (wanted - position) - damping velocity

Position and velocity are constant within a step; the force is then an exponential.
"""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

VARIABLES = (
    ("gain", "parameter", "Force per position error [N/m]"),
    ("damping", "parameter", "Force against the velocity, per velocity [N s/m]"),
    ("wanted", "parameter", "Set point of the position [m]"),
    ("lag", "parameter", "Time constant of the actuator [s]"),
    ("position", "input", "Measured position [m]"),
    ("velocity", "input", "Measured velocity [m/s]"),
    ("force", "output", "Force at the end of the step [N]"),
)


class PositionController(Fmi2Slave):
    """PD controller with a first-order actuator."""

    author = "the prbm-impact examples"
    description = "Position controller with a slow actuator"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.damping, self.wanted, self.lag = 20.0, 0.5, 1e-3, 5e-3
        self.position = self.velocity = self.force = 0.0
        for name, causality, text in VARIABLES:
            kind = Fmi2Variability.fixed if causality == "parameter" else Fmi2Variability.continuous
            self.register_variable(
                Real(name, causality=Fmi2Causality[causality], variability=kind, description=text)
            )

    def do_step(self, current_time, step_size):
        """Continue the force towards the command."""
        command = self.gain * (self.wanted - self.position) - self.damping * self.velocity
        self.force = command + (self.force - command) * math.exp(-step_size / self.lag)
        return True
