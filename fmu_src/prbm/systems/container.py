"""Containers: a system of FMUs inside one FMU, made by FMPy, for tools that load only one FMU."""

import math
import shutil
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from fmpy import container_fmu  # type: ignore[import-untyped]
from fmpy.container_fmu import config  # type: ignore[import-untyped]
from fmpy.container_fmu.cli import create_container_fmu  # type: ignore[import-untyped]
from fmpy.model_description import (  # type: ignore[import-untyped]
    CoSimulation,
    DefaultExperiment,
    ModelDescription,
    ModelVariable,
    Unknown,
)

from ..base.atomic import write
from ..kernel import compiler
from ..runs.run import check_duration
from .components import (
    CouplingError,
    Value,
    attribute,
    check_instances,
    check_wire,
    described,
    start_value,
)
from .signals import BASE_UNITS

# Types of FMI 3.0 by their names in FMI 2.0.
NAMES3 = {"Real": "Float64", "Integer": "Int32"}
KINDS = ("parameter", "input", "output")
SUPPORTED = ("Float64", "Int32", "Boolean")  # types of FMI 3.0 that FMPy's library passes on
UNWRITTEN = {"canHandleMultipleSetPerTimeInstant": False}  # FMPy writes it unless it is False.
PLATFORMS = {platform.folder2: platform.name for platform in compiler.PLATFORMS.values()}
"""Platforms in FMI 3.0 by their names in FMI 2.0."""


def container(
    path: str | Path,
    fmus: Mapping[str, str | Path],
    connections: Mapping[str, str],
    step: float,
    values: Mapping[str, Value] | None = None,
    shown: Sequence[str] = (),
    fmi: int = 3,
    stop_time: float = 1.0,
) -> None:
    """Write an FMU for co-simulation that contains other FMUs and couples them.

    Parameters
    ----------
    path : str or Path
        The FMU to write, ``.fmu``.
    fmus : mapping
        The inner FMUs by the names of their instances.
    connections : mapping
        Source output by connected input, both as ``name.variable``.
    step : float
        Communication step of the inner FMUs [s].  The communication step of the container must be
        a multiple of it.
    values : mapping
        Start values, ``name.variable``.  These variables become parameters and inputs of the
        container.
    shown : sequence of str
        Further variables of the container, ``name.variable``.
    fmi : {2, 3}
        FMI version of the container (default: 3); the inner FMUs may have the other version.
    stop_time : float
        Stop time of the default experiment [s] (default: 1).

    Notes
    -----
    The coupling scheme is Jacobi's.  The container has no event mode and cannot save its state.  It
    has the binaries of the platforms that FMPy's library and all inner FMUs support.

    Raises
    ------
    CouplingError
        If an FMU cannot be read or has clocks, a name is unknown or cannot be used, a variable has
        the wrong causality or a type that a container does not support, a connection has two types,
        a start value has no effect or is not finite, or the FMUs have no platform in common.
    ParameterError
        If ``step`` or ``stop_time`` is not positive and finite.
    """
    values = dict(values or {})
    if fmi not in (2, 3):
        raise CouplingError(f"fmi = {fmi} must be 2 or 3")
    if not fmus:
        raise CouplingError("a container needs at least one FMU")
    check_instances(fmus, "./\\")
    check_duration("step", step)
    check_duration("stop_time", stop_time)
    for full in (*values, *shown):
        if full in connections:
            raise CouplingError(
                f"{full} takes {connections[full]}, so its value has no effect: leave it out of "
                "the variables of the container"
            )
    with tempfile.TemporaryDirectory(prefix="prbm_container_") as temporary:
        folder = Path(temporary)
        inside = {name: _inside(name, fmu, folder) for name, fmu in fmus.items()}
        common = _common_platforms(fmus)
        own = {full: values.get(full) for full in dict.fromkeys([*values, *shown])}
        mapped = {_shown(full, value, inside, fmi): full for full, value in own.items()}
        time = ModelVariable(
            name="time",
            valueReference=0,
            type=_type("Float64", fmi),
            causality="independent",
            variability="continuous",
            **UNWRITTEN,
        )
        outputs = [v for v in mapped if v.causality == "output"]
        system = config.Configuration(
            parallelDoStep=False,
            modelDescription=ModelDescription(
                fmiVersion=f"{fmi}.0",
                modelName=Path(path).stem,
                instantiationToken=f"{{{uuid5(NAMESPACE_URL, repr((connections, values)))}}}",
                generationTool="prbm-impact, FMPy",
                coSimulation=CoSimulation(modelIdentifier="", fixedInternalStepSize=step),
                modelVariables=[time, *mapped],  # FMPy numbers them from 0, the reference of time.
                defaultExperiment=DefaultExperiment(
                    startTime="0", stopTime=repr(stop_time), stepSize=repr(step)
                ),
                outputs=[Unknown(variable=v) for v in outputs],
                initialUnknowns=[Unknown(variable=v) for v in outputs],
                unitDefinitions=_units(mapped, inside),
            ),
            components=list(inside.values()),
            connections=[_wire(inside, *pair) for pair in connections.items()],
            variableMappings={v: [_found(inside, full)] for v, full in mapped.items()},
        )
        (folder / "unzipped").mkdir()
        try:
            create_container_fmu(system, folder / "unzipped", folder / "container.fmu")
        except (OSError, zipfile.BadZipFile) as error:
            raise CouplingError(f"an FMU cannot be unpacked ({error}); use an intact one") from None
        _remove_binaries(folder / "unzipped" / "binaries", common)
        archive = shutil.make_archive(str(folder / "common"), "zip", folder / "unzipped")
        write(path, Path(archive).read_bytes())


