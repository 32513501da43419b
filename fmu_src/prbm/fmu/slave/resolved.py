"""A mechanism and its interface as JSON data, which the FMU reads at its first instantiation."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ...mechanism.description import Mechanism
from ...mechanism.parameters import Parameter
from ...mechanism.parts import (
    Body,
    Flexure,
    FlexureType,
    Force,
    Friction,
    GroundPart,
    Guide,
    Joint,
    Probe,
    Release,
    Spring,
    Stop,
)

FILE = "model.json"
PARTS: dict[str, Callable[..., Any]] = {
    "bodies": Body,
    "flexure_types": FlexureType,
    "flexures": Flexure,
    "joints": Joint,
    "springs": Spring,
    "guides": Guide,
    "stops": Stop,
    "frictions": Friction,
    "forces": Force,
    "probes": Probe,
    "geometry": Parameter,
    "ground_parts": GroundPart,
}
EMPTY: dict[str, Any] = {"Real": float("nan"), "Integer": 0, "Boolean": False, "String": ""}


@dataclass(frozen=True)
class Model:
    """The mechanism and the variables of an FMU.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    names : dict of int to str
        Variables by value reference.
    types : dict of str to str
        Types of FMI by variable name.
    given : dict of str to float
        Start values of the parameters and inputs.
    parameters : dict of str to Parameter
        The parameters, with bounds and units.
    computed : dict of str to number
        All other variables, with their values when there is no simulation: NaN, 0 or False.
    step : float
        Communication step of the default experiment [s]; 0: not known.
    """

    mechanism: Mechanism
    names: Mapping[int, str]
    types: Mapping[str, str]
    given: Mapping[str, float]
    parameters: Mapping[str, Parameter]
    computed: Mapping[str, float | int | bool]
    step: float


def resolved(mechanism: Mechanism, variables: Iterable[Any], step: float = 0.0) -> dict[str, Any]:
    """Return a mechanism, its variables and its step as values that JSON preserves exactly."""
    kept = ("name", "reference", "type", "start")
    table = [{key: getattr(variable, key) for key in kept} for variable in variables]
    return {"mechanism": asdict(mechanism), "variables": table, "step": step}


def read(folder: str | Path) -> Model:
    """Read the model from the resources of an FMU.

    Parameters
    ----------
    folder : str or Path
        The ``resources`` of the unpacked FMU.
    """
    with open(Path(folder) / FILE, encoding="utf-8") as file:
        data = json.load(file)
    mechanism = mechanism_from(data["mechanism"])
    table = data["variables"]
    return Model(
        mechanism,
        {v["reference"]: v["name"] for v in table},
        {v["name"]: v["type"] for v in table},
        {v["name"]: v["start"] for v in table if v["start"] is not None},
        {p.name: p for p in mechanism.parameters},
        {v["name"]: EMPTY[v["type"]] for v in table if v["start"] is None},
        data["step"],
    )


def mechanism_from(data: Mapping[str, Any]) -> Mechanism:
    """Return a mechanism from its data, the inverse of :func:`resolved`."""
    parts: dict[str, Any] = {}
    for key, value in _tuples(data).items():
        if key in PARTS:
            parts[key] = tuple(PARTS[key](**part) for part in value)
        elif key == "release":
            parts[key] = Release(**value)
        else:
            parts[key] = value
    return Mechanism(**parts)


def _tuples(value: Any) -> Any:
    """Return JSON data with lists converted to tuples, as in the frozen classes."""
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    if isinstance(value, list):
        return tuple(_tuples(item) for item in value)
    return value
