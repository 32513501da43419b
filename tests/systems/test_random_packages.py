"""Random packages mean what an independent reader of the standard finds, or are refused."""

import collections
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest

from coupled import integrator
from package_meaning import Meaning, Undefined
from prbm.systems import components, cosimulation, ssp, structure
from prbm.systems.components import CouplingError
from prbm.systems.cosimulation import JACOBI
from prbm.systems.structure import Package
from random_packages import ITEMS, Variable, random_package


@pytest.fixture(autouse=True)
def read_once(monkeypatch):
    """Read the description of each FMU once: FMPy validates it anew each time."""
    known = {}

    def described(name, path):
        key = Path(path).read_bytes()
        if key not in known:
            known[key] = components.described(name, path)
        return known[key]

    monkeypatch.setattr(structure, "described", described)


PROBES = {
    "Real": (1.25, -3.0), "Integer": (1, 2, 3, 4), "Boolean": (True, False),
    "Enumeration": tuple({x for items in ITEMS.values() for x in items.values()}),
}  # fmt: skip
"""Values of sources by type; some are not in the tables of transformations."""


def outcome(function, value):
    """Return the value of a function, or None if it has none."""
    try:
        return function(value)
    except (CouplingError, Undefined, KeyError, TypeError):
        return None


def flat_and_meaning(folder, seed):
    """Return both meanings, or the reason of the refusal as text."""
    path = Path(folder) / "x.ssp"
    fault = random_package(path, seed)
    with tempfile.TemporaryDirectory(dir=folder) as copies:
        try:
            flat = Package(path, copies).flat
        except CouplingError as error:
            return str(error).removeprefix(f"{path}: ")
    assert fault is None, f"{seed}: {fault} is not refused"
    return flat, Meaning(path)


def differences(flat, expected):
    """Yield what differs in two meanings."""
    if flat.values.keys() != expected.values.keys():
        yield "start values", sorted(flat.values.keys() ^ expected.values.keys())
    for name in flat.values.keys() & expected.values.keys():
        one, other = flat.values[name], expected.values[name]
        if one != (
            other if isinstance(other, str) else pytest.approx(float(other), rel=1e-11, abs=1e-10)
        ):
            yield name, one, other
    links = {**flat.wires, **flat.outputs}
    if links.keys() != expected.links.keys():
        yield "connections", sorted(links.keys() ^ expected.links.keys())
    for name in links.keys() & expected.links.keys():
        (source, one), (origin, other, kind) = links[name], expected.links[name]
        if source != origin:
            yield name, source, origin
        for probe in PROBES[kind]:
            found = outcome(one, probe), outcome(other, probe)
            if (None in found and found[0] != found[1]) or (
                None not in found
                and found[0] != pytest.approx(float(found[1]), rel=1e-11, abs=1e-10)
            ):
                yield name, probe, *found


def check(folder, seeds):
    """Check packages; return the numbers of equal and of refused ones."""
    counts = collections.Counter()
    for seed in seeds:
        found = flat_and_meaning(folder, seed)
        counts["refused" if isinstance(found, str) else "equal"] += 1
        if not isinstance(found, str):
            assert not list(differences(*found)), seed
    return counts


def test_random_packages_mean_what_the_standard_says(tmp_path):
    counts = check(tmp_path, range(100))
    assert counts["equal"] >= 40


def test_comments_and_processing_instructions_have_no_effect(tmp_path):
    """They may be between any two elements, of the description and of the sets and mappings."""
    plain, noted = tmp_path / "plain.ssp", tmp_path / "noted.ssp"
    equal = 0
    for seed in range(20):
        random_package(plain, seed)
        with zipfile.ZipFile(plain) as source, zipfile.ZipFile(noted, "w") as copy:
            for name in source.namelist():
                content = source.read(name)
                if not name.endswith(".fmu"):
                    content = content.replace(b">", b"><!-- note --><?tool note?>")
                copy.writestr(name, content)
        found = []
        for path in (plain, noted):
            with tempfile.TemporaryDirectory(dir=tmp_path) as copies:
                try:
                    found.append(Package(path, copies).flat)
                except CouplingError as error:
                    found.append(str(error).removeprefix(str(path)))
        assert found[0] == found[1]
        equal += not isinstance(found[0], str)
    assert equal >= 8


@pytest.mark.slow
def test_many_random_packages_mean_what_the_standard_says(tmp_path):
    counts = check(tmp_path, range(100, 2000))
    assert counts["equal"] >= 800


INTEGRATOR = (
    *(Variable(x, "parameter", "Real") for x in ("gain", "start", "feedthrough")),
    Variable("skipped", "parameter", "Integer"), Variable("off", "parameter", "Boolean"),
    Variable("rate", "input", "Real"), Variable("value", "output", "Real"),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.usefixtures("plain_temporary_folder")
def test_random_packages_move_as_their_meaning(tmp_path):
    """The master, given the meaning by the independent reader, computes the same outputs."""
    path, equal = tmp_path / "x.ssp", 0
    fmus = {"sum": (integrator().read_bytes(), INTEGRATOR)}
    for seed in range(24):
        random_package(path, seed, fmus)
        try:
            found = ssp.simulate(path, step=0.125)
        except CouplingError:
            continue
        meaning = Meaning(path)
        links = {to: link for to, link in meaning.links.items() if "." in to}
        instances = [x.path for x in meaning.top.below() if x.fmu]
        wires = {to: source for to, (source, *_) in links.items()}
        functions = {to: lambda x, f=own: float(f(x)) for to, (_, own, _) in links.items()}
        shown, partners = [f"{x}.value" for x in instances], dict.fromkeys(instances, integrator())
        expected = cosimulation.simulate(
            partners, wires, 0.5, 0.125, meaning.values, shown, JACOBI, functions=functions
        )
        equal += 1
        for name in found.dtype.names[1:]:
            end = name.rpartition(".")[0].replace(".", "/")
            if end:
                wanted = expected[f"{end}.value"]
            else:
                source, function, _ = meaning.links[name]
                wanted = [float(function(x)) for x in expected[source].tolist()]
            np.testing.assert_allclose(found[name], wanted, rtol=1e-9, atol=1e-9)
    assert equal >= 8
