"""A controller that keeps a shuttle bouncing, as an FMU: runs inside pythonfmu.

It pushes the shuttle the way it goes, which puts in work wherever it is, with a force that one
bounce sets for the next: at the far end of each bounce the stroke is known, and

    force = integral + gain * (stroke wanted - stroke),     0 <= force <= limit

where ``integral`` gathers half of the second term every time.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

STILL, NEAR = 1e-6, 1e-4  # m/s, m; slower and nearer, it lies at the stop: lift it off
GATHERED = 0.5  # of gain * error, from bounce to bounce


class StrokeController(Fmi2Slave):
    """Bang-bang along the velocity, PI from bounce to bounce."""

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
            ("stroke", "Distance from the stop to the far end of a bounce that is wanted [m]"),
            ("gain", "Force for a missing stroke [N/m]"),
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
            ("position", "Of the shuttle, 0 at the stop, negative away from it [m]"),
            ("velocity", "Of the shuttle, positive towards the stop [m/s]"),
        ):
            self.register_variable(Real(name, description=text, causality=Fmi2Causality.input))
        for name, text in (
            ("force", "On the shuttle, positive towards the stop [N]"),
            ("reached", "Stroke of the last bounce [m]"),
        ):
            self.register_variable(Real(name, description=text, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        """Choose the force for the next step from what was measured at its start."""
        if self.outwards and self.velocity >= 0.0:
            self.reached = -self.position
            self._adapt(self.stroke - self.reached)
        self.outwards = self.velocity < 0.0
        if abs(self.velocity) < STILL and abs(self.position) < NEAR:
            self.force = -self.limit
        else:
            self.force = self.size if self.velocity > 0.0 else -self.size
        return True

    def _adapt(self, missing):
        change = self.gain * missing
        self.size = min(max(self.integral + change, 0.0), self.limit)
        self.integral = min(max(self.integral + GATHERED * change, 0.0), self.limit)
