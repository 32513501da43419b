"""Flexures in the colours of their stress."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection

import prbm
from prbm.analysis.stress_field import StressField, StressRecorder
from prbm.commands import command_line as cli
from prbm.mechanics.assembly import assemble
from prbm.mechanics.sections import static_section_loads
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.stress import faces, with_stress
from prbm.plots.motion import film, motion
from prbm.plots.scene import Scene, pictures
from prbm.plots.stress import stress_figure
from prbm.plots.stress_colours import UNIT
from prbm.runs.run import simulate


def turned_round(mechanism):
    """Return a mechanism with the start and the end of each flexure exchanged."""
    flexures = tuple(
        replace(f, start=f.end, end=f.start, ends=f.ends[::-1]) for f in mechanism.flexures
    )
    return replace(mechanism, flexures=flexures)


def coloured(axes):
    """Return points [mm] and stress [MPa] of the coloured lines of axes."""
    lines = [x for x in axes.collections if isinstance(x, LineCollection) and len(x.get_array())]
    return [(np.array(x.get_segments()).mean(axis=1), np.asarray(x.get_array())) for x in lines]


@pytest.mark.parametrize("name", ["GuideBeam", "PRBDM2R"])
@pytest.mark.parametrize("turned", [False, True])
def test_colour_along_a_held_flexure_is_its_stress(name, turned):
    """The left leaf bends most at its clamps and not in the middle, with its end that moves."""
    mechanism = prbm.load(name)
    mechanism = turned_round(mechanism) if turned else mechanism
    figure = stress_figure(mechanism, {"gravity.x": 0.0}, [0.01], ["held at 10 mm"])
    stage, bar = figure.axes
    assert bar.get_ylabel() == UNIT
    system = assemble(mechanism, mechanism.values({"gravity.x": 0.0}))
    loads = static_section_loads(system, equilibrium(system, 0.01))
    for (points, stress), one in zip(coloured(stage), loads, strict=True):
        expected = 1e-6 * np.abs(faces(one)).max(axis=0)
        ends = expected[[-1, 0]] if turned else expected[[0, -1]]
        order = np.argsort(points[:, 1])  # From the ground to the shuttle.
        assert stress[order][[0, -1]] == pytest.approx(ends, rel=0.1)
        assert stress.min() < 0.1 * stress.max()
    assert bar.get_ylim()[1] == pytest.approx(
        1e-6 * max(float(np.abs(faces(one)).max()) for one in loads)
    )


@pytest.mark.slow
def test_film_has_the_colours_of_the_simulated_stress():
    recorder = StressRecorder()
    result = simulate(
        with_stress(prbm.load("GuideBeam")), stop_time=0.03, step=1e-3, observer=recorder
    )
    field = recorder.field
    chosen = film(motion(result), slow=10.0, fps=10.0)
    scene = Scene(motion(result), chosen, stress=field)
    for k in (0, len(chosen.times) - 1):
        scene.frame(k)
        t = chosen.times[k]
        for name, line in scene.coloured.items():
            ends = np.asarray(line.get_array())[[0, -1]]
            faces = [result[f"{name}.stress_{end}"] for end in ("start", "end")]
            expected = [1e-6 * abs(np.interp(t, result["time"], x)) for x in faces]
            assert ends == pytest.approx(expected, rel=0.1)
    frame = next(iter(pictures(scene, [0])))
    assert len(np.unique(frame.reshape(-1, 3), axis=0)) > 50
    assert len(scene.stress_colours) > 40


def test_stress_is_interpolated_between_times():
    faces = {"leaf": np.array([[[1.0, -4.0], [-1.0, 2.0]], [[3.0, 0.0], [-5.0, 2.0]]])}
    field = StressField(np.array([0.0, 2.0]), {"leaf": np.array([0.0, 1.0])}, faces)
    assert field.largest == 5.0
    assert field.at(-1.0)["leaf"].tolist() == [[1.0, -4.0], [-1.0, 2.0]]
    assert field.at(1.0)["leaf"].tolist() == [[2.0, -2.0], [-3.0, 2.0]]
    assert field.at(9.0)["leaf"].tolist() == [[3.0, 0.0], [-5.0, 2.0]]


def test_a_result_without_all_sections_is_rejected(tmp_path, capsys):
    (tmp_path / "r.csv").write_text("time\n0\n1\n", encoding="utf-8")
    arguments = ["animate", str(tmp_path / "r.csv"), str(tmp_path / "o.gif"), "--stress"]
    assert cli.main([*arguments, "--model", "GuideBeam"]) == cli.MISTAKE
    assert "--stress: a result has no stress in all sections" in capsys.readouterr().err
