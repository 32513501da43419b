"""System structure packages (SSP 1.0): FMUs, their connections and start values in one file.

Co-simulation masters read such packages.  :func:`simulate` runs one with FMPy's master.
"""

import io
import zipfile
from collections.abc import Iterable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn
from xml.etree import ElementTree as ET

import numpy as np

from ..runs.result import Columns
from ..runs.run import communication_points
from .components import CouplingError, Value, check_wire, described, start_value

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
DESCRIPTION = "SystemStructure.ssd"
EPOCH = (
    1980,
    1,
    1,
    0,
    0,
    0,
)  # Date of all files: equal systems give equal bytes.
KINDS = {"Real": "Real", "Float64": "Real", "Integer": "Integer", "Int32": "Integer",
         "Boolean": "Boolean"}  # fmt: skip
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
        If an FMU cannot be read, a name is unknown, a variable has the wrong causality, or a type
        has no counterpart in SSP.
    """
    path, values = Path(path), dict(values or {})
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
        _add(wires, SSD, "Connection", startElement=start, startConnector=output,
             endElement=end, endConnector=given)  # fmt: skip
    _add(root, SSD, "DefaultExperiment", startTime="0.0", stopTime=repr(float(stop_time)))
    contents = {DESCRIPTION: _text(root)}
    contents |= {f"resources/{name}.fmu": Path(fmu).read_bytes() for name, fmu in fmus.items()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            method = zipfile.ZIP_DEFLATED if name == DESCRIPTION else zipfile.ZIP_STORED
            archive.writestr(zipfile.ZipInfo(name, EPOCH), content, method)


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
        elements, SSD, "Component", name=name, source=f"resources/{name}.fmu",
        type="application/x-fmu-sharedlibrary", implementation="CoSimulation",
    )  # fmt: skip
    ends = [*((to, "input") for to in connections), *((x, "output") for x in connections.values())]
    mine = [end for end in dict.fromkeys(ends) if end[0].partition(".")[0] == name]
    connectors = _add(component, SSD, "Connectors") if mine else component
    for full, kind in mine:
        variable = _found({name: variables}, full)[1]
        connector = _add(connectors, SSD, "Connector", name=variable, kind=kind)
        _add(connector, SSC, _kind(full, variables[variable]))
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
        kind = _kind(full, variables[_found({name: variables}, full)[1]])
        parameter = _add(parameters, SSV, "Parameter", name=variable)
        _add(parameter, SSV, kind, value=_number(kind, value))


def _kind(full: str, variable: Any) -> str:
    if variable.type not in KINDS:
        raise CouplingError(f"{full}: SSP 1.0 has no counterpart of its type {variable.type}")
    return KINDS[variable.type]


def _number(kind: str, value: Value) -> str:
    if kind == "Boolean":
        return "true" if value else "false"
    return str(int(value)) if kind == "Integer" else repr(float(value))


def simulate(path: str | Path, stop_time: float, step: float) -> Columns:
    """Simulate a package with FMPy's master, from the start values in the package.

    Parameters
    ----------
    path : str or Path
        A package of FMUs of FMI 2.0; FMPy's master does not support FMI 3.0.
    stop_time, step : float
        Duration, a multiple of the step, and communication step [s].

    Returns
    -------
    structured array
        ``time`` and the connected variables, ``name.variable``, one row at the end of each step.
        The value of an input is the one that acts in the next step.

    Notes
    -----
    The coupling scheme is Jacobi's.  In the first step all connected inputs are zero.

    Raises
    ------
    CouplingError
        If the package cannot be read or FMPy cannot simulate it.
    ParameterError
        If ``stop_time`` or ``step`` is not positive and finite.
    """
    from fmpy.ssp.simulation import simulate_ssp  # type: ignore[import-untyped]
    from fmpy.ssp.ssd import ParameterSet, find_components, read_ssd  # type: ignore[import-untyped]

    times = communication_points(stop_time, step)
    if times[-1] - times[-2] < (1 - 1e-6) * step:  # shorter than a step by more than rounding
        raise CouplingError(
            f"stop_time = {stop_time:g} s: FMPy needs a multiple of step = {step:g} s"
        )
    try:
        description = read_ssd(str(path))
    except Exception as error:
        _fail(path, error)
    components = find_components(description.system)
    _check_names(component.name for component in components)
    every = ParameterSet(name="start values")
    for component in components:
        for binding in component.parameterBindings:
            for parameters in binding.parameterValues:
                for parameter in parameters.parameters:
                    parameter.name = f"{component.name}.{parameter.name}"
                    if parameter.type == "Boolean":  # FMPy reads any text as true, "false" too.
                        parameter.value = parameter.value in ("true", "1")
                    every.parameters.append(parameter)
    # The end is half a step early: FMPy sums its steps, and rounding could add another step.
    end = times[-2] + step / 2
    try:
        result: Columns = simulate_ssp(
            str(path), stop_time=end, step_size=step, parameter_set=every
        )
    except Exception as error:
        _fail(path, error)
    # FMPy records the time at the start of a step; return the time at its end.
    result["time"] = np.minimum(result["time"] + step, stop_time)
    return result


def _check_names(names: Iterable[str]) -> None:
    """Reject names of which one begins with another: FMPy would mix up their start values."""
    for one, other in pairwise(sorted(names)):
        if other.startswith(one):
            raise CouplingError(
                f"instances {one} and {other}: FMPy would apply start values of {other} to {one}; "
                "rename one so that no name begins with another"
            )


def _fail(path: str | Path, error: Exception) -> NoReturn:
    """Raise the error of FMPy as a :class:`CouplingError`."""
    raise CouplingError(f"{path}: FMPy cannot simulate it ({error})") from None
