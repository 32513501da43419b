"""The public names of the package, and the modules that they import."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import prbm

ROOT = Path(__file__).parents[2]
PUBLIC = [
    "EquilibriumError",
    "Mechanism",
    "MechanismError",
    "ParameterError",
    "PrbmError",
    "Result",
    "ResultError",
    "Simulation",
    "SimulationError",
    "UnknownColumnError",
    "__version__",
    "equilibrium",
    "holding_curve",
    "linearize",
    "load",
    "modes",
    "read_drawing",
    "register_model",
    "simulate",
    "study",
]
THIRD_PARTY = ("numpy", "scipy", "matplotlib", "pydantic", "pint", "fmpy")


def in_new_process(script: str) -> str:
    paths = [str(ROOT / "fmu_src")]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {paths!r}\n{script}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout


def test_importing_the_package_imports_nothing_else():
    script = "import prbm; print(*(name for name in sys.modules if name.startswith('prbm')))"
    assert in_new_process(script).split() == ["prbm"]
    script = f"import prbm; prbm.__version__; print(*({{*sys.modules}} & {{*{THIRD_PARTY!r}}}))"
    assert in_new_process(script).split() == []


@pytest.mark.slow
def test_simulation_from_python_imports_no_matplotlib_and_mechanisms_need_no_pydantic():
    script = "import prbm; prbm.Simulation; prbm.Mechanism; prbm.Result; prbm.simulate"
    script += "; print(*({*sys.modules} & {'matplotlib', 'pydantic', 'pint', 'fmpy'}))"
    assert in_new_process(script).split() == []


@pytest.mark.slow
def test_a_star_import_imports_the_public_names():
    script = "from prbm import *; print(*sorted({*dir()} & {*" + repr(PUBLIC) + "}))"
    assert in_new_process(script).split() == sorted(PUBLIC)
    assert sorted(prbm.__all__) == sorted(PUBLIC)
    assert {*PUBLIC} <= {*dir(prbm)}


def test_an_unknown_public_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'simulation'"):
        prbm.simulation  # noqa: B018


def test_the_version_is_the_one_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert prbm.__version__ == project["version"]


def test_load_takes_a_shipped_name_or_a_path():
    path = ROOT / "fmu_src" / "prbm" / "shipped" / "PRBDM.toml"
    guide = prbm.load("PRBDM")
    assert isinstance(guide, prbm.Mechanism)
    assert prbm.load(path) == prbm.load(str(path)) == guide


def test_load_proposes_the_nearest_names():
    with pytest.raises(ValueError, match=r"unknown mechanism 'Bistabel'.*; did you mean Bistable"):
        prbm.load("Bistabel")


@pytest.mark.parametrize("start", [prbm.simulate, prbm.Simulation])
def test_a_name_in_place_of_a_mechanism_is_rejected_with_a_remedy(start):
    with pytest.raises(TypeError, match="'PRBDM' must be a Mechanism"):
        start("PRBDM")


def test_simulate_takes_the_default_experiment_by_default():
    """The guides have one second in steps of a millisecond; the last step may be shorter."""
    result = prbm.simulate(prbm.load("PRBDM"), {"stop.restitution": 0.0})
    assert isinstance(result, prbm.Result)
    assert result["time"][-1] == 1.0
    assert len(result["time"]) == 1001
    short = prbm.simulate(prbm.load("PRBDM"), stop_time=0.0025)
    assert short["time"].tolist() == pytest.approx([0.0, 1e-3, 2e-3, 2.5e-3], abs=1e-15)


def test_load_rejects_a_folder(tmp_path):
    with pytest.raises(ValueError, match="is a folder"):
        prbm.load(tmp_path)


def test_only_public_names_are_listed():
    assert {name for name in dir(prbm) if not name.startswith("__")} == {*PUBLIC} - {"__version__"}


def test_every_error_of_the_package_is_a_public_error():
    """A caller of the public functions can catch each kind by a public name."""
    from prbm.base import errors

    named = {x for x in vars(errors).values() if isinstance(x, type) and issubclass(x, Exception)}
    assert named == {getattr(prbm, x.__name__) for x in named}
    assert issubclass(prbm.ResultError, prbm.PrbmError)
    with pytest.raises(prbm.UnknownColumnError):
        prbm.simulate(prbm.load("PRBDM"), stop_time=1e-3)["shuttel.x"]


def test_the_types_of_the_package_are_those_of_its_annotations():
    """PEP 561: type checkers ignore the annotations of an installed package without this file."""
    assert (Path(prbm.__file__).parent / "py.typed").is_file()
