"""The layers of the kernel: the order in which its unit includes the files.

A file includes headers of earlier files only, and uses functions that earlier files define.  There
are then no circles.
"""

import re
import subprocess
from pathlib import Path

import pytest

from c_importer import FOLDERS
from kernel_library import KERNEL

UNIT = "prbm_fmu.c"
FILE = re.compile(r'^#include "(.+)\.c"$', re.MULTILINE)
HEADER = re.compile(r'^#include "(.+)\.h"$', re.MULTILINE)
ALONE = ("-std=c99", "-O0", "-w", "-DPRBM=", "-DSHARED=")  # All functions are symbols.

pytestmark = pytest.mark.native


def order(folder: Path) -> list[str]:
    """Return the names of the files, the lowest first."""
    return FILE.findall((folder / UNIT).read_text(encoding="utf-8"))


def upward_includes(folder: Path) -> list[str]:
    """Return the files, headers among them, that include the header of a later file."""
    places = {name: place for place, name in enumerate(order(folder))}
    found = []
    for name, place in places.items():
        for path in (folder / f"{name}.c", folder / f"{name}.h"):
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            found += [
                f"{path.relative_to(folder).as_posix()} includes {header}.h"
                for header in HEADER.findall(text)
                if places.get(header, -1) > place
            ]
    return found


def circles(folder: Path) -> list[str]:
    """Return the headers that include themselves through others."""
    graph = {
        path.relative_to(folder).with_suffix("").as_posix(): HEADER.findall(
            path.read_text(encoding="utf-8")
        )
        for path in folder.rglob("*.h")
    }

    def reached(name: str, known: set[str]) -> set[str]:
        for one in graph.get(name, ()):
            if one not in known:
                known.add(one)
                reached(one, known)
        return known

    return sorted(name for name in graph if name in reached(name, set()))


def symbols(folder: Path, name: str, place: Path) -> tuple[set[str], set[str]]:
    """Return the symbols that a file defines, and those that it uses from other files."""
    command = ["cc", *ALONE, f"-I{folder}", *FOLDERS, "-c", str(folder / f"{name}.c")]
    subprocess.run([*command, "-o", str(place)], check=True)
    text = subprocess.run(["nm", str(place)], check=True, capture_output=True, text=True).stdout
    lines = [line.split() for line in text.splitlines()]
    defined = {line[2] for line in lines if len(line) == 3 and line[1] in "TDBR"}
    return defined, {line[1] for line in lines if len(line) == 2 and line[0] == "U"}


def upward_calls(folder: Path, place: Path) -> list[str]:
    """Return the uses of functions that a later file defines."""
    names = order(folder)
    found = {name: symbols(folder, name, place) for name in names}
    home = {symbol: k for k, name in enumerate(names) for symbol in found[name][0]}
    return [
        f"{name}.c uses {symbol} of {names[home[symbol]]}.c"
        for k, name in enumerate(names)
        for symbol in sorted(found[name][1])
        if home.get(symbol, -1) > k
    ]


def test_all_files_are_in_the_order():
    files = {path.relative_to(KERNEL).with_suffix("").as_posix() for path in KERNEL.rglob("*.c")}
    assert {*order(KERNEL), Path(UNIT).stem} == files
    assert len(order(KERNEL)) == len({*order(KERNEL)})


def test_files_include_headers_of_earlier_files_only():
    assert upward_includes(KERNEL) == []
    assert circles(KERNEL) == []


@pytest.mark.slow
def test_files_use_functions_of_earlier_files_only(tmp_path):
    assert upward_calls(KERNEL, tmp_path / "one.o") == []


def test_calls_and_includes_upwards_are_found(tmp_path):
    (tmp_path / UNIT).write_text('#include "low.c"\n#include "high.c"\n', encoding="utf-8")
    (tmp_path / "low.h").write_text('#include "high.h"\n', encoding="utf-8")
    (tmp_path / "low.c").write_text(
        "int high(void);\nint low(void) { return high(); }\n", encoding="utf-8"
    )
    (tmp_path / "high.h").write_text('#include "low.h"\n', encoding="utf-8")
    (tmp_path / "high.c").write_text(
        "int low(void);\nint high(void) { return low(); }\n", encoding="utf-8"
    )
    assert upward_includes(tmp_path) == ["low.h includes high.h"]
    assert circles(tmp_path) == ["high", "low"]
    assert upward_calls(tmp_path, tmp_path / "one.o") == ["low.c uses high of high.c"]
