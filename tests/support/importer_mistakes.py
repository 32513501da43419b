"""Errors of an importer: invalid values and steps, each with a part of the expected message."""

NAN, INF = float("nan"), float("inf")
AT_START = {
    "a negative length": ("flexure.length", -0.04, "flexure.length = -0.04 m must be at least"),
    "no thickness": ("flexure.thickness", 0.0, "flexure.thickness = 0 m must be at least"),
    "no mass": ("shuttle.mass", 0.0, "shuttle.mass = 0 kg must be at least"),
    "a negative mass": ("shuttle.mass", -1.0, "shuttle.mass = -1 kg must be at least"),
    "restitution above 1": ("stop.restitution", 1.5, "stop.restitution = 1.5 must be at most 1"),
    "NaN": ("release.displacement", NAN, "release.displacement = nan m must be a finite number"),
    "infinity": ("gravity.x", INF, "gravity.x = inf m/s2 must be a finite number"),
    "a NaN input": ("force.x", NAN, "force.x = nan"),
    "a wall penetrated": ("stop.position", -0.03, "penetrated"),
    "a shape out of reach": ("release.displacement", -0.2, "cannot be reached"),
    "an output": ("shuttle.x", 0.1, "shuttle.x is not a parameter or input"),
}
LATER = {
    "a fixed parameter": ("shuttle.mass", 0.1, "shuttle.mass = 0.1 kg rejected: the parameter is"),
    "a tunable parameter": ("stop.restitution", -0.1, "stop.restitution = -0.1 must be at least 0"),
    "a NaN input": ("force.x", NAN, "force.x = nan"),
    "an infinite input": ("base.acceleration.x", INF, "base.acceleration.x = inf"),
}
STEPS = {
    "a step of zero": (1e-3, 0.0, "communicationStepSize = 0 s must be positive"),
    "a step backwards": (1e-3, -1e-3, "communicationStepSize = -0.001 s must be positive"),
    "time running backwards": (0.0, 1e-3, "the last step ended at t = 0.001 s"),
    "a jump forwards": (0.5, 1e-3, "the last step ended at t = 0.001 s"),
    "NaN for a time": (NAN, 1e-3, "must be finite numbers"),
    "infinity for a step": (1e-3, INF, "must be finite numbers"),
}
