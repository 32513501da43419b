"""Mechanisms as data: expressions, parameters, and rejected descriptions."""

import dataclasses
import math
import re

import numpy as np
import pytest

from prbm.base.errors import EquilibriumError, MechanismError, ParameterError, PrbmError
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium, free_displacement
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import affine
from prbm.mechanism.parameters import Parameter
from prbm.mechanism.parts import Body, Flexure, FlexureType, Force, Joint, Release, Stop
from prbm.mechanism.supported import FREE_BODIES, SPRINGS, check_supported
from springs import oscillator
from support import mechanism

GUIDE = mechanism("PRBDM2R")

INTERFACE = {
    "flexure.length", "flexure.thickness", "flexure.width", "flexure.youngs_modulus",
    "flexure.density", "shuttle.width", "shuttle.mass", "shuttle.inertia", "shuttle.com_height",
    "gravity.x", "gravity.y", "release.displacement", "release.velocity", "solver.tolerance",
    "damping.zeta", "damping.beta", "friction.coefficient", "friction.normal_force",
    "friction.normal_stiffness", "stop.position", "stop.offset", "stop.restitution",
    "stop.friction", "stop.rest_speed",
}  # fmt: skip
TUNABLE = {name for name in INTERFACE if name.split(".")[0] in ("damping", "friction", "stop")}


@pytest.mark.parametrize(
    ("model", "own"),
    [
        ("PRBDM", {"flexure.gamma", "flexure.K_theta"}),
        ("PRBDM2R", {f"flexure.{n}" for n in ("gamma1", "gamma2", "K_theta1", "K_theta2")}),
    ],
)
def test_parameters_are_those_of_the_public_interface(model, own):
    parameters = mechanism(model).parameters
    assert {p.name for p in parameters} == INTERFACE | own
    assert {p.name for p in parameters if p.tunable} == TUNABLE
    for p in parameters:
        assert p.description
        assert p.minimum <= p.value <= p.maximum


@pytest.mark.parametrize(
    ("text", "expected"),
    [("2*a - b/4 + 1", 2.5), ("-(a - 3)", 2.0), ("+a*2", 2.0), (7, 7.0), ("1e-3", 1e-3)],
)
def test_expressions_are_affine_in_parameters(text, expected):
    assert affine(text)({"a": 1.0, "b": 2.0}) == expected


@pytest.mark.parametrize(
    "text", ["a*b", "1/a", "sin(a)", "a**2", "a +", "__import__('os')", "a/0", "(" * 500, "'x'"]
)
def test_expressions_that_are_not_affine_are_rejected(text):
    with pytest.raises(MechanismError, match="cannot read the expression"):
        affine(text)


def changed(**parts):
    return dataclasses.replace(GUIDE, **parts)


