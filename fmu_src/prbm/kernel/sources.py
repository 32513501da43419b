"""The C source inside a native FMU: the kernel as one file, and its tables as a constant array."""

import hashlib
import re
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable

from ..base.text import printable
from ..base.version import GENERATION_TOOL

UNIT = "prbm_fmu.c"  # The file that is compiled; it includes all others.
ENGINE_UNIT = "engine.c"  # Functions of the library that the Python package loads.
TABLES = "mechanism_tables.h"
WRAPPERS = {
    2: ("fmi/fmi2.c",),
    3: ("fmi/fmi3.c", "fmi/fmi3_values.c", "fmi/fmi3_absent.c"),
}
INCLUDE = re.compile(r'#\s*include\s+"([^"]+)"\s*')
OVERRIDE = "FMI{}_OVERRIDE_FUNCTION_PREFIX"
BYTES_PER_LINE = 20

HEAD = """\
/* {name}: {title}.
 *
 * The C kernel of {tool} as one file, for FMI {version}.0.  It needs the C library only; all
 * functions except those of the standard are static.  {tables} contains the mechanism, so
 * that no file is read at run time.  Compile without -ffast-math and, for the same results on every
 * platform, with -ffp-contract=off.
{naming} */
#ifndef PRBM_FMI
#define PRBM_FMI {version}
#endif
#ifndef PRBM_TABLES
#define PRBM_TABLES
#endif
"""


def files_digest(contents: Mapping[str, bytes]) -> str:
    """Return the SHA-256 of the names and contents of files, as hexadecimal digits."""
    digest = hashlib.sha256()
    for name in sorted(contents):
        digest.update(name.encode() + b"\0" + hashlib.sha256(contents[name]).digest())
    return digest.hexdigest()


def kernel() -> dict[str, bytes]:
    """Return the files of the kernel by path relative to its folder, with ``/`` between names."""
    return dict(_files(files(__package__), ""))


def _files(folder: Traversable, prefix: str) -> Iterator[tuple[str, bytes]]:
    for entry in folder.iterdir():
        path = f"{prefix}{entry.name}"
        if entry.is_dir():
            yield from _files(entry, f"{path}/")
        elif entry.name.endswith((".c", ".h")):
            yield path, entry.read_bytes()


NAMING = {
    2: " * Function names have a prefix if {prefix} is defined.\n",
    3: " * Function names have the prefix {name}_, unless {override} is defined.\n",
}
PREFIX = "#ifndef {prefix}\n#define {prefix} {name}_\n#endif\n"
"""Tools that compile source code of FMI 2.0 expect names without a prefix."""


def amalgamation(name: str, title: str, version: int) -> str:
    """Return the kernel as one C file, with the wrapper for one version of FMI."""
    texts = {file: content.decode() for file, content in kernel().items()}
    left_out = {file for number in WRAPPERS if number != version for file in WRAPPERS[number]}
    left_out |= {ENGINE_UNIT}
    prefix, override = f"FMI{version}_FUNCTION_PREFIX", OVERRIDE.format(version)
    names = {"name": name, "prefix": prefix, "override": override}
    head = HEAD.format(
        name=name,
        title=printable(title).replace("*/", "* /"),
        tool=GENERATION_TOOL,
        version=version,
        tables=TABLES,
        naming=NAMING[version].format(**names),
    )
    head += PREFIX.format(**names) if version == 3 else ""
    return head + "\n".join(_lines(UNIT, texts, left_out)) + "\n"


def _lines(file: str, texts: Mapping[str, str], done: set[str]) -> list[str]:
    """Return the lines of a file with those of the files that it includes, each file once."""
    done.add(file)
    result = []
    for line in texts[file].splitlines():
        found = INCLUDE.fullmatch(line)
        included = found.group(1) if found else ""
        if included not in texts:
            result.append(line)
        elif included not in done:
            result += _lines(included, texts, done)
    return result


def tables_header(tables: bytes) -> str:
    """Return the tables of a mechanism as a constant array."""
    rows = (
        ", ".join(map(str, tables[i : i + BYTES_PER_LINE])) + ","
        for i in range(0, len(tables), BYTES_PER_LINE)
    )
    return (
        "/* resources/mechanism.bin as a constant array, for targets without a file system. */\n"
        f"static const unsigned char mechanism_tables[{len(tables)}] = {{\n"
        + "\n".join(rows)
        + "\n};\n"
    )
