"""The metadata of the package, its citation, and the settings of editors agree with the project."""

import configparser
import tomllib

import yaml

import prbm
from support import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_citation_describes_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == PROJECT["version"] == prbm.__version__
    for key, name in (("title", "name"), ("abstract", "description"), ("license", "license")):
        assert citation[key] == PROJECT[name]
    assert citation["authors"] == PROJECT["authors"]
    assert set(citation["keywords"]) == set(PROJECT["keywords"])
    holder = (ROOT / "LICENSE").read_text(encoding="utf-8").splitlines()[2]
    assert holder.endswith(citation["authors"][0]["name"])


def test_the_classifiers_name_the_least_python_version_and_the_types():
    versions = [c.rpartition(" ")[2] for c in PROJECT["classifiers"] if ":: Python :: 3." in c]
    assert PROJECT["requires-python"] == f">={versions[0]}"
    assert ("Typing :: Typed" in PROJECT["classifiers"]) == (
        ROOT / "fmu_src" / "prbm" / "py.typed"
    ).is_file()


def test_the_hooks_are_the_linters_of_the_contribution_guide():
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    entries = [hook["entry"] for repo in hooks["repos"] for hook in repo["hooks"]]
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    block = next(part for part in guide.split("```sh\n") if part.startswith("ruff check"))
    for entry in entries:
        assert f"\n{entry}" in f"\n{block}"


def test_source_files_obey_the_settings_of_editors():
    settings = configparser.ConfigParser()
    settings.read_string(
        "[root]\n" + (ROOT / ".editorconfig").read_text(encoding="utf-8"), "editorconfig"
    )
    every = settings["*"]
    ruff = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]
    assert every.getint("max_line_length") == ruff["line-length"]
    kinds = {".py", ".c", ".h", ".toml", ".md"}
    for path in (p for part in ("fmu_src", "tests", "docs") for p in (ROOT / part).rglob("*")):
        if path.suffix not in kinds:
            continue
        text = path.read_bytes().decode("utf-8")
        assert not text or text.endswith("\n"), path
        assert not [line for line in text.split("\n") if line != line.rstrip()], path
        assert "\t" not in text, path
