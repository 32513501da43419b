"""Notes on flexure models that are inadequate, compared with finite elements and closed forms."""

from dataclasses import replace

import pytest

from prbm.analysis import impact_map
from prbm.analysis.adequacy import (
    FINE_LINKS,
    FINE_ORDER,
    FLEXURES_MAX,
    Cause,
    Finding,
    Impact,
    Quantity,
    Skipped,
    Vibration,
    check,
    differ,
    worst,
)
from prbm.analysis.flexure_models import stretching, with_flexures
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from support import SUPPORT, mechanism

FINGER = read_mechanism(SUPPORT / "finger.toml")
EVERY = [Vibration(), Impact(0)]
WEIGHTLESS = {"gravity.x": 0.0}
STOP = (Quantity.RESTITUTION, 0)
SLOW = ("Bistable",)  # Its chains of many links take nine seconds.


def found(model, values=None, shapes=EVERY):
    """Return the findings by quantity and mode; a skipped comparison is an error."""
    result = check(model, values, shapes)
    assert all(isinstance(one, Finding) for one in result), list(map(str, result))
    return {(one.quantity, one.mode): one for one in result}


def chosen(model, choice):
    """Return a mechanism with the keys of a choice."""
    keys = dict(pair.split(" = ") for pair in choice.split(", "))
    assert keys.pop("axial") == "true"
    if not keys:
        return stretching(model)
    return with_flexures(model, keys["model"].strip('"'), axial=True, order=int(keys["order"]))


def test_frequencies_of_the_finger_agree_with_finite_elements_only_if_it_stretches():
    """The second mode is a motion along the flexures, which inextensible ones suppress."""
    exudyn = pytest.importorskip("exudyn", reason="finite elements need exudyn")
    assert exudyn
    from prbm.references.finite_elements import FiniteElements

    fe = FiniteElements(FINGER, elements=8)
    reference = fe.modes(fe.equilibrium()).frequency
    ((key, finding),) = found(FINGER, shapes=[Vibration()]).items()
    assert key == (Quantity.FREQUENCY, 2)
    assert finding.cause is Cause.INEXTENSIBLE
    assert finding.better == pytest.approx(reference[1], rel=0.01)
    assert finding.found > 5 * reference[1]
    assert not found(stretching(FINGER), shapes=[Vibration()])


@pytest.mark.slow
@pytest.mark.parametrize("axial", [False, True])
def test_restitution_of_the_finger_agrees_with_finite_elements_only_with_more_pivots(axial):
    pytest.importorskip("exudyn", reason="finite elements need exudyn: pip install exudyn")
    reference = impact_map.by_elements(FINGER, [3e-3], [0.0], elements=16).restitution.item()
    finding = found(stretching(FINGER) if axial else FINGER)[STOP]
    assert finding.cause is Cause.PIVOTS
    assert finding.better == pytest.approx(reference, abs=0.01)
    assert abs(finding.found - reference) > 0.1
    simple = with_flexures(FINGER, "2R", axial=axial)
    own = impact_map.algebraic(simple, [3e-3], [0.0]).restitution.item()
    assert finding.found == pytest.approx(own, abs=1e-12)


def test_a_finding_names_shape_displacement_both_values_and_remedy():
    restitution = found(FINGER)[STOP]
    assert "finger held at the wall of stop, hit point displaced by 3 mm" in str(restitution)
    for x in (restitution.found, restitution.better):
        assert f"{x:.3f}" in str(restitution)
    assert restitution.choice in str(restitution)
    frequency = found(FINGER, shapes=[Vibration(-1e-3)])[Quantity.FREQUENCY, 2]
    assert str(frequency).startswith("finger held at -1 mm: mode 2 is at 1378 Hz with inext")
    assert str(frequency).endswith("set axial = true for the flexures")
    unstable = replace(frequency, found=-3.0)
    assert "mode 2 is unstable with inextensible flexures" in str(unstable)
    free = replace(frequency, found=0.0)
    assert "mode 2 is free with inextensible flexures" in str(free)


@pytest.mark.parametrize(
    "name",
    ["finger", *(pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in shipped())],
)
def test_the_choice_removes_the_findings(name):
    model = FINGER if name == "finger" else mechanism(name)
    shapes = [Vibration(), *map(Impact, range(len(model.stops)))]
    choices = [finding.choice for finding in found(model, shapes=shapes).values()]
    if choices:
        assert not found(chosen(model, max(choices, key=len)), shapes=shapes)


@pytest.mark.parametrize("name", ["Cantilever", "ImpactOscillator", "PRBDM", "PRBDM2R"])
def test_shipped_mechanisms_are_adequate_where_they_are_used(name):
    model = mechanism(name)
    assert check(model, {}, [Vibration(), *map(Impact, range(len(model.stops)))]) == []


def test_stretching_turns_the_guide_in_an_impact_off_its_centre():
    """With stretching flexures C is near that of a free body, 1.6/(1 + m d^2/J) - 1."""
    guide = mechanism("PRBDM2R")
    known = guide.values()
    free = 1.6 / (1 + known["shuttle.mass"] * 4e-3**2 / known["shuttle.inertia"]) - 1
    values = WEIGHTLESS | {"stop.offset": 4e-3}
    ((key, finding),) = found(guide, values, [Impact(0)]).items()
    assert key == STOP
    assert finding.cause is Cause.INEXTENSIBLE
    assert "stop hits 4 mm off the centre of mass of shuttle" in str(finding)
    assert finding.found == pytest.approx(0.6, abs=0.005)
    assert finding.better == pytest.approx(free, abs=0.005)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("PRBDM2R", {"stop.offset": 0.5e-3}),
        ("PRBDM2RAxial", {"stop.offset": 4e-3}),  # stretches already
        ("Cantilever", {"stop.offset": 4e-3}),  # off the centre, but stretching has no effect
        ("PRBDM2R", {"stop.offset": 4e-3, "stop.position": 1.0}),  # out of reach
        ("PRBDM", {"flexure.K_theta": 2.5449}),  # a coefficient that a chain does not have
    ],
)
def test_nothing_is_reported_where_the_model_is_adequate(name, values):
    assert check(mechanism(name), values, EVERY) == []


