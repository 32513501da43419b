"""Pseudo-rigid-body impact models of planar compliant mechanisms.

A mechanism is data (:mod:`prbm.mechanism`); :class:`Simulation` moves it; statics and modes are
functions of its arrays (:mod:`prbm.assembly`).  NumPy and SciPy only, no files, no FMI.
"""

from .assembly import System, assemble
from .errors import (
    EquilibriumError,
    MechanismError,
    ParameterError,
    PrbmError,
    SimulationError,
)
from .fixed_step import march
from .hybrid import Impact, Simulation
from .mechanism import (
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    Joint,
    Mechanism,
    Parameter,
    Probe,
    Release,
    Stop,
)
from .modal import modal_restitution, modes
from .statics import equilibrium, free_displacement

__all__ = [
    "Body",
    "EquilibriumError",
    "Flexure",
    "FlexureType",
    "Force",
    "Friction",
    "Impact",
    "Joint",
    "Mechanism",
    "MechanismError",
    "Parameter",
    "ParameterError",
    "PrbmError",
    "Probe",
    "Release",
    "Simulation",
    "SimulationError",
    "Stop",
    "System",
    "assemble",
    "equilibrium",
    "free_displacement",
    "march",
    "modal_restitution",
    "modes",
]
