"""The functions of the API reference reject arguments of a wrong type by name."""

import importlib
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

import prbm
from prbm.analysis.fit import Frequency
from prbm.base.arguments import check
from prbm.base.errors import ArgumentError, ParameterError, PrbmError
from prbm.data.measurement import Beam
from prbm.data.series import Series
from prbm.data.uncertainty import Estimate
from prbm.references.scalar_guide import Monolith, ScalarGuide
from prbm.sweeps.study import study
from prbm.systems.cosimulation import System
from prbm.systems.model_exchange import OneSolver

REFERENCE = Path(__file__).parents[2] / "docs" / "website" / "api"
GUIDE = prbm.load("PRBDM")
ONE = Estimate(1.0, 0.1)
TIMES = np.arange(16.0)
PARTS = ("name", "title", "ground", "bodies", "flexures", "flexure_types", "release", "stops")
OBJECTS = [
    (Estimate, {"value": 1.0, "uncertainty": 0.1, "unit": "m", "freedom": 3.0}),
    (Beam, {"name": "b", "length": ONE, "width": ONE, "thickness": Estimate(0.1, 0.0)}),
    (Frequency, {"frequency": ONE, "mode": 1, "displacement": 0.0}),
    (Series, {"time": TIMES, "values": TIMES, "name": "x", "unit": "m"}),
    (ScalarGuide, {"r": 1.0, "k": 1.0, "mass": 1.0, "stops": (0.0,)}),
    (Monolith, {"guide": ScalarGuide(1.0, 1.0, 1.0), "force": lambda t, x, v, z: 0.0, "z": ()}),
    (System, {"fmus": {}, "connections": {}, "scheme": "jacobi", "watched": []}),
    (OneSolver, {"partner": lambda t, outputs, z: ({}, ()), "z": (), "max_step": 1.0}),
    (prbm.Mechanism, {name: getattr(GUIDE, name) for name in PARTS}),
]  # fmt: skip


def documented():
    for page in sorted(REFERENCE.glob("*.rst")):
        for path in re.findall(r"autofunction:: (\S+)", page.read_text()):
            module, _, name = path.rpartition(".")
            function = getattr(importlib.import_module(module), name)
            for argument, parameter in inspect.signature(function).parameters.items():
                if not isinstance(parameter.annotation, str):
                    yield function, argument


def methods():
    result = prbm.simulate(GUIDE, stop_time=0.002)
    yield from ((result.__getitem__, "name"), (result.quantity, "name"), (GUIDE.values, "changes"))
    yield from ((result.animate, name) for name in ("slow", "fps", "start", "stop"))
    for engine in ("kernel", "python"):
        motion = prbm.Simulation(GUIDE, engine=engine)
        yield motion.set, "changes"
        yield motion.advance, "time"
        yield motion.check_effort, "step"
        yield lambda times, motion=motion: motion.sample(times, []), "times"
        yield lambda names, motion=motion: motion.sample([], names), "names"


def test_a_function_of_the_reference_names_an_argument_of_a_wrong_type():
    for function, argument in documented():
        with pytest.raises(ArgumentError, match=rf"^{argument} = <object .* must be "):
            function(**{argument: object()})


@pytest.mark.parametrize("wrong", [object(), [None], {None: 1.0}], ids=["object", "list", "dict"])
def test_a_method_of_results_and_simulations_names_an_argument_of_a_wrong_type(wrong):
    for function, argument in methods():
        with pytest.raises(ParameterError, match=rf"^({argument}\b|unknown variable None)"):
            function(**{argument: wrong})


@pytest.mark.parametrize(("kind", "fields"), OBJECTS, ids=lambda x: getattr(x, "__name__", ""))
def test_an_object_names_a_field_of_a_wrong_type(kind, fields):
    for name in fields:
        with pytest.raises(PrbmError, match=rf"^{name} = <object "):
            kind(**{**fields, name: object()})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"changes": ["stop.position"]}, r"changes = \['stop.position'\] must be a mapping, {"),
        ({"changes": {None: 1.0}}, "changes has the name None, which must be a text"),
        ({"changes": {"stop.position": [1.0]}}, r"stop.position = \[1.0\] must be a number in m$"),
        ({"changes": {"stop.position": 10**400}}, "stop.position = 10.* must be a number in m$"),
        ({"inputs": [("force.x", 1.0)]}, r"inputs = .* must be a mapping, {name: a text, a number"),
        ({"stop_time": np.ones(2)}, 'stop_time = .* must be a number in s, or a text, "1 s"$'),
        ({"steps_max": float("nan")}, "steps_max = nan must be positive"),
        ({"source": lambda t: [t]}, r"source\(0 s\) = \[0.0\] must be a mapping"),
        ({"engine": np.array(["kernel", "python"])}, "engine = .* must be a text"),
    ],
)  # fmt: skip
def test_a_simulation_names_the_argument_its_value_and_the_remedy(arguments, message):
    with pytest.raises(ParameterError, match=message):
        prbm.simulate(GUIDE, **{"stop_time": 0.002, **arguments})


def test_a_parameter_as_output_of_a_study_is_rejected():
    with pytest.raises(ParameterError, match=r"stop\.offset is a parameter; name an output"):
        study(GUIDE, {"stop.position": [0.0, 1e-3]}, ["max(stop.offset)"], workers=1)


@pytest.mark.parametrize(
    ("hint", "valid", "invalid"),
    [
        (float, [1, 1.5, np.float32(1), np.array(1.0)], [True, "1", 1j, np.complex128(1), [1.0]]),
        (int, [1, np.int64(1)], [1.0, True, "1"]),
        (bool, [True, np.True_], [1, "yes"]),
        (str | Path, ["x", Path("x")], [b"x", 1]),
        (Sequence[str], [["x"], ("x",), {"x": 1}.keys(), np.array(["x"])], ["x", [1], np.ones(1)]),
        (tuple[float, float], [(0, 1.0), [0.0, 1.0]], [(0.0,), (0.0, "1"), "01"]),
        (Mapping[str, str], [{}, {"a": "b"}], [{1: "b"}, {"a": 1}, [("a", "b")]]),
        (Callable[[float], float], [abs, float], [1.0, None]),
    ],
)  # fmt: skip
def test_a_check_accepts_all_forms_of_a_type(hint, valid, invalid):
    for value in valid:
        check("argument", value, hint)
    for value in invalid:
        with pytest.raises(ArgumentError, match="argument"):
            check("argument", value, hint)