def test_position_and_offset_of_an_impact_replace_those_of_the_stop():
    guide = mechanism("PRBDM2R")
    given = {"stop.position": 1e-3, "stop.offset": 4e-3}
    by_values, by_shape = (
        found(guide, values, [shape])[STOP]
        for values, shape in ((given, Impact(0)), ({}, Impact(0, 1e-3, 4e-3)))
    )
    assert by_shape == by_values
    assert "displaced by 1 mm" in str(by_shape)


@pytest.mark.slow
@pytest.mark.parametrize("choice", [{"model": "nR", "n": FINE_LINKS},
                                    {"model": "beam", "order": FINE_ORDER}], ids=str)  # fmt: skip
def test_chains_of_many_links_and_beams_of_a_high_order_are_their_own_reference(choice):
    assert check(with_flexures(FINGER, axial=True, **choice), {}, EVERY) == []
    # Without stretch only the effect of stretching is left.
    rigid = with_flexures(FINGER, **choice)
    assert {one.cause for one in found(rigid).values()} == {Cause.INEXTENSIBLE}


def test_the_proposal_for_the_finger_is_a_beam_of_the_order_3_which_has_no_findings():
    """Its restitution is that of finite elements, -0.182, within 0.01."""
    finding = found(stretching(FINGER))[STOP]
    assert finding.choice == 'model = "beam", order = 3, axial = true'
    assert finding.better == pytest.approx(-0.182, abs=2e-3)
    proposed = chosen(FINGER, finding.choice)
    assert check(proposed, {}, EVERY) == []
    restitution = impact_map.algebraic(proposed, [3e-3], [0.0]).restitution.item()
    assert restitution == pytest.approx(-0.182, abs=0.01)


def test_a_beam_of_a_low_order_is_compared_with_a_higher_one():
    """The order 1 bends the finger's flexures too little at the wall."""
    result = found(with_flexures(FINGER, "beam", order=1, axial=True), shapes=[Impact(0)])
    assert {one.cause for one in result.values()} == {Cause.PIVOTS}
    assert {one.choice for one in result.values()} == {'model = "beam", order = 3, axial = true'}
    assert result[STOP].better == pytest.approx(-0.182, abs=2e-3)


def test_a_curved_beam_of_a_low_order_is_compared_with_a_higher_one():
    """The finer model keeps the rise of the beams; order 3 has the frequency within a percent."""
    bistable = mechanism("CurvedBistable")
    result = found(with_flexures(bistable, "beam", axial=True, order=2), shapes=[Vibration()])
    assert {one.cause for one in result.values()} == {Cause.PIVOTS}
    assert {one.choice for one in result.values()} == {'model = "beam", order = 3, axial = true'}
    (finding,) = result.values()
    system = assemble(bistable, bistable.values())
    own = modes(system, equilibrium(system)).frequency[finding.mode - 1]
    assert finding.better == pytest.approx(own, rel=0.01)


def test_a_mechanism_of_many_flexures_is_skipped_with_a_reason():
    """The finer model would have too many coordinates."""
    first = FINGER.flexures[0]
    more = tuple(replace(first, name=f"leaf{i}") for i in range(FLEXURES_MAX - 1))
    many = replace(stretching(FINGER), flexures=(*FINGER.flexures, *more))
    result = check(many, {}, [Vibration()])
    (skipped,) = (one for one in result if isinstance(one, Skipped))
    assert f"the mechanism has {FLEXURES_MAX + 1} flexures" in str(skipped)
    assert "prbm validate" in str(skipped)


def test_an_expression_in_a_coefficient_of_the_model_skips_the_comparison():
    """The finer model has no such coefficient."""
    stop = replace(FINGER.stops[0], offset="leaf.gamma1 * 1e-3")
    result = check(replace(FINGER, stops=(stop,)), {}, [Vibration()])
    assert any(isinstance(one, Skipped) and "leaf.gamma1" in str(one) for one in result)


def test_frequencies_that_are_round_off_are_not_compared():
    key = (Quantity.FREQUENCY, 1)
    second = {(Quantity.FREQUENCY, 2): 100.0}
    assert not differ({key: 1e-6, **second}, {key: -2e-6, **second}, key)
    assert differ({key: 1.0, **second}, {key: -2.0, **second}, key)
    assert not differ({key: 1.0}, second, key)


@pytest.mark.slow
def test_of_several_places_the_largest_difference_is_kept():
    shapes = [Impact(0, wall) for wall in (1e-3, 3e-3, 2e-3)]
    result = [one for one in check(FINGER, {}, shapes) if one.quantity is Quantity.RESTITUTION]
    pivots = [one for one in result if one.cause is Cause.PIVOTS]
    largest = max(abs(one.found - one.better) for one in pivots)
    (kept,) = (one for one in worst(result) if one.cause is Cause.PIVOTS)
    assert abs(kept.found - kept.better) == largest
