"""Builder of native FMUs: the C kernel, the tables of a mechanism and the files of the standard."""

import json
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files

from ..base.errors import MechanismError
from ..interface.native import NativeInterface, native_interface
from ..interface.tables import FILE, tables
from ..interface.variables import CLOCK
from ..kernel.compiler import HOST, NoCompilerError, Platform, browser_module, libraries
from ..kernel.sources import TABLES, amalgamation, files_digest, kernel, tables_header
from ..mechanism.description import Mechanism
from . import documentation
from .archive import zipped
from .description import Heading
from .export import Export
from .live.content import content
from .live.page import LivePart, live_part
from .native_description import LOG_CATEGORIES, build_description, description
from .parameter_sets import default_set
from .reference_results import reference
from .related import related_files
from .slave.resolved import FILE as MODEL
from .slave.resolved import resolved
from .terminals import terminals

NAMESPACE = uuid.UUID("f0b6b5a1-6d5c-5b0e-8c55-1a52a0e6f1d3")
# Paths of the PNG and the SVG.  FMI 2.0 has no place for an SVG but the documentation.
ICONS = {
    2: ("model.png", "documentation/icon.svg"),
    3: ("terminalsAndIcons/icon.png", "terminalsAndIcons/icon.svg"),
}
LICENSES = ("prbm-impact.txt", "zig.txt")
WINDOWS_LICENSE, LIVE_LICENSE = "mingw-w64.txt", "wasi-libc.txt"


def build(
    mechanism: Mechanism,
    changes: Mapping[str, float] | None = None,
    fmi: int = 3,
    platforms: Sequence[str] = (HOST,),
    clock: bool = False,
    progress: Callable[[str], None] = lambda step: None,
) -> bytes:
    """Return the native FMU of a mechanism: model exchange and co-simulation.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism to export.
    changes : mapping
        Start values of parameters and inputs that replace those of the mechanism.
    fmi : {2, 3}
        Version of FMI.
    platforms : sequence of str
        Platforms to compile for, see :func:`prbm.kernel.compiler.libraries`.
    clock : bool
        Whether each stop has an output clock (FMI 3.0).
    progress : callable
        Called with a description of each stage of the build.

    Returns
    -------
    bytes
        The zip archive; equal arguments give equal bytes.

    Raises
    ------
    PrbmError
        If the mechanism cannot start with these values, one of them is invalid, or there is no
        compiler for a platform.
    """
    return build_export(Export(mechanism, changes), fmi, platforms, clock, progress)


def build_export(
    export: Export,
    fmi: int = 3,
    platforms: Sequence[str] = (HOST,),
    clock: bool = False,
    progress: Callable[[str], None] = lambda step: None,
) -> bytes:
    """Return the native FMU of an export, as :func:`build`."""
    mechanism, changes = export.mechanism, export.changes
    progress("checking the start")
    native = described(export, fmi, clock)
    compiled = libraries(platforms, progress)
    progress(f"collecting {len(native.variables)} variables and the tables")
    name, source = mechanism.name, f"{mechanism.name}.c"
    default = export.experiment
    heading = Heading(name, mechanism.title, "", LOG_CATEGORIES, default)
    token = f"{{{uuid.uuid5(NAMESPACE, _digest(mechanism, native, fmi, source, heading))}}}"
    heading = replace(heading, guid=token)
    table = tables(mechanism, native.variables, token, native.independent, default.step)
    contents = {
        "modelDescription.xml": description(fmi, heading, mechanism, native, source),
        f"resources/{FILE}": table,
        f"resources/{MODEL}": _model(mechanism, native, default.step),
        f"sources/{source}": amalgamation(name, mechanism.title, fmi).encode(),
        f"sources/{TABLES}": tables_header(table).encode(),
    }
    if fmi == 3:
        contents["sources/buildDescription.xml"] = build_description(name, source)
        contents["terminalsAndIcons/terminalsAndIcons.xml"] = terminals(mechanism, native.variables)
    contents |= dict(_binaries(name, fmi, compiled))
    progress("computing the reference results")
    results = reference(mechanism, changes, native.variables, default, progress)
    contents |= related_files([default_set(mechanism, native.variables), *results])
    progress("drawing the icon and writing the documentation")
    contents |= dict(zip(ICONS[fmi], export.icons, strict=True))
    names = sorted(platform.name for platform in compiled)
    part = live(export, progress)
    contents["documentation/index.html"] = documentation.native_page(
        mechanism, native, fmi, names, default, bool(results), part
    ).encode()
    windows = any(platform.system == "windows" for platform in compiled)
    contents |= dict(_licenses(windows, part is not None))
    progress("packing")
    return zipped(contents)


