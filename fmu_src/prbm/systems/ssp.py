"""System structure packages (SSP 1.0): FMUs, their connections and start values in one file.

Co-simulation masters read such packages.  :func:`simulate` runs one with :mod:`.cosimulation`.
"""

import io
import math
import tempfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote
from xml.etree import ElementTree as ET

import numpy as np

from ..base.atomic import write
from ..base.progress import Progress
from ..runs.result import Columns
from ..runs.run import check_duration
from . import cosimulation
from .components import (
    CouplingError,
    Value,
    check_instances,
    check_wire,
    described,
    start_value,
)
from .nodes import Flat, check_types, column, items_of
from .structure import Package

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
DESCRIPTION = "SystemStructure.ssd"
EPOCH = (1980, 1, 1, 0, 0, 0)  # Date of all files: equal systems give equal bytes.
KINDS = {"Real": "Real", "Float64": "Real", "Integer": "Integer", "Int32": "Integer",
         "Boolean": "Boolean", "String": "String", "Enumeration": "Enumeration"}  # fmt: skip
"""Types of SSP by the types of FMI 2.0 and 3.0."""


def package(
    path: str | Path,
    fmus: Mapping[str, str | Path],
    connections: Mapping[str, str],
    values: Mapping[str, Value] | None = None,
    stop_time: float = 1.0,
    title: str = "",
) -> None:
    """Write a system as a package.

    Parameters
    ----------
    path : str or Path
        The package to write, ``.ssp``.
    fmus : mapping
        FMUs for co-simulation by the names of their instances, in the order of their steps.
    connections : mapping
        Source output by connected input, both as ``name.variable``.
    values : mapping
        Start values of parameters and inputs, ``name.variable``.
    stop_time : float
        Stop time of the default experiment [s] (default: 1).
    title : str
        Name of the system (default: that of the file).

    Raises
    ------
    CouplingError
        If an FMU cannot be read, a name is unknown or cannot be used, a variable has the wrong
        causality, types do not match, or a type or a value has no counterpart in SSP.
    ParameterError
        If ``stop_time`` is not positive and finite.
    OSError
        If the package cannot be written; no part of it remains.
    """
    path, values = Path(path), dict(values or {})
    check_instances(fmus, "./")
    check_duration("stop_time", stop_time)
    variables = {
        name: {v.name: v for v in described(name, fmu).modelVariables} for name, fmu in fmus.items()
    }
    for full, value in values.items():
        name, variable = _found(variables, full)
        values[full] = start_value(full, value, variables[name][variable])
    root = ET.Element(f"{{{SSD}}}SystemStructureDescription")
    root.attrib.update(version="1.0", name=title or path.stem)
    system = _add(root, SSD, "System", name="system")
    elements = _add(system, SSD, "Elements")
    for name in fmus:
        _component(elements, name, variables[name], connections, values)
    wires = _add(system, SSD, "Connections") if connections else system
    for to, source in connections.items():
        (start, output), (end, given) = _found(variables, source), _found(variables, to)
        check_wire(to, variables[end][given], source)
        if variables[start][output].causality != "output":
            raise CouplingError(f"{source} is not an output: connect {to} to an output")
        check_types(to, variables[end][given], source, variables[start][output])
        _add(wires, SSD, "Connection", startElement=start, startConnector=output,
             endElement=end, endConnector=given)  # fmt: skip
    _enumerations(root, variables)
    _add(root, SSD, "DefaultExperiment", startTime="0.0", stopTime=repr(float(stop_time)))
    contents = {DESCRIPTION: _text(root)}
    contents |= {f"resources/{name}.fmu": Path(fmu).read_bytes() for name, fmu in fmus.items()}
    package = io.BytesIO()
    with zipfile.ZipFile(package, "w") as archive:
        for name, content in contents.items():
            method = zipfile.ZIP_DEFLATED if name == DESCRIPTION else zipfile.ZIP_STORED
            archive.writestr(zipfile.ZipInfo(name, EPOCH), content, method)
    write(path, package.getvalue())


def _add(parent: ET.Element, space: str, tag: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, f"{{{space}}}{tag}", attributes)


def _text(root: ET.Element) -> bytes:
    for prefix, space in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV)):
        ET.register_namespace(prefix, space)
    ET.indent(root)
    result = io.BytesIO()
    ET.ElementTree(root).write(result, encoding="UTF-8", xml_declaration=True)
    return result.getvalue() + b"\n"


def _found(variables: Mapping[str, Mapping[str, Any]], full: str) -> tuple[str, str]:
    """Return instance and variable of ``name.variable``."""
    name, _, variable = full.partition(".")
    if variable not in variables.get(name, {}):
        raise CouplingError(f"{full}: unknown variable; write INSTANCE.VARIABLE")
    return name, variable


