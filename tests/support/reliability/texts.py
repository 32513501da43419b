"""Changed texts: mechanism files, records, LabVIEW files, SSP packages, drawings and units.

A text is a valid one in which pieces are replaced, removed, repeated, exchanged or inserted.  It
must be read or rejected with an error of the package, within a limit of CPU time.
"""

import signal
import tempfile
import traceback
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import NamedTuple

import numpy as np

from c_importer import host_fmu
from changed_texts import CHANGES, FRAGMENTS, REMOVED_MAX, change, pieces_of
from drawn_plates import framed_stage, svg
from drawn_plates import write as write_dxf
from measurement_layouts import LAYOUTS, lvm
from mechanism_mistakes import EXAMPLE
from prbm.base.errors import PrbmError
from prbm.cad.importing import Options, import_drawing
from prbm.data.records import read_record
from prbm.files import record_units, units
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.files.settings import quantity
from prbm.systems import ssp

from .report import Part

UNITS = (
    "12 mm", "1.5e-3 N*m/rad", "7800 kg/m^3", "181.5 GPa", "3 m/s**2", "90 deg", "1 1/s", "5 %",
    "2 mm2", "0.1 kg.m2", "(3 + 4) mm", "1 in", "20 degC", "4 lbf/in^2", "1 J/(kg*K)",
)  # fmt: skip
CPU_SECONDS = 20.0  # Of one text: reading ends; its speed depends on the machine.
PACKAGES_SHARE = 50  # Reading a package takes this many times as long as reading a text,
DRAWINGS_SHARE = 20  # and recognising a drawing.


class Kind(NamedTuple):
    """A kind of text: a reader of a file or text, valid texts, and the suffix of the file."""

    read: Callable[[Path], object]
    texts: Sequence[str]
    suffix: str = ".txt"
    share: int = 1


class TooSlowError(BaseException):
    """The CPU time of a text is used up; no handler of Exception catches this."""


def changed(rng: np.random.Generator, text: str) -> str:
    """Return a text with one to four changes."""
    pieces = pieces_of(text)
    for _ in range(rng.integers(1, 5)):
        i, j = (int(rng.integers(0, max(1, len(pieces)))) for _ in range(2))
        fragment = FRAGMENTS[rng.integers(len(FRAGMENTS))]
        kind, count = int(rng.integers(CHANGES)), int(rng.integers(1, REMOVED_MAX + 1))
        change(pieces, kind, i, j, count, fragment)
    return "".join(pieces)


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise TooSlowError when a block has used an amount of CPU time."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise TooSlowError

    previous = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, previous)


def outcome(read: Callable[[], object]) -> str:
    """Return "read", "rejected", or the error that should not occur."""
    try:
        with limited(CPU_SECONDS):
            read()
    except PrbmError:
        return "rejected"
    except TooSlowError:
        return f"more than {CPU_SECONDS:g} s"
    except BaseException as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error!s:.80} ({Path(last.filename).name}:{last.lineno})"
    return "read"


def _record_unit(unit: str) -> None:
    """Convert the unit of a column to SI, if it is one."""
    if not record_units.is_unit(unit):
        raise PrbmError(f"{unit!r} is no unit")
    record_units.in_si(unit)


def _unit(path: Path) -> None:
    """Read the text of a file as a quantity and as a unit, as options and heads do."""
    text = path.read_text(encoding="utf-8", errors="surrogatepass")
    errors = []
    unit = text.partition(" ")[2]
    readers: tuple[Callable[[], object], ...] = (
        lambda: quantity(text, "m", "--option"),
        lambda: units.quantity(text, "m"),
        lambda: units.si_unit(unit),
        lambda: _record_unit(unit),
    )
    for read in readers:
        try:
            read()
        except PrbmError as error:
            errors.append(error)
    if len(errors) == len(readers):
        raise errors[0]


