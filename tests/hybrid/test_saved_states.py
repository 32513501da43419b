"""Damaged and foreign saved states are rejected, and leave the simulation unchanged."""

import copy
import json
import math
from functools import reduce
from operator import getitem

import pytest

from point_mass import point_mass
from prbm.base.errors import ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.kernel.simulation import KernelSimulation
from support import mechanism

WRONG = ["1", [], {}, math.nan, math.inf, 10**400]
MAY_BE_NONE = {"step", "arc", "before", "pending", "k1", "calm_since"}
SAMPLES = {"ahead", "last"}  # Lists of any length.
RUBBING = {"stop.friction": 0.3, "friction.coefficient": 0.4, "friction.normal_force": 0.5}


def bouncing():
    """Return a guide with friction between two impacts, with a step and an event that follows."""
    simulation = Simulation(mechanism("PRBDM"), RUBBING)
    simulation.advance(0.06)
    while simulation.pending is None or simulation.arc is None or simulation.arc.before is None:
        simulation.advance(simulation.time + 1e-3)
    return simulation


def touching():
    """Return a mass in contact with a compliant stop."""
    simulation = Simulation(point_mass(stiffness=1e6, restitution=0.1, velocity=1.0))
    while not simulation.contacts.touching[0]:
        simulation.advance(simulation.time + 1e-4)
    return simulation


def places(state, path=()):
    """Yield the path of every part of a saved state; of lists, the first and the last element."""
    if path:
        yield path
    if isinstance(state, dict):
        for key in state:
            yield from places(state[key], (*path, key))
    elif isinstance(state, list):
        for k in sorted({0, len(state) - 1} & {*range(len(state))}):
            yield from places(state[k], (*path, k))


def replaced(state, path, value):
    """Return a copy of a saved state with one part replaced."""
    changed = copy.deepcopy(state)
    reduce(getitem, path[:-1], changed)[path[-1]] = value
    return changed


def assert_rejected(simulation, state):
    before = dict(vars(simulation))
    with pytest.raises(ParameterError, match=r"the saved state (is damaged: |belongs to )"):
        simulation.restore(state)
    assert all(vars(simulation)[name] is x for name, x in before.items())
    assert len(vars(simulation)) == len(before)


@pytest.mark.parametrize("start", [bouncing, touching])
def test_no_part_of_a_saved_state_may_have_another_form(start):
    simulation = start()
    state = json.loads(json.dumps(simulation.snapshot()))
    for k, path in enumerate(places(state)):
        part = reduce(getitem, path, state)
        wrong = [x for x in WRONG if x != part and not (x == [] and path[-1] in SAMPLES)]
        assert_rejected(simulation, replaced(state, path, wrong[k % len(wrong)]))
        if path[-1] not in MAY_BE_NONE and path[-2:-1] not in (("touches",), ("touching",)):
            assert_rejected(simulation, replaced(state, path, None))
        if isinstance(part, dict) and part:
            key = [*part][k % len(part)]
            assert_rejected(simulation, replaced(state, path, {**part, "other": 1.0}))
            rest = {name: x for name, x in part.items() if name != key}
            assert_rejected(simulation, replaced(state, path, rest))
    simulation.restore(state)
    assert json.loads(json.dumps(simulation.snapshot())) == state


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("tolerance",), 1.0),
        (("frequency",), -1.0),
        (("time",), 1e3),
        (("window", "count"), -1),
        (("window", "count"), 1001),
        (("controller", "h"), -1.0),
        (("fastest", "rate"), -1.0),
        (("fastest", "direction"), [1.0]),
        (("arc", "h"), -1.0),
        (("arc", "n"), 1),
        (("arc", "y"), [0.0]),
        (("arc", "k"), [[0.0]]),
        (("arc", "before", "time"), 1e3),
        (("arc", "before", "rates"), [0.0]),
        (("pending",), [4, 7, 0.1]),
        (("pending",), [4, -1, 0.1]),
        (("pending",), [99, 0, 0.1]),
        (("pending",), [4]),
        (("k1",), [0.0]),
        (("front", "modes", 0), 9),
        (("front", "modes", -1), 0),
        (("front", "latched", 0, "impact_count"), -1),
        (("front", "touches", 0), {"time": 0.0}),
        (("front", "touching", 0), {"phase": 1, "reference_speed": 1.0, "depth": 0.0}),
        (("values", "stop.restitution"), 2.0),
        (("acting", "shuttle.mass"), -1.0),
        (("given", "stop.mobility"), -1.0),
    ],
)  # fmt: skip
def test_numbers_that_do_not_agree_with_the_mechanism_are_rejected(path, value):
    simulation = bouncing()
    assert_rejected(
        simulation, replaced(json.loads(json.dumps(simulation.snapshot())), path, value)
    )


@pytest.mark.parametrize("engine", [Simulation, KernelSimulation])
def test_both_engines_reject_foreign_and_damaged_states_with_the_same_messages(engine):
    guide = mechanism("PRBDM")
    other = KernelSimulation if engine is Simulation else Simulation
    simulation = engine(guide)
    state = simulation.snapshot()
    name = "kernel" if engine is Simulation else "Python engine"
    cases = [
        (other(guide).snapshot(), f"belongs to the {name}: restore it there$"),
        (engine(mechanism("PRBDM2R")).snapshot(), "belongs to another mechanism$"),
        ([state], "is damaged: it is a list$"),
        ({**state, "given": {}}, "is damaged: "),
        ({**state, "values": {**state["values"], "stop.offset": "x"}}, "is damaged: .*stop.offset"),
        ({**state, "given": {**state["given"], "force.x": math.nan}}, "is damaged: .*force.x"),
        ({**state, "tolerance": 1.0}, "is damaged: .*tolerance"),
    ]
    for damaged, message in cases:
        with pytest.raises(ParameterError, match=f"^the saved state {message}"):
            simulation.restore(damaged)
    simulation.restore(state)
    assert simulation.snapshot() == state