BODY = GUIDE.bodies[0]
LEFT, RIGHT = GUIDE.flexures
LEAF = GUIDE.flexure_types[0]


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"name": "2R"}, "use letters a to z"),
        ({"name": "class"}, "no keyword of Python"),
        ({"name": "Führung"}, "use letters a to z"),
        ({"gravity": (9.81,)}, "an x and a y"),
        ({"stops": (Stop("energy", "shuttle", (0, 0)),)}, "used twice or reserved"),
        ({"stops": (Stop("s", "shuttle", (0, 0), direction=math.nan),)}, "must be finite"),
        ({"ground": {"left": (math.nan, 0), "right": (0.1, 0)}}, "not finite"),
        ({"ground": {"left": ("1e400", 0), "right": (0.1, 0)}}, "not finite"),
        ({"bodies": ()}, "at least one body"),
        ({"bodies": (BODY, BODY)}, "'shuttle' is used twice"),
        (
            {"stops": (Stop("stop", "shutle", (0, 0)),)},
            "'shutle' is not defined; choose one of shuttle",
        ),
        ({"release": Release("shutle")}, "'shutle' is not defined; choose one of shuttle"),
        ({"flexures": (dataclasses.replace(LEFT, end="shuttle.top"), RIGHT)}, "'shuttle.top'"),
        ({"flexures": (dataclasses.replace(LEFT, type="leaf"), RIGHT)}, "'leaf' is not"),
        ({"flexures": (dataclasses.replace(LEFT, ends=("free", "pin")), RIGHT)}, "needs a clamp"),
        ({"flexures": (dataclasses.replace(LEFT, end="ground.right"), RIGHT)}, "to itself"),
        ({"flexure_types": (dataclasses.replace(LEAF, model="R"),)}, "choose one of 1R, 2R, 3R"),
        (
            {"flexure_types": (dataclasses.replace(LEAF, coefficients={"gamma": 0.8}),)},
            "not a coefficient of the 2R model",
        ),
        ({"geometry": ()}, "not a parameter of PRBDM2R"),
        ({"geometry": (*GUIDE.geometry, GUIDE.geometry[0])}, "defined twice"),
    ],
)
def test_inconsistent_descriptions_are_rejected(parts, words):
    with pytest.raises(MechanismError, match=words):
        changed(**parts)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"bodies": (dataclasses.replace(BODY, mass="-shuttle.width"),)}, "shuttle.mass = -0.08"),
        (
            {"stops": (dataclasses.replace(GUIDE.stops[0], restitution="2 - shuttle.width*5"),)},
            "stop.restitution = 1.6 must be at most 1",
        ),
        (
            {"flexure_types": (dataclasses.replace(LEAF, thickness="-flexure.length/400"),)},
            "flexure.thickness = -0.0001 m must be at least",
        ),
    ],
)
def test_expressions_out_of_bounds_are_rejected(parts, words):
    with pytest.raises(ParameterError, match=re.escape(words)):
        changed(**parts).values()


def test_moving_parts_without_mass_are_rejected():
    massless = changed(flexure_types=(dataclasses.replace(LEAF, density="1e-30*flexure.length"),))
    values = GUIDE.values() | {"flexure.density": 0.0}
    with pytest.raises(ParameterError, match="at least 1 kg/m3"):
        massless.values()
    with pytest.raises(ParameterError, match="has no mass"):
        assemble(GUIDE, values)


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
@pytest.mark.parametrize("name", ["PRBDM2R", "GuideBeam"])
def test_inertias_that_differ_by_round_off_are_rejected_with_the_names_of_both_parts(name, engine):
    """The inertia of the flexures is mostly in proportion to their section.

    Beside the shuttle that the links move, that of links is round-off: they count as massless.
    """
    thin = {"flexure.thickness": 1e-8, "flexure.width": 1e-8}
    words = (
        r"the inertia of flexure \w+, .* less than 1e-16 of that of body shuttle, .* check the "
        r"units of masses, inertias, densities, lengths and coordinates \(numbers without a unit"
        r"|a part that can move has no mass: give the flexures a density"
    )
    with pytest.raises(ParameterError, match=words):
        engine(mechanism(name), thin)


def test_incomplete_values_are_rejected():
    """The message names missing parameters and the call that returns all values."""
    values = GUIDE.values()
    del values["gravity.x"]
    with pytest.raises(
        ParameterError, match=r"values of gravity\.x are missing .*mechanism\.values\(\)"
    ):
        assemble(GUIDE, values)
    with pytest.raises(ParameterError, match=rf"and {len(values) - 4} more are missing"):
        assemble(GUIDE, {})


@pytest.mark.slow
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_parameter_at_its_bounds_is_simulated_or_rejected_with_a_reason(model):
    """At each bound, the simulation starts or a message gives the reason."""
    guide = mechanism(model)
    for p in guide.parameters:
        for bound in (p.minimum, p.maximum):
            try:
                Simulation(guide, {p.name: bound})
                continue
            except PrbmError as error:
                message = str(error)
            assert len(message) > 20, p.name


def test_an_invalid_parameter_name_is_rejected():
    with pytest.raises(MechanismError, match="is invalid: use letters"):
        Parameter("two words", 1.0)


@pytest.mark.parametrize("bad", [True, "1", None, float("nan"), 1j])
def test_a_value_that_is_not_a_number_is_rejected(bad):
    with pytest.raises(ParameterError, match=r"flexure.length = "):
        GUIDE.values({"flexure.length": bad})


