"""Errors that the package raises: in descriptions, values, equilibria and simulations.

Every message names the variable, its value, its unit and a remedy.  It can be shown to the user
without changes.
"""


class PrbmError(Exception):
    """Base class of all errors that this package raises."""


class MechanismError(PrbmError, ValueError):
    """The description of a mechanism is incomplete or inconsistent."""


class ParameterError(PrbmError, ValueError):
    """A parameter or an input is unknown, or its value is outside its bounds."""


class EquilibriumError(PrbmError, ValueError):
    """No static shape satisfies the conditions."""


class SimulationError(PrbmError, RuntimeError):
    """The simulation cannot be continued."""
