"""Impact models of compliant mechanisms, as Python objects and Functional Mock-up Units.

>>> import prbm
>>> guide = prbm.load("PRBDM2R")
>>> result = prbm.simulate(guide, {"stop.restitution": 0.5}, stop_time=0.05)
>>> int(result["stop.impact_count"][-1])
1

The public names are imported on first use (PEP 562), so that ``import prbm`` is fast.
``docs/architecture.md`` describes the subpackages.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .analysis.linear_model import linearize as linearize
    from .analysis.static_shape import equilibrium as equilibrium
    from .analysis.static_shape import holding_curve as holding_curve
    from .analysis.static_shape import modes as modes
    from .base.errors import EquilibriumError as EquilibriumError
    from .base.errors import MechanismError as MechanismError
    from .base.errors import ParameterError as ParameterError
    from .base.errors import PrbmError as PrbmError
    from .base.errors import SimulationError as SimulationError
    from .base.version import __version__ as __version__
    from .cad.importing import read_drawing as read_drawing
    from .files.mechanism_file import load as load
    from .mechanism.description import Mechanism
    from .mechanism.flexure import register_model as register_model
    from .plots.shown import Result, simulate
    from .runs.engine import simulation as Simulation
    from .runs.result import ResultError as ResultError
    from .runs.result import UnknownColumnError as UnknownColumnError
    from .sweeps.study import study as study

__all__ = [
    "EquilibriumError",
    "Mechanism",
    "MechanismError",
    "ParameterError",
    "PrbmError",
    "Result",
    "ResultError",
    "Simulation",
    "SimulationError",
    "UnknownColumnError",
    "__version__",
    "equilibrium",
    "holding_curve",
    "linearize",
    "load",
    "modes",
    "read_drawing",
    "register_model",
    "simulate",
    "study",
]

_MODULES = {
    "EquilibriumError": ("base.errors", "EquilibriumError"),
    "Mechanism": ("mechanism.description", "Mechanism"),
    "MechanismError": ("base.errors", "MechanismError"),
    "ParameterError": ("base.errors", "ParameterError"),
    "PrbmError": ("base.errors", "PrbmError"),
    "Result": ("plots.shown", "Result"),
    "ResultError": ("runs.result", "ResultError"),
    "Simulation": ("runs.engine", "simulation"),
    "SimulationError": ("base.errors", "SimulationError"),
    "UnknownColumnError": ("runs.result", "UnknownColumnError"),
    "__version__": ("base.version", "__version__"),
    "equilibrium": ("analysis.static_shape", "equilibrium"),
    "holding_curve": ("analysis.static_shape", "holding_curve"),
    "linearize": ("analysis.linear_model", "linearize"),
    "load": ("files.mechanism_file", "load"),
    "modes": ("analysis.static_shape", "modes"),
    "read_drawing": ("cad.importing", "read_drawing"),
    "register_model": ("mechanism.flexure", "register_model"),
    "simulate": ("plots.shown", "simulate"),
    "study": ("sweeps.study", "study"),
}


def __getattr__(name: str) -> Any:
    """Import a public name from its module."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _MODULES[name]
    value = getattr(import_module(f".{module}", __name__), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted({*(name for name in globals() if name.startswith("__")), *__all__})