def _component(
    elements: ET.Element,
    name: str,
    variables: Mapping[str, Any],
    connections: Mapping[str, str],
    values: Mapping[str, Value],
) -> None:
    """Add an instance with its connectors and start values to the description."""
    component = _add(
        elements, SSD, "Component", name=name, source=quote(f"resources/{name}.fmu"),
        type="application/x-fmu-sharedlibrary", implementation="CoSimulation",
    )  # fmt: skip
    wired = {*connections, *connections.values()}
    ends = [
        x for x in variables.values()
        if x.causality in ("input", "output") and (x.type in KINDS or f"{name}.{x.name}" in wired)
    ]  # fmt: skip
    connectors = _add(component, SSD, "Connectors") if ends else component
    for x in ends:
        connector = _add(connectors, SSD, "Connector", name=x.name, kind=x.causality)
        kind = _kind(f"{name}.{x.name}", x)
        _add(connector, SSC, kind, **_enumeration(name, x) if kind == "Enumeration" else {})
    own = {x.partition(".")[2]: value for x, value in values.items() if x.startswith(f"{name}.")}
    if not own:
        return
    binding = _add(_add(component, SSD, "ParameterBindings"), SSD, "ParameterBinding")
    inside = _add(binding, SSD, "ParameterValues")
    parameters = _add(
        _add(inside, SSV, "ParameterSet", version="1.0", name=name), SSV, "Parameters"
    )
    for variable, value in own.items():
        full = f"{name}.{variable}"
        known = variables[_found({name: variables}, full)[1]]
        kind = _kind(full, known)
        parameter = _add(parameters, SSV, "Parameter", name=variable)
        _add(parameter, SSV, kind, value=_text_of(full, kind, value, known))


def _kind(full: str, variable: Any) -> str:
    if variable.type not in KINDS:
        raise CouplingError(f"{full}: SSP 1.0 has no counterpart of its type {variable.type}")
    return KINDS[variable.type]


def _text_of(full: str, kind: str, value: Any, variable: Any) -> str:
    """Return a start value as text; that of an enumeration is the name of its item."""
    if kind == "Enumeration":
        items = items_of(variable)
        if value not in items:
            raise CouplingError(f"{full} = {value} must be one of {', '.join(map(str, items))}")
        return items[value]
    if kind == "Boolean":
        return "true" if value else "false"
    if kind == "String":
        return str(value)
    if kind == "Integer":
        return str(int(value))
    if not math.isfinite(value):
        raise CouplingError(f"{full} = {value} must be finite in a package")
    return repr(float(value))


def _enumeration(name: str, variable: Any) -> dict[str, str]:
    """Return the name of an enumeration; FMUs may have different ones of one name."""
    return {"name": f"{name}.{variable.declaredType.name}"}


def _enumerations(root: ET.Element, variables: Mapping[str, Mapping[str, Any]]) -> None:
    """Add the enumerations of all inputs and outputs to the description."""
    found = {
        _enumeration(name, x)["name"]: items_of(x)
        for name, some in variables.items()
        for x in some.values()
        if x.type == "Enumeration" and x.causality in ("input", "output")
    }
    parent = _add(root, SSD, "Enumerations") if found else root
    for name, items in found.items():
        element = _add(parent, SSC, "Enumeration", name=name)
        for value, item in items.items():
            _add(element, SSC, "Item", name=item, value=str(value))


def simulate(
    path: str | Path,
    stop_time: float | None = None,
    step: float | None = None,
    progress: Progress | None = None,
    note: Callable[[str], None] | None = None,
) -> Columns:
    """Simulate a package, from the start values in the package.

    Parameters
    ----------
    path : str or Path
        A package of SSP 1.0 with FMUs for co-simulation, of FMI 2.0 or 3.0.
    stop_time : float or None
        Duration [s]; None: that of the package.
    step : float or None
        Communication step [s]; None: a thousandth of the duration.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.
    note : callable or None
        Called with a sentence about each start value that matches no variable.  The standard
        ignores such values.

    Returns
    -------
    structured array
        ``time``, the outputs of the system by name, and the outputs of all components,
        ``system.component.variable``, one row per communication point.

    Notes
    -----
    The coupling scheme is Jacobi's, without event mode.

    Raises
    ------
    CouplingError
        If the package cannot be read, contains something that is not supported, has no stop time,
        or an FMU fails or ends the simulation; ``columns`` of the error are the rows before.
    ParameterError
        If ``stop_time`` or ``step`` is not positive and finite.
    """
    with tempfile.TemporaryDirectory(prefix="prbm_ssp_") as folder:
        package = Package(path, folder)
        flat = package.flat
        if note is not None:
            for name in dict.fromkeys(flat.ignored):
                note(f"the start value {name} is ignored: no variable has this name")
        stop = flat.stop_time if stop_time is None else stop_time
        if stop is None:
            raise CouplingError(f"{path}: the package has no stop time; give one")
        sources = [source for source, _ in (*flat.wires.values(), *flat.outputs.values())]
        try:
            columns = cosimulation.simulate(
                {name: package.copies[file] for name, file in flat.fmus.items()},
                {to: source for to, (source, _) in flat.wires.items()},
                stop,
                stop / 1000 if step is None else step,
                flat.values,
                list(dict.fromkeys([*sources, *flat.recorded])),
                cosimulation.JACOBI,
                progress=progress,
                functions={to: signal for to, (_, signal) in flat.wires.items() if signal.steps},
            )
        except CouplingError as error:
            if error.columns is not None:
                error.columns = _named(error.columns, flat)
            raise
    return _named(columns, flat)


def _named(columns: Columns, flat: Flat) -> Columns:
    """Return a result with the names of the package, and the outputs of the system first."""
    found = {"time": columns["time"]}
    for name, (source, signal) in flat.outputs.items():
        found[name] = np.array([signal(x) for x in columns[source].tolist()])
    for name in (columns.dtype.names or ())[1:]:
        found[column(name)] = columns[name]
    result = np.empty(len(columns), [(name, x.dtype) for name, x in found.items()])
    for name, x in found.items():
        result[name] = x
    return result
