"""Errors of the package: of a description, of values, of an equilibrium, of a simulation.

Every message names the variable, its value, its unit and a remedy; it is meant to be shown to
the user as it is.
"""


class PrbmError(Exception):
    """Base of all errors that this package raises on purpose."""


class MechanismError(PrbmError, ValueError):
    """The description of a mechanism contradicts itself or is incomplete."""


class ParameterError(PrbmError, ValueError):
    """A parameter or an input is unknown, or its value is out of bounds."""


class EquilibriumError(PrbmError, ValueError):
    """No static shape satisfies the conditions."""


class SimulationError(PrbmError, RuntimeError):
    """The simulation cannot be continued."""
