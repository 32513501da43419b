"""Reference results inside a native FMU, in the format of the layered standard FMI-LS-REF.

The Python engine computes them, so they are independent of the C kernel.
"""

import csv
import io
import math
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from numpy.typing import NDArray

from ..base.errors import PrbmError
from ..hybrid.simulation import Simulation
from ..interface.variables import Variable
from ..mechanics.modal import modes_at
from ..mechanism.description import Mechanism
from ..runs.experiment import Experiment
from ..runs.result import names
from ..runs.run import simulate
from .description import serialized

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
ATTRIBUTES = {
    "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "fmi-ls-version": "1.0.0-alpha.1",
    "fmi-ls-description": "Layered Standard providing information on related files included in "
    "an FMU.",
}
DIGITS = 9  # Significant digits; the error of the engine is larger.
STEPS_MAX = 1e5  # Steps of the Python engine, which take a minute or two.
STABLE_STEP_FACTOR = 3.0  # Stable step of the explicit method, times the rate of fastest motion.


def reference(
    mechanism: Mechanism,
    changes: Mapping[str, float],
    variables: Iterable[Variable],
    experiment: Experiment,
    progress: Callable[[str], None] = lambda step: None,
) -> dict[str, bytes]:
    """Return the reference results of the default experiment.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    changes : mapping
        Start values of parameters and inputs that replace those of the mechanism.
    variables : iterable of Variable
        The variables of the FMU; its outputs are recorded.
    experiment : Experiment
        The default experiment.
    progress : callable
        Called with the reason if there are no results.

    Returns
    -------
    dict of str to bytes
        Files by path in the FMU.  Empty if the simulation fails, or if the Python engine would
        need more than ``STEPS_MAX`` steps.
    """
    if steps(mechanism, changes, experiment) > STEPS_MAX:
        progress("no reference results: the default experiment takes the Python engine minutes")
        return {}
    columns = _columns(_Hashed(mechanism), tuple(changes.items()), experiment)
    if columns is None:
        progress("no reference results: the simulation of the default experiment fails")
        return {}
    outputs = [v.name for v in variables if v.causality == "output" and v.name in names(columns)]
    file = f"{mechanism.name}_out.csv"
    return {
        f"{FOLDER}/fmi-ls-manifest.xml": _manifest(file, experiment),
        f"{FOLDER}/{file}": _table(columns, outputs),
    }


def steps(mechanism: Mechanism, changes: Mapping[str, float], experiment: Experiment) -> float:
    """Return an estimate of the number of engine steps in an experiment, from the fastest mode.

    An explicit step is stable up to a few units of 1/omega and, with stiffness-proportional
    damping, of 1/(beta omega^2).  The estimate uses frequencies instead of a measured time, so
    that every build of an FMU gives the same bytes.
    """
    simulation = Simulation(mechanism, changes)
    system, n = simulation.system, simulation.system.n
    omega = 2 * math.pi * float(abs(modes_at(system, simulation.state()[:n]).frequency).max())
    fastest = max(omega, simulation.values["damping.beta"] * omega**2)
    return experiment.stop_time * fastest / STABLE_STEP_FACTOR


class _Hashed:
    """A cache key for a mechanism by identity, because its mappings cannot be hashed."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.mechanism is other.mechanism

    def __hash__(self) -> int:
        return id(self.mechanism)


@lru_cache(maxsize=2)
def _columns(
    hashed: _Hashed, changes: tuple[tuple[str, float], ...], experiment: Experiment
) -> NDArray[Any] | None:
    """Return the results of the default experiment, or None if it fails.

    They are cached, because the FMUs of one export share them.
    """
    try:
        result = simulate(
            hashed.mechanism, dict(changes), stop_time=experiment.stop_time, step=experiment.step
        )
    except PrbmError:
        return None
    return result.columns


def _table(columns: NDArray[Any], outputs: Iterable[str]) -> bytes:
    chosen = ["time", *outputs]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(chosen)
    for row in columns[chosen]:
        writer.writerow(f"{float(x):.{DIGITS}g}" for x in row)
    return text.getvalue().encode()


def _manifest(file: str, experiment: Experiment) -> bytes:
    description = (
        f"Outputs of the default experiment (0 to {experiment.stop_time:g} s, communication step "
        f"{1e3 * experiment.step:g} ms), computed by the Python engine"
    )
    ElementTree.register_namespace("fmi-ls", NAMESPACE)
    attributes = {f"{{{NAMESPACE}}}{name}": value for name, value in ATTRIBUTES.items()}
    root = Element("fmiReferences", attributes)
    related = {"type": "text/csv", "source": file, "role": "result"}
    SubElement(root, "Related", related | {"description": description})
    return serialized(root)