def live(export: Export, progress: Callable[[str], None] = lambda step: None) -> LivePart | None:
    """Return the part of a page that simulates a mechanism.

    Parameters
    ----------
    export : Export
        The mechanism with the start values of the page.
    progress : callable
        Called with a description of the stage, and with a sentence if there is no such part.

    Returns
    -------
    LivePart or None
        None if no compiler makes the WebAssembly module that the page needs.
    """
    try:
        module = browser_module(progress)
    except NoCompilerError as error:
        progress(f"the documentation has no simulation: {error}.")
        return None
    return simulated_part(export, module)


def simulated_part(export: Export, module: bytes) -> LivePart:
    """Return the part of a page that simulates a mechanism, see :func:`live`.

    The page shows the stress of all flexures, whether or not it is an output of the FMU.  The
    motion does not depend on this.
    """
    default, export = export.experiment, export.with_stress
    mechanism, native = export.mechanism, described(export, 3)
    table = tables(mechanism, native.variables, "", native.independent, default.step)
    described_by = content(mechanism, native.variables, native.independent, default)
    return live_part(described_by, table, module)


def described(export: Export, fmi: int, clock: bool = False) -> NativeInterface:
    """Return the interface of the native FMU of an export.

    Raises
    ------
    PrbmError
        If the mechanism cannot start, a changed name is not a parameter or input, or clocks are
        requested for a mechanism without stops.
    """
    mechanism = export.mechanism
    if clock and not mechanism.stops:
        raise MechanismError(
            f"{mechanism.name} has no stop: a clock ticks at the impacts of a stop; build the FMU "
            "without clocks"
        )
    begun = export.start
    return native_interface(
        mechanism,
        begun.variables,
        begun.defaults,
        begun.magnitudes,
        export.independent,
        time=fmi == 3,
        clock=clock,
    )


def _digest(
    mechanism: Mechanism, native: NativeInterface, fmi: int, source: str, heading: Heading
) -> str:
    """Return a hash of everything that determines the FMU's behaviour, except its token."""
    parts = kernel() | {
        "modelDescription.xml": description(fmi, heading, mechanism, native, source),
        FILE: tables(mechanism, native.variables, "", native.independent, heading.experiment.step),
    }
    return files_digest(parts)


def _model(mechanism: Mechanism, native: NativeInterface, step: float) -> bytes:
    """Return the mechanism and its variables as JSON for tools; the FMU itself does not read it."""
    listed = [v for v in native.variables if v.type != CLOCK]
    return json.dumps(resolved(mechanism, listed, step), indent=1, sort_keys=True).encode()


def _binaries(
    name: str, fmi: int, compiled: Mapping[Platform, bytes]
) -> Iterator[tuple[str, bytes]]:
    for platform, library in compiled.items():
        folder = platform.folder2 if fmi == 2 else platform.name
        yield f"binaries/{folder}/{name}{platform.suffix}", library


def _licenses(windows: bool, live: bool) -> Iterator[tuple[str, bytes]]:
    """Yield the licences of all contents and ``license.txt``, which the standard requires."""
    folder = files(__package__).joinpath("licenses")
    names = [*LICENSES, *([WINDOWS_LICENSE] if windows else []), *([LIVE_LICENSE] if live else [])]
    entry = "The model and its engine are under the MIT licence.  Licences of all contents:\n"
    yield "documentation/licenses/license.txt", "\n".join([entry, *names, ""]).encode()
    for name in names:
        yield f"documentation/licenses/{name}", folder.joinpath(name).read_bytes()
