"""Python FMUs: the engine's own source, wrapped by pythonfmu, as FMI 2.0 co-simulation."""

import ast
import json
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import distribution
from importlib.resources import files as package_files
from pathlib import Path

from ..base.errors import MechanismError
from ..base.text import printable
from ..interface.variables import Variable
from ..kernel.sources import files_digest
from ..mechanism.description import Mechanism
from ..mechanism.flexure import PUBLISHED
from . import documentation
from .archive import zipped
from .description import Heading, model_description
from .export import Export
from .parameter_sets import default_set
from .related import related_files
from .slave.resolved import FILE, resolved
from .slave.slave import MechanismSlave

NAMESPACE = uuid.UUID("6f1c6c1e-0c53-5d0e-9d6e-3b1f0b4f7a52")
ROOT = __package__.rpartition(".")[0]  # The parent package.
SLAVE = "fmu.slave.slave"  # The module that the script of an FMU imports.
ENGINE = "engine"  # Placeholder of the shipped package, whose name depends on its content.
INIT = '"""The engine and the slave of this FMU, with relative imports only."""\n'
TOKEN_DIGITS = 10  # Hexadecimal digits of the content's hash in module names.

SCRIPT = '''\
"""{title}.

pythonfmu loads this module.  The folder {package} beside it contains the engine and the slave.
Its name is unique to this FMU and its content, because FMUs in one process share modules.

At every instantiation, pythonfmu 0.7.0 runs this file again and then releases a reference to its
global names that it does not own.  The reference added here keeps them alive; without it they are
freed while in use, and the process eventually crashes.
"""

import builtins
import ctypes
import sys

if sys.version_info < (3, 11):
    raise ImportError(
        "{name}.fmu needs Python 3.11 or later where it runs; this is Python "
        "%d.%d (%s)" % (sys.version_info[0], sys.version_info[1], sys.executable)
    )
try:
    import numpy
    import scipy
except ImportError as error:
    raise ImportError(
        "{name}.fmu needs NumPy and SciPy in the Python that runs it (%s); install them with "
        "'python -m pip install numpy scipy' (%s)" % (sys.executable, error)
    )

ctypes.pythonapi.Py_IncRef(ctypes.py_object(builtins.globals()))

from {package}.fmu.slave.slave import MechanismSlave


class {name}(MechanismSlave):
    """{title}."""
'''


