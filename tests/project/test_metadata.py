"""The metadata of the package, its citation, and the settings of editors agree with the project."""

import configparser
import re
import runpy
import subprocess
import sys
import tomllib

import pytest
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


@pytest.mark.parametrize("address", ["", "https://example.org/group/prbm"])
def test_the_readme_of_the_package_has_no_link_to_a_file_beside_it(address):
    """Package registries show it without the files of the repository."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = runpy.run_path(str(ROOT / "hatch_build.py"))["rendered"](text, address)
    found = re.findall(r"\]\(([^)]*)\)", shown)
    assert found
    assert not [link for link in found if not link.startswith("https://")]
    beside = {file.split("#")[0] for file in re.findall(r"\]\((?!https?:|#)([^)]*)\)", text)}
    linked = {file for file in beside if f"{address}/blob/main/{file}" in shown}
    pictures = {file for file in beside if f"{address}/raw/main/{file}" in shown}
    assert (linked | pictures == beside) if address else not linked | pictures
    assert shown.count("```") == text.count("```")


def test_the_conda_recipe_has_the_requirements_of_the_package():
    recipe = yaml.safe_load((ROOT / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == PROJECT["version"]
    own = {r.replace(" ", "").replace("matplotlib-base", "matplotlib")
           for r in recipe["requirements"]["run"]}  # fmt: skip
    assert own == {*PROJECT["dependencies"], f"python{PROJECT['requires-python']}"}
    commands = {f"{name} = {target}" for name, target in PROJECT["scripts"].items()}
    assert set(recipe["build"]["python"]["entry_points"]) == commands
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]
    host = {requirement.replace(" ", "") for requirement in recipe["requirements"]["host"]}
    assert set(build["requires"]) <= host
    for key, name in (("summary", "description"), ("license", "license")):
        assert recipe["about"][key] == PROJECT[name]


@pytest.mark.parametrize(
    ("schema", "files"),
    [
        ("github-issue-forms", ["fault.yml", "mechanism.yml"]),
        ("github-issue-config", ["config.yml"]),
    ],
)
def test_the_forms_of_issues_are_valid(schema, files):
    folder = ROOT / ".github" / "ISSUE_TEMPLATE"
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{schema}"]
    subprocess.run([*command, *(folder / file for file in files)], check=True)


def packages(extra: str) -> set[str]:
    """Return the import names of the packages of an extra."""
    found = set()
    for text in PROJECT["optional-dependencies"][extra]:
        name, _, others = re.match(r"([\w-]+)(\[(.*?)\])?", text).groups(default="")
        if name == PROJECT["name"]:
            found |= set().union(*map(packages, others.split(",")))
        else:
            found.add(name.replace("-", "_"))
    return found


@pytest.mark.slow
def test_the_documented_modules_need_no_package_of_another_extra():
    """``pip install ".[docs]" && python docs/build_site.py`` imports them."""
    pages = (ROOT / "docs" / "website" / "api").glob("*.rst")
    text = "\n".join(path.read_text(encoding="utf-8") for path in pages)
    names = sorted({*re.findall(r"^\.\. auto\w+:: (prbm[\w.]*)", text, re.MULTILINE)})
    assert len(names) > 80
    extras = PROJECT["optional-dependencies"].keys() - {"docs", "test"}
    missing = set().union(*map(packages, extras)) - packages("docs")
    script = (
        "import pkgutil, sys; "
        f"sys.modules.update(dict.fromkeys({sorted(missing)})); "
        f"[pkgutil.resolve_name(name) for name in {names}]"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT / "fmu_src", capture_output=True, text=True,
        encoding="utf-8", check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-1000:]
