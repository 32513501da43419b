"""The kernel of live pages, run in Node: the same bits as the native library."""

import json
from dataclasses import replace

import numpy as np
import pytest

from live import SCRIPTS, module_file, node, simulated
from prbm.drawing.shapes import Shapes, corners, curve
from prbm.interface.variables import LATCHED
from prbm.kernel.library import FUNCTIONS
from prbm.kernel.simulation import KernelSimulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.parts import Body, Flexure
from prbm.runs.experiment import experiment
from support import each_shipped, mechanism

pytestmark = pytest.mark.native

MODULE = """
const module = new WebAssembly.Module(require("node:fs").readFileSync(process.argv[1]));
const names = (list) => list.map((item) => item.name);
const [imports, exports] = [WebAssembly.Module.imports(module), WebAssembly.Module.exports(module)];
console.log(JSON.stringify([names(imports), names(exports)]));
"""


def beam_guide():
    """Return the guide on beams."""
    guide = mechanism("PRBDM")
    kinds = (replace(kind, model="beam", coefficients={}) for kind in guide.flexure_types)
    return replace(guide, name="BeamGuide", flexure_types=tuple(kinds))


def native(chosen, changes=None):
    """Simulate the default experiment in the native library."""
    default = experiment(chosen)
    simulation = KernelSimulation(chosen, changes)
    simulation.record = []
    for k in range(1, round(default.stop_time / default.step) + 1):
        simulation.advance(k * default.step)
    return simulation


def test_the_module_needs_no_imports_and_has_all_functions_of_the_engine():
    imports, exports = json.loads(node("-e", MODULE, module_file()))
    assert imports == []
    assert set(exports) >= {*FUNCTIONS, "malloc", "free", "memory"}


@pytest.mark.slow
@each_shipped
def test_impacts_and_outputs_equal_those_of_the_native_library_to_the_bit(model):
    chosen = mechanism(model)
    expected = native(chosen)
    outputs = expected.outputs()
    found = simulated(chosen, [*outputs])
    assert [impact["time"] for impact in found["impacts"]] == [i.time for i in expected.record]
    assert [impact["q"] for impact in found["impacts"]] == [i.q.tolist() for i in expected.record]
    assert dict(zip(outputs, found["last"], strict=True)) == outputs


def test_changed_values_act_as_in_the_native_library():
    changes = {"stop.restitution": 0.3, "flexure.length": 0.05, "force.x": -0.05}
    chosen, names = mechanism("PRBDM"), [f"stop.{name}" for name in LATCHED]
    found = simulated(chosen, names, changes=changes)
    outputs = native(chosen, changes).outputs()
    assert found["last"] == [outputs[name] for name in names]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("stop.restitution", "2", "stop.restitution = 2 must be at most 1"),
        ("flexure.thickness", "-1", "flexure.thickness"),
        ("flexure.thickness", "0.05", "flexure.thickness = 0.05 m is not less than the length"),
        ("stop.position", "NaN", "stop.position"),
        ("shuttle.mass", "Infinity", "shuttle.mass"),
        ("stop.position", "-0.03", "stop"),
    ],
)
def test_invalid_values_give_the_message_of_the_kernel(name, value, words):
    """The last value places the wall inside the body."""
    found = simulated(mechanism("PRBDM"), ["stop.gap"], changes={name: value})
    assert words in found["error"]


@pytest.mark.parametrize(
    "chosen",
    [*map(mechanism, ("PRBDM2R", "Bistable", "NotchGuide", "CurvedBistable")), beam_guide()],
    ids=lambda chosen: chosen.name,
)
def test_drawings_equal_those_of_the_python_package(chosen):
    found = simulated(chosen, ["energy.kinetic"], steps=40, drawing=True)
    system = assemble(chosen, chosen.values())
    shapes, e = Shapes(system), system.directions(np.array(found["q"]))
    for line, drawn in zip(shapes.flexures, found["curves"], strict=True):
        places, z = np.array(drawn) @ [1, 1j], corners(line.outline, e)
        if not line.jointed:
            distance = np.abs(places[:, None] - z[None, :]).min(axis=0).max()
            assert distance < 0.02 * system.length  # Both are polygons with many corners.
            assert abs(places[[0, -1]] - z[[0, -1]]).max() < 1e-9 * system.length
        else:
            assert abs(places - curve(z, line.guided)).max() < 1e-12 * system.length
    for body, drawn in zip(chosen.bodies, found["bodies"], strict=True):
        assert around(shapes.body(body.name, e)) == around(np.array(drawn) @ [1, 1j])
    for i, wall in enumerate(found["walls"]):
        assert abs(complex(*wall["point"]) - shapes.wall(i, 0.0, e)[:2].mean()) < 1e-12


