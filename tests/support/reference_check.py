"""The check of reference results that README.txt in the FMUs describes."""

import csv
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

from compliant_pivot import two_compliant_stops
from prbm.files.settings import units_of
from prbm.fmu import reference_results as reference
from prbm.fmu.parameter_sets import read_parameter_set
from prbm.fmu.related import FOLDER
from support import mechanism

EQUAL_RTOL = 1e-5  # Of the largest magnitude in a column, as README.txt states.
EXCHANGE_RTOL = 1e-3
RATIO_FACTOR = 10.0  # Of these, for modal_restitution.
DAMPED = {"damping.zeta": 0.05}  # Without damping the motion between two stops is chaotic.
EXPERIMENT_NAMES = ("default", "smoke", "validation")
EXPERIMENTS = pytest.mark.parametrize("experiment", EXPERIMENT_NAMES)


def member(fmu: Path, name: str) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read(f"{FOLDER}/{name}")


def exchange_tolerance(fmu: Path) -> float:
    """Return the relative tolerance that README.txt prescribes in model exchange."""
    text = member(fmu, "README.txt").decode()
    return float(text.partition("relative tolerance of ")[2].partition(",")[0])


def rows_of(content: bytes) -> np.ndarray:
    """Return a table as an array of records."""
    lines = list(csv.reader(io.StringIO(content.decode())))
    return np.array([tuple(map(float, x)) for x in lines[1:]], [(n, float) for n in lines[0]])


def start_values(fmu: Path, model: str, experiment: str, folder: Path) -> dict[str, float]:
    if experiment != "validation":
        return {}
    path = folder / "x.ssv"
    path.write_bytes(member(fmu, f"{model}_validation.ssv"))
    own = two_compliant_stops() if model == "TwoCompliant" else mechanism(model)
    return read_parameter_set(path, units_of(own))


def sizes(rows: np.ndarray, name: str) -> list[float]:
    """Return the largest magnitude in a column, and in that of the other component of a vector."""
    other = name[:-1] + {"x": "y", "y": "x"}.get(name[-1], name[-1])
    pair = {name, other} & set(rows.dtype.names)
    return [0.0, *(float(np.abs(rows[column]).max()) for column in pair)]


def compared(
    fmu: Path,
    expected: np.ndarray,
    found: np.ndarray,
    rtol: float = EQUAL_RTOL,
    *,
    complete: bool = True,
) -> int:
    """Compare rows as README.txt describes; return the number of compared rows.

    ``complete``: the tool has a row at each communication point.  After an event shortly before
    one, fmusim continues with the next one.
    """
    listed = {v.name: v for v in read_model_description(str(fmu)).modelVariables}
    time = expected["time"]
    impacts = time[1:][np.diff(time) == 0.0]
    near_impact, same = reference.NEAR_IMPACT * time[1], reference.SAME_TIME * time[1]
    pairs = []
    for k, t in enumerate(time):
        near = np.flatnonzero(np.abs(found["time"] - t) < same)
        if t in impacts:
            if len(near) > 1:
                pairs.append((k, near[0] if k + 1 < len(time) and time[k + 1] == t else near[-1]))
        elif not len(impacts) or np.abs(impacts - t).min() > near_impact:
            assert len(near) or not complete, t
            pairs += [(k, j) for j in near[-1:]]
    at, other = np.array(pairs).T
    for name in expected.dtype.names[1:]:
        scale = max(*sizes(expected, name), float(listed[name].nominal or 0.0))
        difference = np.abs(expected[name][at] - found[name][other]).max()
        allowed = rtol * (RATIO_FACTOR if name.endswith(".modal_restitution") else 1.0)
        assert difference <= allowed * scale, (name, difference, scale)
        if name.endswith(("_count", ".contact")):
            assert difference == 0.0
    return len(pairs)


def file_of(model: str, experiment: str) -> str:
    return f"{model}_out.csv" if experiment == "default" else f"{model}_{experiment}_out.csv"
