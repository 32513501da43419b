"""Terminals: valid, complete, and with flows whose work is that of the FMU."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import fmpy
import pytest
from lxml import etree

from many_parts import anvil
from prbm.fmu.start import interface
from prbm.fmu.terminals import INFLOW, OUTFLOW, SIGNAL, terminals
from prbm.interface.variables import Variable
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanism.description import Mechanism
from prbm.mechanism.parts import Body, Probe
from support import case, each_shipped, mechanism

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
FLANGE = "Modelica.Mechanics.Translational.Interfaces.Flange_a"
ROTARY = "Modelica.Mechanics.Rotational.Interfaces.Flange_a"


def root(chosen: Mechanism, *further: Variable) -> etree._Element:
    """Return the parsed terminals of a mechanism; ``further`` variables are added to its own."""
    return etree.fromstring(terminals(chosen, (*interface(chosen, {}), *further)))


def port(chosen: Mechanism, path: str, *further: Variable) -> dict[str, tuple[str, str]] | None:
    """Return variable and kind of each member of a terminal ``outer.inner``; None without it."""
    found = root(chosen, *further).find("Terminals")
    for name in path.split("."):
        found = next((t for t in found.findall("Terminal") if t.get("name") == name), None)
        if found is None:
            return None
    members = found.findall("TerminalMemberVariable")
    return {m.get("memberName"): (m.get("variableName"), m.get("variableKind")) for m in members}


@each_shipped
def test_terminals_are_valid_and_name_inputs_and_outputs(model):
    chosen = mechanism(model)
    found = root(chosen)
    checker = etree.XMLSchema(file=str(SCHEMA))
    assert checker.validate(found), checker.error_log
    known = {v.name for v in interface(chosen, {}) if v.causality in ("input", "output")}
    named = [m.get("variableName") for m in found.iter("TerminalMemberVariable")]
    it = case(model)
    assert {f"{it.stop}.gap", f"{it.force}.x", "base.force.x"} <= {*named} <= known
    for terminal in found.iter("Terminal"):
        members = [m.get("memberName") for m in terminal.findall("TerminalMemberVariable")]
        assert members
        assert len(members) == len({*members})
        inner = [t.get("name") for t in terminal.findall("Terminal")]
        assert len(inner) == len({*inner})


def work(chosen: Mechanism, flange: dict[str, tuple[str, str]], force: float) -> tuple[float, ...]:
    """Return the work of a constant force at a flange, and ``energy.work``, after 10 ms."""
    (position, _), (flow, kind) = flange.values()
    assert kind == INFLOW
    simulation = KernelSimulation(chosen, {flow: force})
    start = simulation.outputs()[position]
    simulation.advance(0.01)
    outputs = simulation.outputs()
    return force * (outputs[position] - start), outputs["energy.work"]


@pytest.mark.parametrize("name", ["flange_x", "flange_y", "flange_moment"])
def test_the_force_of_a_flange_times_its_displacement_is_the_work_on_the_mechanism(name):
    chosen = mechanism("PRBDM2RAxial")
    done, counted = work(chosen, port(chosen, f"force.{name}"), 5e-2)
    assert done == pytest.approx(counted, rel=1e-6)
    assert abs(counted) > 1e-12


def test_a_force_on_a_point_has_flanges_only_with_a_probe_at_this_point():
    """The displacement of a force on another point than the centre of mass is no output."""
    plain = anvil()
    assert port(plain, "blow.flange_x") is None
    assert port(plain, "blow.flange_moment")["phi"] == ("hammer.angle", SIGNAL)
    stage, hammer = plain.bodies
    points = dict(hammer.points) | {"struck": plain.forces[0].point}
    struck = Body(hammer.name, hammer.mass, hammer.inertia, hammer.centre, points)
    probed = replace(plain, bodies=(stage, struck), probes=(Probe("p", "hammer.struck"),))
    done, counted = work(probed, port(probed, "blow.flange_y"), 1e-3)
    assert done == pytest.approx(counted, rel=1e-6)
    assert abs(counted) > 1e-12


def test_the_flows_of_a_wall_times_its_velocity_are_the_work_taken_from_the_mechanism():
    """The wall retreats with a constant velocity; it is struck, and holds the body at the end."""
    chosen, speed = mechanism("PRBDM"), 5e-3
    members = port(chosen, "stop.wall")
    kinds = {member: kind for member, (_, kind) in members.items()}
    assert kinds["displacement"] == kinds["velocity"] == kinds["mobility"] == SIGNAL
    assert kinds["force"] == kinds["impulse_sum"] == OUTFLOW
    force, impulses = members["force"][0], members["impulse_sum"][0]
    simulation = KernelSimulation(chosen, {members["velocity"][0]: speed})
    pushed, last, step = 0.0, 0.0, 1e-4
    times = [step * k for k in range(3001)]
    for t, end in pairwise(times):
        simulation.set({members["displacement"][0]: speed * t})
        simulation.advance(end)
        new = simulation.outputs()[force]
        pushed, last = pushed + step * (last + new) / 2.0, new
    outputs = simulation.outputs()
    assert outputs["stop.impact_count"] > 5
    taken = speed * (outputs[impulses] + pushed)
    assert taken == pytest.approx(-outputs["energy.work"], rel=1e-3)


def test_only_walls_on_the_ground_have_ports():
    """The wall on a body of the FMU acts on that body, not on a partner."""
    assert port(anvil(), "face.wall") is None
    assert port(anvil(), "side.wall") is not None
    text = root(anvil()).xpath("//Terminal[@name='face']")[0].get("description")
    assert text == "Contact of the hammer with a wall on the stage"


def test_only_stops_whose_force_contains_impacts_have_a_flange():
    """The force of a rigid stop has no impacts, which a flange without impulses would lose."""
    chosen = mechanism("PRBDM")
    assert port(chosen, "stop.flange") is None
    peak = Variable("stop.peak_force", "", "output", "continuous", "calculated", "N")
    flange = port(chosen, "stop.flange", peak)
    assert flange == {"s": ("stop.displacement", SIGNAL), "f": ("stop.force", OUTFLOW)}