def _package(path: Path) -> None:
    """Replace the description in a package by the text of a file, and simulate two steps."""
    text, changed_package = path.read_bytes(), path.with_suffix(".ssp")
    with zipfile.ZipFile(_valid_package()) as old, zipfile.ZipFile(changed_package, "w") as new:
        for name in old.namelist():
            new.writestr(name, text if name == "SystemStructure.ssd" else old.read(name))
    ssp.simulate(changed_package, 2e-3, 1e-3)


_packages: list[tuple[tempfile.TemporaryDirectory[str], Path]] = []


def _valid_package() -> Path:
    """Return a package of two guides, the stop of the second on the first."""
    if not _packages:
        folder = tempfile.TemporaryDirectory(prefix="prbm_texts_")
        path = Path(folder.name) / "walls.ssp"
        fmu = host_fmu("PRBDM", 2)
        wires = {"second.stop.displacement": "first.shuttle.x"}
        ssp.package(path, {"first": fmu, "second": fmu}, wires, {"first.stop.position": 0.05}, 1.0)
        _packages.append((folder, path))
    return _packages[0][1]


def _drawing(path: Path) -> None:
    """Read a file as the outline of a mechanism."""
    import_drawing(path, Options(1e-3))


def _drawn(suffix: str) -> str:
    """Return the text of a drawing of a stage in a frame, without the head of a DXF file."""
    if suffix == ".svg":
        return svg(framed_stage(), 'width="120mm" viewBox="0 0 120 100"')
    with tempfile.TemporaryDirectory(prefix="prbm_texts_") as name:
        text = write_dxf(Path(name) / "plate.dxf", framed_stage(), "R12").read_text("utf-8")
    return "  0\nSECTION\n  2\n" + text[text.index("ENTITIES") :]


def kinds() -> dict[str, Kind]:
    """Return the kinds of texts by name."""
    with zipfile.ZipFile(_valid_package()) as archive:
        description = archive.read("SystemStructure.ssd").decode()
    tables = [text for text, _ in LAYOUTS.values()]
    files = [EXAMPLE, *(path.read_text(encoding="utf-8") for path in shipped().values())]
    return {
        "TOML": Kind(read_mechanism, files, ".toml", 5),
        "CSV": Kind(read_record, tables, ".csv"),
        "LVM": Kind(read_record, [lvm(), lvm(","), lvm(columns="No")], ".lvm"),
        "SSP": Kind(_package, [description], ".ssd", PACKAGES_SHARE),
        "DXF": Kind(_drawing, [_drawn(".dxf")], ".dxf", DRAWINGS_SHARE),
        "SVG": Kind(_drawing, [_drawn(".svg")], ".svg", DRAWINGS_SHARE),
        "units": Kind(_unit, UNITS),
    }


def fuzzed(kind: Kind, count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Return the numbers of texts that are read and rejected, and the wrong outcomes."""
    found: Counter[str] = Counter()
    wrong = []
    with tempfile.TemporaryDirectory(prefix="prbm_texts_") as name:
        path = Path(name) / f"text{kind.suffix}"
        for number in range(seed, seed + count):
            rng = np.random.default_rng(number)
            text = changed(rng, kind.texts[rng.integers(len(kind.texts))])
            path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
            result = outcome(lambda: kind.read(path))
            found[result if result in ("read", "rejected") else "wrong"] += 1
            if result not in ("read", "rejected"):
                wrong.append(f"seed {number}: {result}")
    return found, wrong


def run(count: int, seed: int = 0, names: list[str] | None = None) -> Part:
    """Read changed texts of each kind; the slow kinds get fewer."""
    part = Part("Changed texts", ("text", "texts", "read", "rejected", "wrong"))
    for name, kind in kinds().items():
        if names is None or name in names:
            found, wrong = fuzzed(kind, max(1, count // kind.share), seed)
            part.add(name, found.total(), found["read"], found["rejected"], found["wrong"])
            part.failures += [f"{name}: {line}" for line in wrong]
    part.total()
    return part
