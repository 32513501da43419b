"""A controller that keeps a shuttle bouncing, as an FMU made by pythonfmu.

The force acts in the direction of the velocity, so that its work is positive.  Its size changes
once per bounce, at the far end, where the stroke is known:

    force = integral + gain * (set point - stroke),     0 <= force <= limit

At each change, half of gain * (set point - stroke) is added to ``integral``.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

REST_SPEED_MAX, REST_DISTANCE_MAX = 1e-6, 1e-4  # Below both, the shuttle rests on the stop.
INTEGRAL_SHARE = 0.5  # Share of gain * error that is added to the integral per bounce.


class StrokeController(Fmi2Slave):
    """Bang-bang control along the velocity, PI control from bounce to bounce."""

    author = "the prbm-impact examples"
    description = "Keeps a shuttle bouncing against a stop with a given stroke"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.stroke = 0.008
        self.gain = 25.0
        self.limit = 1.0
        self.position = 0.0
        self.velocity = 0.0
        self.force = 0.0
        self.reached = 0.0
        self.size = 0.0
        self.integral = 0.0
        self.outwards = False
        for name, text in (
            ("stroke", "Set point of the distance from the stop to the far end of a bounce [m]"),
            ("gain", "Force per error of the stroke [N/m]"),
            ("limit", "Largest force [N]"),
        ):
            self.register_variable(
                Real(
                    name,
                    description=text,
                    causality=Fmi2Causality.parameter,
                    variability=Fmi2Variability.tunable,
                )
            )
        for name, text in (
            ("position", "Position of the shuttle, 0 at the stop, negative away from it [m]"),
            ("velocity", "Velocity of the shuttle, positive towards the stop [m/s]"),
        ):
            self.register_variable(Real(name, description=text, causality=Fmi2Causality.input))
        for name, text in (
            ("force", "Force on the shuttle, positive towards the stop [N]"),
            ("reached", "Stroke of the last bounce [m]"),
        ):
            self.register_variable(Real(name, description=text, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        """Set the force for the next step from the measurements at its start."""
        if self.outwards and self.velocity >= 0.0:
            self.reached = -self.position
            self._adapt(self.stroke - self.reached)
        self.outwards = self.velocity < 0.0
        if abs(self.velocity) < REST_SPEED_MAX and abs(self.position) < REST_DISTANCE_MAX:
            self.force = -self.limit
        else:
            self.force = self.size if self.velocity > 0.0 else -self.size
        return True

    def _adapt(self, error):
        change = self.gain * error
        self.size = min(max(self.integral + change, 0.0), self.limit)
        self.integral = min(max(self.integral + INTEGRAL_SHARE * change, 0.0), self.limit)
