"""Print a table of the Reference FMUs of the Modelica Association as partners of a guide.

    python tests/support/reference_fmus.py CLONE

CLONE is a clone of https://github.com/modelica/Reference-FMUs.  CMake and a C compiler build the
FMUs.  A partner with a motion of its own must move as alone in FMPy; the guide must move equally
in the master, in a package and in a container.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2] / "fmu_src")]

import numpy as np  # noqa: E402
from fmpy import simulate_fmu  # noqa: E402

from coupled import guide  # noqa: E402
from prbm.systems import cosimulation, ssp  # noqa: E402
from prbm.systems.components import CouplingError  # noqa: E402
from prbm.systems.container import container  # noqa: E402
from prbm.systems.cosimulation import JACOBI  # noqa: E402

STOP, STEP = 1.5, 0.01
PARTNERS = {
    "Feedthrough": ("Float64_continuous_output", "Float64_continuous_input"),
    "Stair": ("counter", None), "BouncingBall": ("h", None), "VanDerPol": ("x0", None),
    "Clocks": ("totalInClockTicks", None),
}  # fmt: skip
"""An output of each FMU, and an input."""
EQUAL = "equal"


def build(clone: Path, folder: Path) -> dict[tuple[str, int], Path]:
    """Return the paths of the FMUs by name and version of FMI; Clocks has FMI 3.0 only."""
    found = {}
    for fmi in (2, 3):
        names = [name for name in PARTNERS if (fmi, name) != (2, "Clocks")]
        out = folder / str(fmi)
        options = [f"-DFMI_VERSION={fmi}", "-DCMAKE_BUILD_TYPE=Release", "-DWITH_FMUSIM=OFF"]
        for command in (
            ["cmake", "-S", str(clone), "-B", str(out), *options],
            ["cmake", "--build", str(out), "--target", *names],
        ):
            subprocess.run(command, check=True, capture_output=True)
        found |= {(name, fmi): out / "fmus" / f"{name}.fmu" for name in names}
    return found


def results(name: str, fmi: int, fmu: Path, folder: Path) -> tuple[str, str, str]:
    """Return the results of the master, the package and the container."""
    output, entry = PARTNERS[name]
    fmus, shown = {"guide": guide(fmi), "partner": fmu}, ["guide.shuttle.x", f"partner.{output}"]
    wires = {"guide.force.x": f"partner.{output}"}
    if name == "BouncingBall":
        wires = {}  # no input of the guide has the unit of one of its outputs
    if entry is not None:
        wires = {f"partner.{entry}": "guide.shuttle.x"}
    values = {"guide.release.displacement": -5e-3}
    runs = {}

    def master():
        return cosimulation.simulate(fmus, wires, STOP, STEP, values, shown, JACOBI)

    def package():
        path = folder / "x.ssp"
        ssp.package(path, fmus, wires, values, STOP)
        return ssp.simulate(path, STOP, STEP)

    def contained():
        path = folder / "x.fmu"
        container(path, fmus, wires, STEP, values, shown, fmi, STOP)
        return simulate_fmu(path, stop_time=STOP, output_interval=STEP)

    texts = []
    for run in (master, package, contained):
        try:
            runs[run] = run()
        except CouplingError as error:
            texts.append(str(error))
            continue
        found, first = runs[run], runs[master]
        x = "guide.shuttle.x"
        same = np.allclose(found[x], first[x], rtol=1e-9, atol=1e-12)
        texts.append(EQUAL if same and moves(found, fmu, output, entry) else "WRONG")
    return tuple(texts)


def moves(found: np.ndarray, fmu: Path, output: str, entry: str | None) -> bool:
    """Return whether a partner moves as alone.

    Feedthrough gives what it took before the step, or after it: a container passes outputs on
    before its own outputs are read.
    """
    own, x = found[f"partner.{output}"], found["guide.shuttle.x"]
    if entry is not None:
        return bool(np.ptp(x)) and (np.array_equal(own[1:], x[:-1]) or np.array_equal(own, x))
    alone = simulate_fmu(fmu, stop_time=STOP, output_interval=STEP, output=[output])
    return np.allclose(own, alone[output][: len(own)], rtol=1e-12, atol=1e-12) and np.ptp(x) > 0.0


def table(clone: Path) -> list[tuple[str, int, tuple[str, str, str]]]:
    """Return name, version and results of each FMU."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        return [
            (name, fmi, results(name, fmi, path, folder))
            for (name, fmi), path in build(clone, folder).items()
        ]


if __name__ == "__main__":
    print("| FMU | FMI | master | package | container |\n| --- | --- | --- | --- | --- |")
    for name, fmi, texts in table(Path(sys.argv[1])):
        print(f"| {name} | {fmi}.0 | {' | '.join(texts)} |")