def test_bodies_that_nothing_connects_to_the_ground_are_free():
    loose = Body("loose", 1.0, 1.0, (1.0, 1.0), {"a": (1.0, 1.0)})
    other = Body("other", 1.0, 1.0, (2.0, 1.0), {"a": (2.0, 1.0)})
    between = Flexure("between", "flexure", "loose.a", "other.a")
    both = changed(bodies=(BODY, loose, other), flexures=(LEFT, RIGHT, between))
    assert both.free_bodies == ("loose", "other")
    assert changed(bodies=(BODY, loose)).free_bodies == ("loose",)
    assert changed().free_bodies == ()
    with pytest.raises(MechanismError, match=r"the closed form has no bodies .* connect loose to"):
        check_supported(changed(bodies=(BODY, loose)), "the closed form", FREE_BODIES)


def test_a_computation_without_springs_names_them():
    with pytest.raises(MechanismError, match="finite elements has no springs: remove coil, or"):
        check_supported(oscillator(), "a model of finite elements", SPRINGS)


def test_a_body_on_springs_to_the_ground_does_not_fly_freely():
    block = oscillator()
    assert (block.floating_bodies, block.free_bodies) == (("block",), ())
    check_supported(block, "a linear model", FREE_BODIES)
    assert dataclasses.replace(block, damping_zeta=0.1).damping_zeta == 0.1


def test_a_flexure_without_length_is_rejected():
    short = changed(flexures=(LEFT, RIGHT), ground={"left": (0, "flexure.length"), "right": (0, 0)})
    with pytest.raises(ParameterError, match=r"left_flexure from ground\.left to shuttle\.left"):
        assemble(short, short.values())


def wheel_on_two_leaves(n: int = 8) -> Mechanism:
    """Return a wheel on two chains that are both clamped to the ground at its centre of mass."""
    return Mechanism(
        name="Wheel",
        title="A wheel on two leaves from one point",
        ground={"hub": (0.0, 0.0)},
        bodies=(Body("rim", 0.02, 1e-5, (0.0, 0.0), {"right": (0.04, 0.0), "top": (0.0, 0.04)}),),
        flexure_types=(FlexureType("leaf", "nR", 1e-4, 8e-3, 2e11, 7800.0, n=n),),
        flexures=(
            Flexure("along", "leaf", "ground.hub", "rim.right"),
            Flexure("across", "leaf", "ground.hub", "rim.top"),
        ),
        release=Release("rim"),
        forces=(Force("push", "rim"),),
    )


def test_the_size_of_a_mechanism_is_positive_if_all_centres_of_mass_coincide():
    """The wheel turns under a moment; each leaf has the stiffness 4 EI/L about its clamp."""
    wheel = wheel_on_two_leaves(60)
    system = assemble(wheel, wheel.values())
    assert system.length == pytest.approx(0.04)
    shape = equilibrium(system, loads={"push.moment": 1e-6})
    turn = shape.q[system.bodies["rim"].j]
    assert 1e-6 / turn == pytest.approx(2 * 4 * (2e11 * 8e-3 * 1e-4**3 / 12) / 0.04, rel=2e-3)


def truss() -> Mechanism:
    """Return a body on three bars whose lines have no common point."""
    pins = ("pin", "pin")
    return Mechanism(
        name="Truss",
        title="Three bars",
        ground={"a": (0.0, 0.0), "b": (0.06, 0.0), "c": (0.1, 0.03)},
        bodies=(Body("arm", 0.03, 1e-5, (0.03, 0.05), {"p": (0.0, 0.04), "q": (0.06, 0.04)}),),
        flexure_types=(FlexureType("bar", "2R", 1e-4, 8e-3, 2e11, 7800.0),),
        flexures=(
            Flexure("first", "bar", "ground.a", "arm.p", pins),
            Flexure("second", "bar", "ground.b", "arm.q", pins),
            Flexure("third", "bar", "ground.c", "arm.q", pins),
        ),
        release=Release("arm"),
    )


def test_a_mechanism_without_mobility_is_rejected_with_the_names_of_its_loops():
    held = truss()
    with pytest.raises(MechanismError, match="closed by second, third prevent every motion"):
        assemble(held, held.values())


