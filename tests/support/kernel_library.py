"""The C kernel as a Python module: every function that kernel.h declares, on NumPy arrays.

Everything is derived from the header: its structures become :class:`ctypes.Structure`, its
prototypes become functions.  Each call gets working memory and a place for an error message.  A
message is raised as :class:`KernelError`.
"""

import ctypes
import math
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

import prbm.kernel
from prbm.interface.tables import tables
from prbm.mechanism.description import Mechanism

KERNEL = Path(prbm.kernel.__file__).parent
FLAGS = (
    "-std=c99", "-O0", "-fPIC", "-shared", "-ffp-contract=off", "-DPRBM=", f"-I{KERNEL}",
    "-Wl,-Bsymbolic",  # Calls within the library use its own functions.
)  # fmt: skip
WORKING_MEMORY = 1 << 16  # Doubles.

SCALARS = {
    "bool": ctypes.c_bool,
    "char": ctypes.c_char,
    "unsigned char": ctypes.c_ubyte,
    "int": ctypes.c_int,
    "double": ctypes.c_double,
    "size_t": ctypes.c_size_t,
    "uint32_t": ctypes.c_uint32,
}
DTYPES = {
    "double": np.float64,
    "int": np.int32,
    "Complex": np.complex128,
    "unsigned char": np.uint8,
}


ENUMERATIONS = (
    "BranchCode",
    "ContactMode",
    "Phase",
    "SpringPhase",
)  # Those that are types of arguments or of structure members.
SCALARS |= dict.fromkeys(ENUMERATIONS, ctypes.c_int)
DTYPES |= dict.fromkeys(ENUMERATIONS, np.int32)


class KernelError(Exception):
    """The error message of a function of the kernel."""


# --- the header -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Declared:
    """A name with its type: ``const double *K`` or ``int gravity[2]``."""

    name: str
    type: str
    const: bool
    stars: int
    length: str = ""


@dataclass(frozen=True)
class Prototype:
    """A function declared by kernel.h, and the C file that defines it."""

    name: str
    result: Declared
    arguments: tuple[Declared, ...]
    variadic: bool
    file: str


