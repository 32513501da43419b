"""Reference results inside a native FMU, as the layered standard FMI-LS-REF describes them.

They come from the Python engine, so that they are an independent route to what the C kernel
computes.
"""

import csv
import io
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from numpy.typing import NDArray

from prbm import Mechanism, PrbmError
from prbm_tools.simulate import names, simulate

from .description import STEP_SIZE, STOP_TIME, serialized
from .variables import Variable

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
ATTRIBUTES = {
    "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "fmi-ls-version": "1.0.0-alpha.1",
    "fmi-ls-description": "Layered Standard providing information on related files included in "
    "an FMU.",
}
DIGITS = 9  # significant; the engine's own error is larger
EXPERIMENT = (
    f"Outputs of the default experiment (0 to {STOP_TIME:g} s, communication step "
    f"{1e3 * STEP_SIZE:g} ms), computed by the Python engine"
)


def reference(
    mechanism: Mechanism, changes: Mapping[str, float], variables: Iterable[Variable]
) -> dict[str, bytes]:
    """Return the files by their paths in the FMU; none if the experiment cannot be finished."""
    columns = _columns(_Hashed(mechanism), tuple(changes.items()))
    if columns is None:
        return {}
    outputs = [v.name for v in variables if v.causality == "output" and v.name in names(columns)]
    file = f"{mechanism.name}_out.csv"
    return {
        f"{FOLDER}/fmi-ls-manifest.xml": _manifest(file),
        f"{FOLDER}/{file}": _table(columns, outputs),
    }


class _Hashed:
    """A mechanism that is looked up by its identity: it holds mappings, which have no hash."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.mechanism is other.mechanism

    def __hash__(self) -> int:
        return id(self.mechanism)


@lru_cache(maxsize=2)
def _columns(hashed: _Hashed, changes: tuple[tuple[str, float], ...]) -> NDArray[Any] | None:
    """Return the result of the default experiment; the FMUs of one export share it."""
    try:
        return simulate(hashed.mechanism, dict(changes), STOP_TIME, STEP_SIZE).columns
    except PrbmError:
        return None


def _table(columns: NDArray[Any], outputs: Iterable[str]) -> bytes:
    chosen = ["time", *outputs]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(chosen)
    for row in columns[chosen]:
        writer.writerow(f"{float(x):.{DIGITS}g}" for x in row)
    return text.getvalue().encode()


def _manifest(file: str) -> bytes:
    ElementTree.register_namespace("fmi-ls", NAMESPACE)
    attributes = {f"{{{NAMESPACE}}}{name}": value for name, value in ATTRIBUTES.items()}
    root = Element("fmiReferences", attributes)
    related = {"type": "text/csv", "source": file, "role": "result", "description": EXPERIMENT}
    SubElement(root, "Related", related)
    return serialized(root)
