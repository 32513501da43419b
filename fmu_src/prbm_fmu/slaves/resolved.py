"""A mechanism and its interface as plain data, read back where the FMU runs."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

FILE = "model.json"
PARTS = {
    "bodies": "Body",
    "flexure_types": "FlexureType",
    "flexures": "Flexure",
    "joints": "Joint",
    "stops": "Stop",
    "frictions": "Friction",
    "forces": "Force",
    "probes": "Probe",
    "geometry": "Parameter",
}
EMPTY: dict[str, Any] = {"Real": float("nan"), "Integer": 0, "Boolean": False, "String": ""}


@dataclass(frozen=True)
class Model:
    """What an FMU is made of.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism, of the engine's own class.
    names : dict of int to str
        Variables by value reference.
    types : dict of str to str
        Their types in FMI.
    given : dict of str to float
        Start values of the parameters and inputs.
    parameters : dict of str to Parameter
        Their bounds and units.
    computed : dict of str to number
        All other variables, with what stands for "no value".
    """

    mechanism: Any
    names: Mapping[int, str]
    types: Mapping[str, str]
    given: Mapping[str, float]
    parameters: Mapping[str, Any]
    computed: Mapping[str, float | int | bool]


def resolved(mechanism: Any, variables: Iterable[Any]) -> dict[str, Any]:
    """Return a mechanism and its variables as values that JSON keeps exactly."""
    kept = ("name", "reference", "type", "start")
    table = [{key: getattr(variable, key) for key in kept} for variable in variables]
    return {"mechanism": asdict(mechanism), "variables": table}


def read(folder: str | Path, engine: Any) -> Model:
    """Read the model from the resources of an FMU.

    Parameters
    ----------
    folder : str or Path
        The ``resources`` of the unpacked FMU.
    engine : module
        The package whose classes the mechanism is made of.
    """
    with open(Path(folder) / FILE, encoding="utf-8") as file:
        data = json.load(file)
    mechanism = mechanism_from(data["mechanism"], engine)
    table = data["variables"]
    return Model(
        mechanism,
        {v["reference"]: v["name"] for v in table},
        {v["name"]: v["type"] for v in table},
        {v["name"]: v["start"] for v in table if v["start"] is not None},
        {p.name: p for p in mechanism.parameters},
        {v["name"]: EMPTY[v["type"]] for v in table if v["start"] is None},
    )


def mechanism_from(data: Mapping[str, Any], engine: Any) -> Any:
    """Return the mechanism that :func:`resolved` took apart."""
    parts = {}
    for key, value in _tuples(data).items():
        if key in PARTS:
            kind = getattr(engine, PARTS[key])
            parts[key] = tuple(kind(**part) for part in value)
        elif key == "release":
            parts[key] = engine.Release(**value)
        else:
            parts[key] = value
    return engine.Mechanism(**parts)


def _tuples(value: Any) -> Any:
    """Return JSON data with tuples for lists, as the frozen classes have them."""
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    if isinstance(value, list):
        return tuple(_tuples(item) for item in value)
    return value