def _inside(name: str, fmu: str | Path, folder: Path) -> Any:
    """Copy an FMU to NAME.fmu, since the container names its folder after the file."""
    description, own = described(name, fmu), folder / f"{name}.fmu"
    if description.coSimulation is None:
        raise CouplingError(f"{name}: {fmu} has no co-simulation, which a container needs")
    for variable in description.modelVariables:
        if variable.type == "Clock":
            raise CouplingError(
                f"{name}: a container does not support clocks, such as {variable.name}; build the "
                "FMU without clocks"
            )
    shutil.copyfile(fmu, own)
    return config.Component(name, own, description)


def _common_platforms(fmus: Mapping[str, str | Path]) -> set[str]:
    """Return the platforms of FMPy's library that all FMUs have, by their names in FMI 3.0."""
    folder = Path(container_fmu.__file__).parent / "binaries"
    common = {x.name for x in folder.iterdir()}
    for name, fmu in fmus.items():
        with zipfile.ZipFile(fmu) as archive:
            parts = [x.split("/") for x in archive.namelist()]
        own = {x[1] for x in parts if x[0] == "binaries" and len(x) > 2 and x[2]}
        common &= {PLATFORMS.get(platform, platform) for platform in own}
        if not common:
            raise CouplingError(
                f"{name}: {fmu} has binaries for {', '.join(sorted(own)) or 'no platform'}, none "
                "of which FMPy's library and the FMUs before have too; use FMUs for one platform"
            )
    return common


def _remove_binaries(folder: Path, platforms: set[str]) -> None:
    """Remove the binaries of other platforms."""
    for found in folder.iterdir():
        if PLATFORMS.get(found.name, found.name) not in platforms:
            shutil.rmtree(found)


def _found(inside: Mapping[str, Any], full: str) -> tuple[Any, Any]:
    """Return the inner FMU and the variable of ``name.variable``."""
    name, _, variable = full.partition(".")
    component = inside.get(name)
    for candidate in component.modelDescription.modelVariables if component else ():
        if candidate.name == variable:
            return component, candidate
    raise CouplingError(f"{full}: unknown variable; write INSTANCE.VARIABLE")


def _type(kind: str, fmi: int) -> str:
    """Return the name of a type in a version of FMI."""
    three = NAMES3.get(kind, kind)
    two = {name: other for other, name in NAMES3.items()}
    return three if fmi == 3 else two.get(three, three)


def _shown(full: str, value: Value | None, inside: Mapping[str, Any], fmi: int) -> Any:
    """Return the variable of the container for a variable of an inner FMU."""
    _, variable = _found(inside, full)
    if variable.causality not in KINDS:
        raise CouplingError(f"{full}: must be a parameter, an input or an output")
    _check_type(full, variable)
    start = variable.start if value is None else start_value(full, value, variable)
    output = variable.causality == "output"
    given = {name: attribute(variable, name) for name in ("unit", "min", "max", "nominal")}
    return ModelVariable(
        name=full,
        valueReference=0,
        type=_type(variable.type, fmi),
        description=variable.description,
        causality=variable.causality,
        variability=variable.variability,
        initial="calculated" if output else None,
        start=None if output else _text(full, start),
        **given,
        **UNWRITTEN,
    )


def _definition(unit: Any) -> list[Any] | None:
    base = unit.baseUnit
    return (
        None
        if base is None
        else [getattr(base, name) for name in (*BASE_UNITS, "factor", "offset")]
    )


def _units(mapped: Mapping[Any, str], inside: Mapping[str, Any]) -> list[Any]:
    """Return the definitions of the units of the container's variables.

    Raises
    ------
    CouplingError
        If two FMUs define one unit differently.
    """
    found: dict[str, tuple[Any, str]] = {}
    for variable, full in mapped.items():
        description = _found(inside, full)[0].modelDescription
        for unit in description.unitDefinitions:
            if unit.name == variable.unit:
                first, other = found.setdefault(unit.name, (unit, full))
                if _definition(first) != _definition(unit):
                    raise CouplingError(
                        f"{full}: its unit {unit.name} is not that of {other}; leave one of them "
                        "out"
                    )
    return [unit for unit, _ in found.values()]


def _check_type(full: str, variable: Any) -> None:
    if _type(variable.type, 3) not in SUPPORTED or variable.dimensions:
        kind = "array" if variable.dimensions else variable.type
        raise CouplingError(
            f"{full}: a container does not support its type {kind}; leave the variable out"
        )


def _text(full: str, value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        raise CouplingError(f"{full} = {value} must be finite in a container")
    return str(value).lower() if isinstance(value, bool) else str(value)


def _wire(inside: Mapping[str, Any], to: str, source: str) -> Any:
    """Return a connection, with FMI 3.0 names of the types: FMPy's library requires them."""
    (giver, output), (taker, given) = _found(inside, source), _found(inside, to)
    check_wire(to, given, source)
    _check_type(source, output)
    _check_type(to, given)
    kinds = [_type(x.type, 3) for x in (output, given)]
    if kinds[0] != kinds[1]:
        raise CouplingError(
            f"{source} of type {output.type} cannot be connected to {to} of type {given.type} in a "
            "container; use the master or a package"
        )
    renamed = [copy(v) for v in (output, given)]
    for variable in renamed:
        variable.type = _type(variable.type, 3)
    return config.Connection(giver, renamed[:1], taker, renamed[1:])
