"""Contact stiffness, and the force and duration of a hit: closed forms and the engine."""

import math

import pytest

from point_mass import point_mass
from prbm.analysis.contact_hit import first_hit, hertz_stiffness, plate_stiffness
from prbm.base.errors import ParameterError
from prbm.commands.command_line import main
from prbm.hybrid.simulation import Simulation


def test_a_hit_of_hertz_has_the_published_duration_and_force():
    m, k, v = 0.05, 1e10, 0.8
    hit = first_hit(k, 1.5, 1.0, m, v)
    factor = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9) * 1.25**0.4  # 3.218
    assert hit.duration == pytest.approx(factor * (m**2 / (k**2 * v)) ** 0.2, rel=1e-7)
    assert hit.force == pytest.approx(k * (5 * m * v**2 / (4 * k)) ** 0.6, rel=1e-8)
    assert hit.elastic_force == pytest.approx(hit.force, rel=1e-12)


@pytest.mark.parametrize(("e", "ratio"), [(0.6, 0.978), (0.3, 1.223), (0.1, 1.873)])
def test_strong_damping_makes_the_peak(e, ratio):
    hit = first_hit(1e6, 1.0, e, 1e-3, 0.1)
    assert hit.force / hit.elastic_force == pytest.approx(ratio, abs=1e-3)


@pytest.mark.parametrize("n", [1.0, 1.5])
@pytest.mark.parametrize("e", [0.1, 0.6])
def test_a_hit_is_that_of_the_engine(n, e):
    sim = Simulation(point_mass(stiffness=1e8, exponent=n, restitution=e))
    sim.advance(0.0015)
    out = sim.outputs()
    m = 1 / out["stop.point.mobility"]
    hit = first_hit(1e8, n, e, m, out["stop.approach_speed"])
    for name in ("force", "indentation", "duration"):
        output = {"force": "peak_force", "duration": "contact_duration"}.get(name, name)
        assert out[f"stop.{output}"] == pytest.approx(getattr(hit, name), rel=1e-5)


def test_stiffnesses_follow_from_radii_and_materials():
    steel = (200e9, 0.3)
    one = hertz_stiffness(5e-3, math.inf, *steel, steel)
    assert one == pytest.approx(4 / 3 * 200e9 / (2 * 0.91) * math.sqrt(5e-3), rel=1e-12)
    assert hertz_stiffness(10e-3, 10e-3, *steel, steel) == pytest.approx(one, rel=1e-12)
    assert hertz_stiffness(2e-3, -4e-3, *steel, steel) > one / 2
    assert plate_stiffness(10e6, 1e-4, 2e-3) == pytest.approx(5e5)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hertz_stiffness(0.0, 1.0, 1e9, 0.3, (1e9, 0.3)), "radius of 0 m"),
        (lambda: hertz_stiffness(2e-3, -1e-3, 1e9, 0.3, (1e9, 0.3)), "do not touch in a point"),
        (lambda: hertz_stiffness(1e-3, 1e-3, 1e9, 0.6, (1e9, 0.3)), "Poisson's ratio = 0.6"),
        (lambda: plate_stiffness(1e9, 0.0, 1e-3), "area = 0 m2 must be positive"),
        (lambda: first_hit(1e6, 0.5, 0.6, 1.0, 1.0), "exponent = 0.5 must be at least 1"),
        (lambda: first_hit(1e6, 1.0, 0.001, 1.0, 1.0), "restitution = 0.001 must lie between"),
        (lambda: first_hit(1e6, 1.0, 0.6, 0.0, 1.0), "mass = 0 kg must be positive"),
    ],
)
def test_invalid_values_are_rejected(call, message):
    with pytest.raises(ParameterError, match=message):
        call()


def test_the_command_prints_stiffness_and_hit(capsys):
    ball = "contact --radius 5mm --youngs-modulus 200GPa --mass 50g --speed 0.8"
    pad = "contact --thickness 2mm --area 100mm2 --youngs-modulus 10MPa"
    assert main(ball.split()) == 0
    printed = capsys.readouterr().out
    assert "1.03605e+10 N/m^1.5" in printed
    assert "contact duration" in printed
    assert main(pad.split()) == 0
    assert "500000 N/m" in capsys.readouterr().out
    assert main(["contact", "--radius", "5mm"]) == 2
    assert "--youngs-modulus is missing" in capsys.readouterr().err
