"""Stops without a rest speed have one in proportion to the speed of the motion."""

import math

import pytest

from prbm.files.mechanism_file import load, shipped
from prbm.hybrid.rest_speed import of_stops
from prbm.runs.run import simulate

FILE = """
name = "Guide"
title = "Shuttle on two leaves"

[ground]
left = [0, 0]
right = ["50 mm", 0]

[[bodies]]
name = "shuttle"
mass = "20 g"
inertia = "1e-5 kg.m2"
centre = ["25 mm", "30 mm"]
points = {{ left = [0, "30 mm"], right = ["50 mm", "30 mm"] }}

[[flexure_types]]
name = "leaf"
model = "1R"
thickness = "0.2 mm"
width = "5 mm"
youngs_modulus = "200 GPa"
density = 1.0

[[flexures]]
name = "left"
type = "leaf"
start = "ground.left"
end = "shuttle.left"

[[flexures]]
name = "right"
type = "leaf"
start = "ground.right"
end = "shuttle.right"

[[stops]]
name = "stop"
body = "shuttle"
point = "shuttle.right"
position = "{wall} m"
{rest}

[release]
body = "shuttle"
displacement = "{displacement} m"
velocity = "{velocity} m/s"
"""


@pytest.fixture
def guide(tmp_path):
    """Return a function that reads a guide with given values."""

    def read(displacement=0.0, wall=0.0, velocity=0.0, rest=""):
        path = tmp_path / "guide.toml"
        path.write_text(FILE.format(**locals()), encoding="utf-8")
        return load(path)

    return read


@pytest.mark.parametrize("engine", ["kernel", "python"])
def test_a_motion_a_thousand_times_smaller_has_the_same_impacts(guide, engine):
    """Small vibrations are linear: all speeds, and the rest speed, are in proportion."""
    large, small = (
        simulate(guide(-size, -0.1 * size), stop_time=0.5, engine=engine) for size in (1e-4, 1e-7)
    )
    times = [[impact.time for impact in result.impacts] for result in (large, small)]
    assert len(times[0]) > 8
    assert times[1] == pytest.approx(times[0], rel=1e-4)
    assert small["stop.contact"][-1] == large["stop.contact"][-1] == 1


def test_the_rest_speed_is_a_thousandth_of_frequency_times_amplitude(guide):
    """Of 1 mm: two leaves 12 EI/L^3 on a mass of 20 g."""
    stiffness = 2 * 12 * 200e9 * (5e-3 * 0.2e-3**3 / 12) / 30e-3**3
    speed = 1e-3 * math.sqrt(stiffness / 20e-3) * 1e-3
    swinging = guide(displacement=-1e-3).stops[0].rest_speed
    assert swinging == pytest.approx(speed, rel=0.1)
    assert guide(displacement=-1e-4).stops[0].rest_speed == pytest.approx(0.1 * swinging, rel=1e-5)
    assert guide(wall=1e-3).stops[0].rest_speed == pytest.approx(swinging, rel=1e-5)


def test_a_faster_velocity_at_the_release_is_the_typical_speed(guide):
    assert guide(velocity=7.0).stops[0].rest_speed == 7e-3


def test_a_wall_out_of_reach_does_not_change_the_rest_speed(guide):
    assert guide(-1e-4, wall=1.0).stops[0].rest_speed == guide(-1e-4).stops[0].rest_speed


def test_a_stop_that_touches_at_rest_has_a_rest_speed(guide):
    assert guide().stops[0].rest_speed > 0.0


def test_a_given_rest_speed_is_kept(guide):
    assert guide(-1e-4, rest="rest_speed = 0.0").stops[0].rest_speed == 0.0


def test_a_mechanism_that_cannot_be_released_is_read(guide):
    """Its simulation reports the reason."""
    assert guide(displacement=-0.5).stops[0].rest_speed == 1e-3


@pytest.mark.parametrize("name", sorted(shipped()))
def test_shipped_mechanisms_state_their_rest_speeds(name):
    """They are between a fifth and five times the computed ones."""
    mechanism = load(name)
    assert {stop.rest_speed for stop in mechanism.stops} == {1e-3}
    assert all(2e-4 <= speed <= 5e-3 for speed in of_stops(mechanism))
