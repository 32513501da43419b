"""Maps of compliant stops: limits of stiff contacts, one coordinate, energy, full simulation."""

import shlex
from dataclasses import replace

import pytest

import compliant_hits as hits
from prbm.analysis.impact_map import algebraic, compliant, with_flexures
from prbm.base.errors import ParameterError
from prbm.commands import command_line as cli
from prbm.files.mechanism_file import shipped
from prbm.mechanism.parts import COMPLIANT
from support import mechanism

GUIDE = with_flexures(mechanism("PRBDM2R"), "2R", axial=True)
FREE = {"gravity.x": 0.0, "damping.beta": 0.0}


def test_stiff_contacts_have_the_map_of_rigid_impacts_in_proportion_to_the_duration():
    walls, offsets = (-5e-3, 0.0), (0.0, 4e-3)
    rigid = algebraic(GUIDE, walls, offsets, FREE).restitution
    errors = [
        abs(compliant(GUIDE, walls, offsets, FREE, stiffness=k).restitution - rigid).max()
        for k in (1e10, 1e12, 1e14)
    ]
    assert errors[2] < 1e-5
    assert errors[0] > 10 * errors[1] > 100 * errors[2]


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("restitution", [0.1, 0.6, 1.0])
def test_a_guide_of_one_coordinate_returns_with_the_restitution(exponent, restitution):
    one = with_flexures(mechanism("PRBDM"), "1R")
    stops = tuple(
        replace(s, law=COMPLIANT, stiffness=1e9, exponent=exponent, restitution=restitution)
        for s in one.stops
    )
    found = compliant(replace(one, stops=stops), [0.0], [0.0], FREE, speed=0.3)
    assert found.restitution.item() == pytest.approx(restitution, abs=1e-5)
    lost = found.hits[0][0].lost
    assert lost == pytest.approx(1.0 - restitution**2, abs=1e-5)


def test_the_restitution_of_a_linear_contact_does_not_depend_on_the_speed():
    found = [
        compliant(GUIDE, [0.0], [4e-3], FREE, stiffness=1e7, speed=speed).restitution.item()
        for speed in (1e-3, 1.0)
    ]
    assert found[0] == pytest.approx(found[1], abs=1e-7)


def test_an_elastic_contact_keeps_the_energy():
    changes = {**FREE, "stop.restitution": 1.0}
    ((hit,),) = compliant(GUIDE, [5e-3], [4e-3], changes, stiffness=1e7).hits
    assert hit.lost == pytest.approx(0.0, abs=1e-7)
    assert hit.after[1:].sum() > 1e-3


@pytest.mark.parametrize("stiffness", [1e6, 1e7, 6e7])
def test_linear_modes_agree_with_the_complete_simulation(stiffness):
    for damping in (0.0, 8e-6):
        changes = {**hits.UNDAMPED, "damping.beta": damping}
        simulated = hits.by_beams(3, stiffness, 4e-3, changes).restitution
        found = compliant(hits.guide(3), [0.0], [4e-3], changes, stiffness=stiffness)
        assert found.restitution.item() == pytest.approx(simulated, abs=4e-4)


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        ({}, {}, "stop is rigid: give a contact stiffness"),
        ({}, {"stiffness": 0.0}, "stiffness = 0 N/m"),
        ({}, {"stiffness": 1e6, "speed": -1.0}, "speed = -1 m/s"),
        ({"stop.restitution": 0.0}, {"stiffness": 1e6}, "must be at least 0.01"),
    ],
)
def test_mistakes_are_rejected(changes, options, words):
    with pytest.raises(ParameterError, match=words):
        compliant(GUIDE, [0.0], [0.0], changes, **options)


def test_the_speed_is_needed_for_other_exponents():
    stops = tuple(replace(s, law=COMPLIANT, stiffness=1e9, exponent=1.5) for s in GUIDE.stops)
    with pytest.raises(ParameterError, match="depends on the closing speed"):
        compliant(replace(GUIDE, stops=stops), [0.0], [0.0])


@pytest.mark.slow
def test_the_command_prints_a_map_for_each_stiffness(tmp_path, capsys):
    line = "impact-map PRBDM2R --wall-positions 0 --offsets 0 4 mm "
    assert cli.main(shlex.split(line + "--stiffness 1e6 N/m")) == cli.MISTAKE
    assert "need --method compliant" in capsys.readouterr().err
    line += f"--way compliant --stiffness 1e6 1e7 N/m --out {shlex.quote(str(tmp_path))}"
    assert cli.main(shlex.split(line)) == cli.OK
    printed = capsys.readouterr().out
    assert "2R, 1e+06 N/m" in printed
    assert "2R, 1e+07 N/m" in printed
    assert len((tmp_path / "PRBDM2R-impact-map.csv").read_text(encoding="utf-8").splitlines()) == 5


@pytest.mark.parametrize(
    ("exponent", "texts", "labels"),
    [
        (1.5, "1e9 2e9 N/m^1.5", ("1e+09 N/m^1.5", "2e+09 N/m^1.5")),
        (1.5, "'2 kN/m^1.5' 1e6N/m^1.5", ("2000 N/m^1.5", "1e+06 N/m^1.5")),
        (2, "1e9 '3 N/mm2'", ()),
        (2, "'3 N/mm2'", ("3e+06 N/m^2",)),
    ],
)
def test_the_unit_of_the_stiffness_has_the_present_exponent(
    exponent, texts, labels, tmp_path, capsys
):
    file = tmp_path / "guide.toml"
    law = 'law = "compliant"\nstiffness = 1e9\nexponent = 1.5\n'
    text = shipped()["PRBDM"].read_text("utf-8").replace("[[stops]]\n", "[[stops]]\n" + law)
    file.write_text(text, "utf-8")
    line = f"impact-map {shlex.quote(str(file))} --method compliant --wall-positions 0 --offsets 0 "
    status = cli.main(
        shlex.split(f"{line} --speed 0.3 --set stop.exponent={exponent} --stiffness {texts}")
    )
    written = capsys.readouterr()
    assert status == (cli.OK if labels else cli.MISTAKE)
    assert all(label in written.out for label in labels)
    assert labels or "write a unit after every number" in written.err
