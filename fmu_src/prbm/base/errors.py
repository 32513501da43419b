"""What can go wrong, by whose hand: the description, the values or the motion.

Every message names the variable, its value, its unit and a remedy; it is meant to be shown to
the user as it is.
"""


class PrbmError(Exception):
    """Base of all errors that this package raises on purpose."""


class MechanismError(PrbmError, ValueError):
    """The description of a mechanism contradicts itself or is incomplete."""


class ParameterError(PrbmError, ValueError):
    """A parameter or an input has a value that makes no sense."""


class EquilibriumError(PrbmError, ValueError):
    """No static shape satisfies what was asked for."""


class SimulationError(PrbmError, RuntimeError):
    """The motion cannot be continued with what was asked for."""