def build(
    mechanism: Mechanism,
    changes: Mapping[str, float] | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> bytes:
    """Return the Python FMU of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    changes : mapping or None
        Start values of parameters and inputs that replace those of the mechanism.
    progress : callable
        Called with a description of each stage of the build.

    Returns
    -------
    bytes
        The zip archive; equal arguments give equal bytes.

    Raises
    ------
    PrbmError
        If the mechanism cannot start with these values, one of them is out of bounds, or a model of
        its flexures has been registered by a program.
    """
    return build_export(Export(mechanism, changes), progress)


def build_export(export: Export, progress: Callable[[str], None] = lambda step: None) -> bytes:
    """Return the Python FMU of an export, as :func:`build`."""
    mechanism = export.mechanism
    check_models(mechanism)
    progress("checking the start")
    listed = export.start.variables
    progress(f"collecting {len(listed)} variables and the engine")
    default = export.experiment
    sources = dict(_sources(mechanism, listed, default.step))
    token = f"{mechanism.name}_{files_digest(sources | {'': SCRIPT.encode()})[:TOKEN_DIGITS]}"
    progress("drawing the icon and writing the documentation")
    contents = {f"resources/{path}": text for path, text in _named(mechanism, token, sources)}
    contents |= dict(_binaries(mechanism.name))
    contents |= dict(_licenses())
    heading = Heading(mechanism.name, mechanism.title, "", MechanismSlave.log_categories, default)
    anonymous = files_digest(sources | {"": model_description(heading, listed)})
    heading = replace(heading, guid=f"{{{uuid.uuid5(NAMESPACE, anonymous)}}}")
    contents["modelDescription.xml"] = model_description(heading, listed)
    contents["documentation/index.html"] = documentation.page(mechanism, listed, default).encode()
    contents["model.png"], contents["documentation/icon.svg"] = export.icons
    contents |= related_files([default_set(mechanism, listed)])
    progress("packing")
    return zipped(contents)


def check_models(mechanism: Mechanism) -> None:
    """Reject a mechanism with a model that a program has registered.

    Raises
    ------
    MechanismError
        If a type of flexures has such a model.
    """
    for kind in mechanism.flexure_types:
        if kind.model not in PUBLISHED:
            raise MechanismError(
                f"flexure type {kind.name}: the model {kind.model} is registered in this process, "
                "and a Python FMU would not know it; build a native FMU, which contains it"
            )


def _sources(
    mechanism: Mechanism, listed: tuple[Variable, ...], step: float
) -> Iterator[tuple[str, bytes]]:
    """Yield the data and modules of the simulation, which determine the package's name."""
    data = json.dumps(resolved(mechanism, listed, step), indent=1, sort_keys=True)
    yield FILE, data.encode()
    yield f"{ENGINE}/__init__.py", INIT.encode()
    for path, text in shipped_modules().items():
        yield f"{ENGINE}/{path}", text
    for entry in _wrapper().iterdir():
        if entry.name.endswith(".py"):
            yield f"pythonfmu/{entry.name}", entry.read_bytes()


@cache
def shipped_modules() -> Mapping[str, bytes]:
    """Return the slave and all modules that it imports, directly or indirectly, by path."""
    found: dict[str, bytes] = {}
    waiting = [SLAVE]
    while waiting:
        module = waiting.pop()
        parts = module.split(".")
        file = package_files(ROOT).joinpath(*parts[:-1], f"{parts[-1]}.py")
        folder = package_files(ROOT).joinpath(*parts)
        if folder.is_dir():
            parts, file = [*parts, "__init__"], folder.joinpath("__init__.py")
        path = "/".join(parts) + ".py"
        if path in found or not file.is_file():  # No file: an imported function, class or constant.
            continue
        found[path] = file.read_bytes()
        waiting += _imported(found[path], parts[:-1])
        waiting += [".".join(parts[:k]) for k in range(1, len(parts))]
    return found


def _imported(source: bytes, package: Sequence[str]) -> Iterator[str]:
    """Yield the modules that a source file imports relatively, and the names from each."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.level:
            parts = [*package[: len(package) - node.level + 1], *(node.module or "").split(".")]
            module = ".".join(filter(None, parts))
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def _named(
    mechanism: Mechanism, token: str, sources: Mapping[str, bytes]
) -> Iterator[tuple[str, bytes]]:
    """Yield the resources under names that are unique to the FMU and its content."""
    package = f"prbm_{token}"
    for path, content in sources.items():
        first, slash, rest = path.partition("/")
        yield (package if first == ENGINE else first) + slash + rest, content
    script = SCRIPT.format(name=mechanism.name, title=_plain(mechanism.title), package=package)
    try:
        compile(script, token, "exec")
    except SyntaxError:
        raise MechanismError(
            f"mechanism name {mechanism.name!r}: not a valid name of a Python class; choose another"
        ) from None
    yield f"{token}.py", script.encode()
    yield "slavemodule.txt", token.encode()


def _plain(title: str) -> str:
    """Return a title without characters that have a meaning in a docstring."""
    return printable(title).replace("\\", "/").replace('"', "'").rstrip(".")


def _binaries(name: str) -> Iterator[tuple[str, bytes]]:
    for platform in _wrapper().joinpath("resources", "binaries").iterdir():
        for library in platform.iterdir():
            suffix = "." + library.name.rpartition(".")[2]
            if suffix in (".so", ".dll", ".dylib"):
                yield f"binaries/{platform.name}/{name}{suffix}", library.read_bytes()


def _wrapper() -> Path:
    """Return the folder of the installed library pythonfmu.

    The imported module may be the copy inside an FMU that ran in this process before.  That copy
    has no binaries, and its folder may be removed.
    """
    return Path(str(distribution("pythonfmu").locate_file("pythonfmu")))


def _licenses() -> Iterator[tuple[str, bytes]]:
    """Yield the licences of the engine and of pythonfmu."""
    for name in ("prbm-impact.txt", "pythonfmu.txt"):
        text = package_files(__package__).joinpath("licenses", name).read_bytes()
        yield f"documentation/licenses/{name}", text