def beside(chain, taper):
    """Return a mechanism with a tapered, curved beam on a body that a flexure of links carries."""
    guide = mechanism("PRBDM2R")
    body, leaf = guide.bodies[0], guide.flexure_types[0]
    kind = replace(
        leaf, name="blade", model="beam", profile="taper" if taper else "leaf", coefficients={},
        end_thickness=2e-3 if taper else None, curvature=10.0,
    )  # fmt: skip
    tip = Body("tip", 0.01, 1e-6, (0.0, 0.09), {"foot": (0.0, 0.08)})
    blade = Flexure("blade", "blade", "shuttle.left", "tip.foot")
    return replace(
        guide, name="Beside", bodies=(body, tip), flexure_types=(leaf, kind),
        flexures=(*guide.flexures[: 1 if chain else 2], blade), stops=(), frictions=(), forces=(),
        gravity=(0.0, 0.0),
    )  # fmt: skip


def filled(name, **dimensions):
    """Return the guide on notches with other notches, which are as long as the flexures: 10 mm."""
    guide = mechanism("NotchGuide")
    return replace(guide, name=name, flexure_types=(replace(guide.flexure_types[0], **dimensions),))


@pytest.mark.parametrize(
    "chosen",
    [
        *map(mechanism, ("NotchGuide", "CurvedBistable")),
        beside(False, True),
        beside(True, False),
        filled("Circular", notch_radius=5e-3),
        filled("Elliptic", notch_radius=5e-3, notch_depth=3e-3),
        filled("Shallow", notch_radius=5e-3, end_thickness=5e-3),
        filled("Filleted", notch_radius=3e-3, waist_length=4e-3),
    ],
    ids=lambda chosen: chosen.name,
)
def test_profiles_and_the_straight_shape_equal_those_of_the_python_package(chosen):
    found = simulated(chosen, ["energy.kinetic"], steps=3, drawing=True)
    system = assemble(chosen, chosen.values())
    shapes, e = Shapes(system), system.directions(np.array(found["q"]))
    lines = zip(shapes.flexures, found["edges"], found["straight"], strict=True)
    for line, edge, straight in lines:
        assert bool(edge) == line.shaped
        close = 2e-3 * system.length
        if line.shaped:
            assert gap(np.array(edge) @ [1, 1j], line.drawn(e)) < close
            assert gap(line.edge(e), np.array([*edge, edge[0]]) @ [1, 1j]) < close
        assert gap(np.array(straight) @ [1, 1j], line.drawn(shapes.straight)) < close


def gap(points, line):
    """Return the largest distance of points from a line of straight sides."""
    start, side = line[:-1], np.diff(line)
    start, side = start[side != 0.0], side[side != 0.0]
    share = np.clip(((points[:, None] - start) / side).real, 0.0, 1.0)
    return abs(points[:, None] - start - share * side).min(axis=1).max()


def around(points):
    """Return the corners of a polygon in micrometres, sorted."""
    return sorted((round(1e6 * z.real, 3) + 0.0, round(1e6 * z.imag, 3) + 0.0) for z in points)


def test_modes_equal_those_of_the_python_package():
    chosen = mechanism("PRBDM2R")
    found = simulated(chosen, ["energy.kinetic"], steps=1, drawing=True)
    system = assemble(chosen, chosen.values())
    shape = equilibrium(system)
    expected = modes(system, shape)
    assert found["rest"] == pytest.approx(shape.q, abs=1e-9)
    frequencies = [mode["frequency"] for mode in found["modes"]]
    assert frequencies == pytest.approx(expected.frequency, rel=1e-8)
    for k, mode in enumerate(found["modes"]):
        cosine = np.array(mode["shape"]) @ expected.M @ expected.shape[:, k]
        assert abs(cosine) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_repeated_runs_need_no_more_memory():
    found = simulated(mechanism("PRBDM"), ["stop.gap"], steps=100, repeat=50, drawing=True)
    first, last = found["memory"]
    assert last == first


@pytest.mark.parametrize("file", sorted(path.name for path in SCRIPTS.glob("*.js")))
def test_scripts_have_no_syntax_errors(file):
    node("--check", SCRIPTS / file)