def _plain(text: str) -> str:
    """Return C without comments, directives and attributes."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    text = re.sub(r"^#.*(?:\\\n.*)*$", "", text, flags=re.MULTILINE)
    return re.sub(r"__attribute__\s*\(\(.*?\)\)\)?", "", text)


def _declared(text: str) -> list[Declared]:
    """Read ``const double *a, *b`` or ``int gravity[2], tolerance``."""
    words = re.sub(r"\bstruct\b", "", text).strip()
    const = "const" in words
    base, rest = re.match(r"((?:unsigned\s+)?\w+)\s*(.*)", words.replace("const", "").strip(),
                          re.DOTALL).groups()  # fmt: skip
    found = []
    for one in rest.split(",") if rest else [""]:
        stars, name, length = re.fullmatch(r"([\s*]*)(\w*)(?:\[(\w+)\])?\s*", one.strip()).groups()
        found.append(Declared(name, base, const, stars.count("*"), length or ""))
    return found


@cache
def _header() -> str:
    """Return the declarations of generated.h and of all headers that kernel.h includes.

    A line ``@name.c@`` precedes the declarations of each header ``core/name.h``.
    """
    included = re.findall(
        r'#include "core/(\w+)\.h"', (KERNEL / "kernel.h").read_text(encoding="utf-8")
    )
    return _plain((KERNEL / "generated.h").read_text(encoding="utf-8")) + "\n".join(
        f"@{name}.c@\n" + _plain((KERNEL / "core" / f"{name}.h").read_text(encoding="utf-8"))
        for name in included
    )


def constants() -> dict[str, int]:
    """Return the enumeration constants of the header by name."""
    found: dict[str, int] = {}
    for body in re.findall(r"\benum\s*\w*\s*\{(.*?)\}", _header(), re.DOTALL):
        number = -1
        for entry in filter(None, (part.strip() for part in body.split(","))):
            name, _, given = (part.strip() for part in entry.partition("="))
            factors = (factor.strip() for factor in given.split("*"))
            known = (found[x] if x in found else int(x) for x in factors if x)
            number = math.prod(known) if given else number + 1
            found[name] = number
    return found


@cache
def structures() -> dict[str, type[ctypes.Structure]]:
    """Return the structures of the header by name."""
    known, numbers = {}, constants()
    for body, name in re.findall(r"typedef struct\s*\{([^}]*)\}\s*(\w+);", _header()):
        fields = []
        for line in filter(str.strip, body.split(";")):
            for field in _declared(line):
                kind = known.get(field.type) or SCALARS[field.type]
                if field.stars:
                    kind = ctypes.c_void_p
                if field.length:
                    kind *= int(numbers.get(field.length, 0) or field.length)
                fields.append((field.name, kind))
        known[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return known


@cache
def prototypes() -> dict[str, Prototype]:
    """Return all functions of the header by name."""
    found = {}
    file = ""
    for heading, head, body in re.findall(
        r"@(\w+\.c)@|\bPRBM\b([^;()]*)\(([^;]*?)\)\s*;", _header()
    ):
        if heading:
            file = heading
            continue
        result = _declared(head)[0]
        parts = [part.strip() for part in body.split(",")]
        arguments = tuple(_declared(part)[0] for part in parts if part not in ("...", "void"))
        found[result.name] = Prototype(result.name, result, arguments, "..." in parts, file)
    return found


# --- the library ----------------------------------------------------------------------------------


def translation_unit() -> str:
    """Return C code that includes kernel.h and all C files of core/."""
    includes = re.findall(
        r'#include "(core/\w+\.c)"', (KERNEL / "prbm_fmu.c").read_text(encoding="utf-8")
    )
    return "".join(f'#include "{name}"\n' for name in ("kernel.h", *includes))


def compiled(
    flags: Sequence[str] = (), compiler: Sequence[str] = ("cc",), text: str = ""
) -> ctypes.CDLL:
    """Compile the C files of core/ and the code ``text`` after them, and load the library.

    All functions are visible, because ``FLAGS`` defines the macro PRBM, static elsewhere, as empty.
    """
    folder = Path(mkdtemp(prefix="prbm-kernel-"))
    try:
        source, library = folder / "kernel.c", folder / "kernel.so"
        source.write_text(translation_unit() + text, encoding="utf-8")
        command = [*compiler, *FLAGS, *flags, str(source), "-o", str(library), "-lm"]
        subprocess.run(command, check=True, capture_output=True, text=True)
        return ctypes.CDLL(str(library))
    finally:
        shutil.rmtree(folder)


class Kernel:
    """The functions of the kernel as methods with their names in C.

    Arrays that a function only reads (const) are converted to contiguous arrays of the right type.
    Arrays that it writes are passed without a copy, and must be contiguous and of the right type.
    """

    def __init__(self, library: ctypes.CDLL) -> None:
        self.library = library
        self.called: set[str] = set()
        self.memory = np.full(WORKING_MEMORY, np.nan)
        self.spare = np.full(WORKING_MEMORY, np.nan)
        self.block = structures()["ScratchBlock"](
            self.memory.ctypes.data, self.spare.ctypes.data, WORKING_MEMORY, 0, False
        )
        self.problem = structures()["Problem"]()

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name not in prototypes():
            raise AttributeError(f"kernel.h declares no function {name}")
        return lambda *given: self.call(prototypes()[name], given)

    def call(self, prototype: Prototype, given: tuple[Any, ...]) -> Any:
        """Call a function; raise its error message, if any."""
        self.called.add(prototype.name)
        function = getattr(self.library, prototype.name)
        function.restype = _result(prototype.result)
        self.block.most, self.block.exceeded, self.problem.text = 0, False, b""
        supplied, kept = iter(given), []
        arguments = [self._argument(a, supplied, kept) for a in prototype.arguments]
        rest = list(supplied)
        assert prototype.variadic or not rest, f"{prototype.name}: {len(rest)} arguments too many"
        result = function(*arguments, *rest)
        assert not self.block.exceeded, f"{prototype.name} needs more working memory"
        self.memory[: self.block.most] = np.nan  # The next call must not rely on old contents.
        if self.problem.text:
            raise KernelError(self.problem.text.decode())
        return complex(result.re, result.im) if hasattr(result, "re") else result

    def _argument(self, wanted: Declared, supplied: Iterator[Any], kept: list[Any]) -> Any:
        if wanted.type == "Scratch":
            scratch = structures()["Scratch"](ctypes.addressof(self.block), 0)
            return ctypes.byref(scratch) if wanted.stars else scratch
        if wanted.stars and wanted.type == "Problem":
            return ctypes.byref(self.problem)
        value = next(supplied)
        if not wanted.stars:
            return _scalar(wanted.type, value)
        if value is None or isinstance(value, (bytes, int)):
            return ctypes.c_void_p(value) if isinstance(value, int) else value
        if isinstance(value, ctypes.Structure):
            return ctypes.byref(value)
        kind = DTYPES[wanted.type]
        if wanted.const:
            value = np.ascontiguousarray(value, kind)
        assert value.dtype == kind, f"{wanted.name} must be {kind}"
        assert value.flags.c_contiguous, f"{wanted.name} must be contiguous"
        kept.append(value)
        return ctypes.c_void_p(value.ctypes.data)


def _result(declared: Declared) -> Any:
    if declared.stars:
        return ctypes.c_void_p
    if declared.type == "void":
        return None
    return structures().get(declared.type) or SCALARS[declared.type]


def _scalar(kind: str, value: Any) -> Any:
    if kind == "Complex":
        return structures()["Complex"](value.real, value.imag)
    known = structures().get(kind)
    return value if known else SCALARS[kind](value)


@cache
def kernel() -> Kernel:
    """Return the kernel, compiled once."""
    return Kernel(compiled())


def coulomb_laws(
    friction: Any, fixed: Any, normal: Any, L: Any = (), b: Any = ()
) -> ctypes.Structure:
    """Return the laws of friction of contacts, whose arrays stay alive with them."""
    arrays = [np.ascontiguousarray(x, float) for x in (friction, fixed, L, b)]
    arrays.insert(2, np.ascontiguousarray(normal, np.int32))
    mu, most, of, matrix, constants = (x.ctypes.data for x in arrays)
    laws = structures()["CoulombLaws"](mu, most, of, len(arrays[-1]), matrix, constants)
    laws.arrays = arrays
    return laws


# --- a mechanism in the kernel --------------------------------------------------------------------


def array(address: int | None, *shape: int, kind: str = "double") -> np.ndarray:
    """Return a copy of an array of the kernel."""
    dtype = np.dtype(DTYPES[kind])
    count = int(np.prod(shape))
    if not count:
        return np.zeros(shape, dtype)
    return np.frombuffer(ctypes.string_at(address, count * dtype.itemsize), dtype).reshape(shape)


def placed(lay_out: Callable[[ctypes.Structure], Any]) -> np.ndarray:
    """Return a new block of memory in which a function of the kernel has placed its arrays.

    The function is called twice: without memory, to count the bytes, and with the block.
    """
    counting = structures()["Memory"](None, 0)
    lay_out(counting)
    block = np.full(counting.used // 8 + 2, np.nan)
    start = block.ctypes.data + -block.ctypes.data % 16
    placing = structures()["Memory"](start, 0)
    lay_out(placing)
    assert placing.used == counting.used
    return block


class KernelSystem:
    """A mechanism, read from its tables and assembled by the kernel."""

    def __init__(self, mechanism: Mechanism, count: int) -> None:
        self.kernel, self.count = kernel(), count
        content = tables(mechanism, (), "token", range(count))
        self.address = self.kernel.mechanism_open(content, len(content))
        self.mechanism = structures()["Mechanism"].from_address(self.address)
        self.structure = structures()["System"]()
        self.block = placed(
            lambda memory: self.kernel.system_place(self.structure, self.address, memory)
        )

    def assemble(self, values: dict[str, float]) -> None:
        """Compute the arrays of the system from the values of all parameters."""
        self.values = np.array(list(values.values()))
        self.kernel.assemble(self.structure, self.values)

    def close(self) -> None:
        """Free the tables."""
        self.kernel.mechanism_close(self.address)

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.structure, name)
        shapes = self._shapes()
        if name not in shapes:
            return complex(value.re, value.im) if hasattr(value, "re") else value
        kind, *shape = shapes[name]
        return array(value, *shape, kind=kind)

    def _shapes(self) -> dict[str, tuple[Any, ...]]:
        x = self.structure
        n, d, r, p, s, f = x.n, x.d, x.r, x.p, x.s, x.f
        points = self.mechanism.friction_count
        return {
            "q0": ("double", n), "J": ("double", d), "K": ("double", n, n),
            "H": ("Complex", d, d), "A": ("Complex", p, d), "c": ("Complex", p),
            "m": ("double", p), "S": ("Complex", d),
            "loops": ("Complex", r, d), "loops_c": ("double", r),
            "gaps": ("Complex", s, d), "slides": ("Complex", s, d), "gaps_c": ("double", s),
            "gaps_z": ("Complex", s), "slides_z": ("Complex", s), "on": ("int", s),
            "rubs": ("Complex", f, d), "rubs_z": ("Complex", f), "rubs_on": ("int", f),
            "normals": ("int", f), "lifts": ("Complex", points, d), "lifts_c": ("double", points),
            "release": ("Complex", d), "stretches": ("int", x.stretch_count),
        }  # fmt: skip

    def links(self) -> np.ndarray:
        """Return the coordinates that are angles of flexures."""
        return array(self.mechanism.links, self.mechanism.link_count, kind="int")

    def arm(self) -> np.ndarray:
        """Return the arm that each direction turns or stretches."""
        return array(self.mechanism.arms, self.structure.d, kind="int")

    def strains(self) -> np.ndarray:
        """Return the coordinates that are strains of flexures."""
        return array(self.mechanism.strains, self.mechanism.strain_count, kind="int")

    def map(self) -> np.ndarray:
        """Return the map from coordinates to directions, (d, n)."""
        columns = np.eye(self.structure.n)
        return np.array(
            [
                [self.kernel.direction_of(self.structure, column, j) for column in columns]
                for j in range(self.structure.d)
            ]
        )

    def blocks(self) -> np.ndarray:
        """Return the starts and sizes of the blocks of the mass matrix of the directions."""
        return array(self.structure.blocks, self.structure.block_count, 3, kind="int")[:, :2]

    def mass_blocks(self) -> np.ndarray:
        """Return start, size and split of each block of the mass matrix."""
        return array(self.structure.mass_blocks, self.structure.mass_block_count, 3, kind="int")

    def last(self) -> np.ndarray:
        """Return the last column of each row of the mass matrix, counted in its block."""
        return array(self.structure.last, self.structure.n, kind="int")

    def frame(self, group: str, i: int) -> tuple[int, int, complex, complex, np.ndarray]:
        """Return ``(j, arm, c, drawn, A)`` of the i-th point of a group, fixed to a body.

        j and arm are the coordinate and the direction of the body's rotation.  The position of the
        point is c + A e, and ``drawn`` at the straight shape.  The group is ``bodies``, ``pushed``
        or ``probes``.
        """
        kind = structures()["BodyFrame"]
        frame = kind.from_address(getattr(self.structure, group) + i * ctypes.sizeof(kind))
        c, drawn = (complex(z.re, z.im) for z in (frame.c, frame.drawn))
        return frame.j, frame.arm, c, drawn, array(frame.A, self.structure.d, kind="Complex")