def pinned() -> Mechanism:
    """Return a wheel on a pin at its centre of mass, with a leaf to the ground."""
    return dataclasses.replace(
        wheel_on_two_leaves(),
        ground={"hub": (0.0, 0.0), "side": (0.06, 0.01)},
        bodies=(Body("rim", 0.02, 1e-5, (0, 0), {"hub": (0.0, 0.0), "right": (0.02, 0.0)}),),
        flexures=(Flexure("leaf_1", "leaf", "ground.side", "rim.right"),),
        joints=(Joint("pin", "ground.hub", "rim.hub"),),
        gravity=(0.0, -9.81),
    )


def test_a_release_of_a_body_whose_centre_of_mass_is_fixed_is_rejected():
    """The leaf stretches, so that the wheel can turn."""
    leaf = dataclasses.replace(pinned().flexure_types[0], axial=True)
    wheel = dataclasses.replace(pinned(), flexure_types=(leaf,))
    with pytest.raises(EquilibriumError, match=r"= 0 m: the centre of mass of the body rim cannot"):
        Simulation(wheel)


def test_a_release_along_an_immobile_direction_is_rejected():
    """The inextensible leaf, as drawn, prevents a rotation of the pinned wheel."""
    with pytest.raises(EquilibriumError, match=r"= 0 m: the body rim cannot move along the direc"):
        Simulation(pinned())


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("reverse", [False, True])
def test_frequencies_and_rest_position_do_not_depend_on_order_and_direction_of_flexures(
    order, reverse
):
    """The choice of the spanning tree and of the start of a flexure has no influence."""
    flexures = [GUIDE.flexures[i] for i in order]
    if reverse:
        flexures[0] = dataclasses.replace(flexures[0], start=flexures[0].end, end=flexures[0].start)
    same = changed(flexures=tuple(flexures))
    results = []
    for guide in (GUIDE, same):
        system = assemble(guide, guide.values())
        results.append((modes(system, equilibrium(system)).frequency, free_displacement(system)))
    np.testing.assert_allclose(results[1][0], results[0][0], rtol=1e-9)
    assert results[1][1] == pytest.approx(results[0][1], rel=1e-9)


def test_the_moving_mass_excludes_the_stubs_at_the_ground():
    """Each stub at the ground has a twentieth of the mass of a 2R flexure."""
    system = assemble(GUIDE, GUIDE.values())
    flexure = 7800 * 8e-3 * 1e-4 * 0.04
    assert system.m.sum() == pytest.approx(0.053187 + 2 * flexure * (1 - 0.05), rel=1e-12)


def test_invalid_files_are_rejected_with_path_and_reason(tmp_path):
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    cases = {
        "no toml": ("= 3", "not a TOML file"),
        "unknown key": (text + "\n[extra]\nx = 1\n", "extra"),
        "wrong type": (
            text.replace("mass = 0.053187", "mass = [1, 2]"),
            "= [1, 2]: write a number",
        ),
        "missing": (text.replace('body = "shuttle"\ndisplacement', "displacement"), "release"),
        "reference": (text.replace('"shuttle.right"', '"shuttle.wrong"'), "shuttle.wrong"),
    }
    for name, (content, words) in cases.items():
        path = tmp_path / f"{name}.toml"
        path.write_text(content, encoding="utf-8")
        with pytest.raises(MechanismError) as caught:
            read_mechanism(path)
        assert str(path) in str(caught.value)
        assert words in str(caught.value)
    with pytest.raises(MechanismError, match="cannot be read"):
        read_mechanism(tmp_path / "none.toml")


def test_the_representation_of_a_mechanism_is_one_line_with_its_name_and_title():
    for name in shipped():
        shown = repr(mechanism(name))
        assert shown == f"<Mechanism {name}: {mechanism(name).title}>"
        assert len(shown) <= 160
        assert "\n" not in shown


def test_two_flexure_types_with_one_name_are_rejected():
    twice = (LEAF, FlexureType("flexure", "1R", 1e-3, 1e-3, 1e9, 1e3))
    with pytest.raises(MechanismError, match="twice"):
        changed(flexure_types=twice)


def test_mechanism_is_a_frozen_dataclass():
    with pytest.raises(dataclasses.FrozenInstanceError):
        GUIDE.name = "other"
    assert isinstance(GUIDE, Mechanism)
