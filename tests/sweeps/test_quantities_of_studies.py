"""Quantities of studies against the closed form of the 1R guide, event by event.

Without gravity and damping the angle phi of the guide is harmonic between impacts.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from prbm.references.scalar_guide import ScalarGuide
from prbm.runs.engine import simulation
from prbm.runs.run import sampled, simulate
from prbm.sweeps.study import study

END = 1.5  # s, about seven periods.
FREE = {"gravity.x": 0.0, "gravity.y": 0.0, "damping.beta": 0.0}
NAMES = [
    "impacts", "last_impact", "impact_speed", "impulse", "max(stop.approach_speed)",
    "max(shuttle.vx)", "min(shuttle.vx)", "mean(shuttle.vx)", "shuttle.x", "energy_lost",
]  # fmt: skip


@dataclass
class Bounces:
    """The impacts of a released guide on a wall at a position, one after another."""

    guide: ScalarGuide
    release: float
    wall: float
    restitution: float
    times: list[float] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    fastest: list[float] = field(default_factory=list)
    near: bool = False

    def __post_init__(self) -> None:
        r, k, mass = self.guide.r, self.guide.k, self.guide.mass
        omega = math.sqrt(4.0 * k / (mass * r * r))
        start, wall = math.asin(self.release / r), math.asin(self.wall / r)
        t = math.acos(wall / start) / omega
        rate = omega * math.sqrt(start**2 - wall**2)
        self.fastest.append(self._peak(omega, abs(start)) if wall > 0.0 else 0.0)
        while t < END:
            speed = r * math.cos(wall) * rate
            self.near |= abs(t - END) < 1e-4 or abs(speed - 1e-3) < 1e-5
            if speed < 1e-3 and wall < 0.0:
                break
            self.times.append(t)
            self.speeds.append(speed)
            rate *= self.restitution
            angle = math.atan2(rate / omega, wall)
            t += (2.0 * math.pi - 2.0 * angle) / omega
            # Backwards, the guide passes its straight shape only if the wall is beyond it.
            amplitude = math.hypot(wall, rate / omega)
            passes = wall > 0.0 and self.times[-1] + (0.5 * math.pi - angle) / omega < END
            self.fastest.append(self._peak(omega, amplitude) if passes else 0.0)

    def _peak(self, omega: float, amplitude: float) -> float:
        """Return the largest speed along x of a free swing."""
        phi = np.linspace(-amplitude, amplitude, 20001)
        speed = self.guide.r * np.cos(phi) * omega * np.sqrt(amplitude**2 - phi**2)
        return float(speed.max())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_no_impact_is_missed_in_random_runs(mechanisms, seed):
    """A hundred walls before and behind the straight shape, with 60 samples in a period."""
    check(mechanisms["PRBDM"], 100, seed)


def test_no_impact_is_missed_in_some_runs(mechanisms):
    check(mechanisms["PRBDM"], 12, 17)


def check(guide, runs: int, seed: int) -> None:
    vary = {
        "stop.position": (-8e-3, 8e-3), "stop.restitution": (0.2, 0.9),
        "release.displacement": (-18e-3, -10e-3),
    }  # fmt: skip
    found = study(
        guide, vary, NAMES, runs=runs, method="random", seed=seed, values=FREE, stop_time=END,
        step=END / 400, tolerance=1e-11, workers=1,
    )  # fmt: skip
    scalar = ScalarGuide.of({**guide.values(), **FREE})
    columns = {name: x.tolist() for name, x in found.outputs.items()}
    assert found.messages == ("",) * runs
    seen = 0
    for k, (wall, restitution, release) in enumerate(found.points.tolist()):
        exact = Bounces(scalar, release, wall, restitution)
        if exact.near:
            continue
        seen += 1
        got = {name: x[k] for name, x in columns.items()}
        assert got["impacts"] == len(exact.times)
        assert got["last_impact"] == pytest.approx(exact.times[-1], abs=1e-6)
        first = exact.speeds[0]
        mass = scalar.mass / (1.0 - (wall / scalar.r) ** 2)  # Along x, M / cos^2 phi.
        for name in ("impact_speed", "max(stop.approach_speed)"):
            assert got[name] == pytest.approx(first, rel=1e-6)
        assert got["impulse"] == pytest.approx(mass * (1 + restitution) * first, rel=1e-6)
        # Extremes: at the impacts to the tolerance, between samples to the error of the parabola.
        assert got["max(shuttle.vx)"] == pytest.approx(max(first, *exact.fastest), rel=1e-3)
        assert -got["min(shuttle.vx)"] == pytest.approx(
            max(restitution * first, *exact.fastest[1:]), rel=1e-3
        )
        # The integral of the velocity is the way; an impact between samples does not disturb it.
        way = got["shuttle.x"] - release
        assert END * got["mean(shuttle.vx)"] == pytest.approx(way, abs=5e-5)
        lost = 0.5 * mass * (1 - restitution**2) * sum(v * v for v in exact.speeds)
        assert got["energy_lost"] == pytest.approx(lost, rel=1e-3)
    assert seen > 0.9 * runs


@pytest.mark.parametrize("engine", ["kernel", "python"])
def test_extremes_see_the_impacts_between_samples_of_driven_motions(mechanisms, engine):
    """A step of the force F drives the guide from rest to the wall, where it is fastest.

    M r^2 phi'^2 / 2 = F r sin(phi) - 2 k phi^2.  The samples are 10 ms apart.
    """
    guide, wall, force = mechanisms["PRBDM"], 2e-3, 3.0
    found = study(
        guide, {"stop.restitution": [0.2, 0.3]},
        ["max(shuttle.vx)", "impact_speed", "max(force.x)", "min(force.x)", "stop.position"],
        values={**FREE, "release.displacement": 0.0, "stop.position": wall},
        inputs={"force.x": f"step({force} N, 3 ms)"}, stop_time=0.05, step=0.01, tolerance=1e-10,
        workers=1, engine=engine,
    )  # fmt: skip
    assert found.messages == ("", "")
    scalar = ScalarGuide.of({**guide.values(), **FREE})
    phi = math.asin(wall / scalar.r)
    energy = force * wall - 2.0 * scalar.k * phi**2
    speed = math.cos(phi) * math.sqrt(2.0 * energy / scalar.mass)
    for name in ("max(shuttle.vx)", "impact_speed"):
        assert found.outputs[name] == pytest.approx(speed, rel=1e-6)
    assert found.outputs["max(force.x)"].tolist() == [force] * 2
    assert found.outputs["min(force.x)"].tolist() == [0.0] * 2
    assert found.outputs["stop.position"].tolist() == [wall] * 2


def test_driven_motions_have_the_numbers_of_a_simulation(mechanisms):
    """The outputs of a study are those of the simulation with the same inputs, bit by bit."""
    mechanism, inputs = mechanisms["PRBDM2R"], {"base.acceleration.x": "half-sine(30 g, 2 ms)"}
    result = simulate(mechanism, inputs=inputs, stop_time=0.1, step=1e-3)
    names = ["shuttle.x", "stop.impulse", *inputs]
    columns, impacts = sampled(mechanism, {}, names, inputs=inputs, stop_time=0.1, step=1e-3)
    assert len(impacts) == len(result.impacts) > 0
    for name in ("time", *names):
        assert columns[name].tolist() == result[name].tolist()


def test_static_quantities_need_no_simulation(mechanisms, monkeypatch):
    """The equation of the guide is linear in phi: f = sqrt(k_x / M) / 2 pi and x = r sin(phi)."""
    guide = mechanisms["PRBDM"]
    monkeypatch.setattr("prbm.sweeps.mechanism.sampled", None)
    found = study(
        guide, {"flexure.thickness": [0.08e-3, 0.1e-3, 0.12e-3]},
        ["fundamental", "mode(1)", "rest(shuttle.x)"], values={"gravity.x": 0.0}, workers=1,
    )  # fmt: skip
    for thickness, f, first, x in zip(*found.points.T, *found.outputs.values(), strict=True):
        scalar = ScalarGuide.of({**guide.values(), "flexure.thickness": thickness})
        assert f == first == pytest.approx(scalar.frequency, rel=1e-9)
        assert x == pytest.approx(0.0, abs=1e-12)
    assert found.units["fundamental"] == "Hz"
    assert found.units["rest(shuttle.x)"] == "m"


def test_central_differences_of_the_kernel_have_five_digits(mechanisms):
    """The speed at the straight shape is phi_0 r omega, with omega^2 proportional to h^3.

    The mass of the flexures, proportional to h, is part of the moving mass M: v ~ h^1.5 M^-0.5.
    """
    guide, h, step = mechanisms["PRBDM"], 0.1e-3, 1e-4
    found = study(
        guide, {"flexure.thickness": [h * (1 - step), h * (1 + step)]}, ["impact_speed"],
        values=FREE, stop_time=0.1, tolerance=1e-11, workers=1,
    )  # fmt: skip
    low, high = found.outputs["impact_speed"]
    scalar = ScalarGuide.of({**guide.values(), **FREE})
    flexures = scalar.mass - guide.values()["shuttle.mass"]
    omega = 2.0 * math.pi * scalar.frequency
    speed = omega * scalar.r * math.asin(guide.values()["release.displacement"] / -scalar.r)
    exact = speed / h * (1.5 - 0.5 * flexures / scalar.mass)
    assert (high - low) / (2.0 * h * step) == pytest.approx(exact, rel=1e-6)


def test_the_estimate_of_an_unfinished_settling_is_near_the_settling_time(mechanisms):
    """Damping 2 zeta omega: the energy is 1e-4 of the start after ln(1e4) / (2 zeta omega)."""
    values = {**FREE, "damping.zeta": 0.02, "stop.position": 0.03, "release.displacement": -0.002}
    outputs = ["settling", "settling_estimate"]
    vary = {"stop.restitution": [0.5, 0.6]}
    short, long = (
        study(mechanisms["PRBDM"], vary, outputs, values=values, stop_time=end, workers=1).outputs
        for end in (2.0, 12.0)
    )
    assert math.isnan(short["settling"][0])
    assert long["settling"][0] == long["settling_estimate"][0]
    assert short["settling_estimate"][0] == pytest.approx(long["settling"][0], rel=0.03)


def test_samples_do_not_change_the_motion(mechanisms):
    """Final values have the same bits, whether the motion is sampled at its impacts or not."""
    guide = mechanisms["PRBDM2R"]
    motion = simulation(guide)
    motion.advance(0.3)
    vary = {"stop.restitution": [0.5, 0.6]}
    for outputs in (["shuttle.x"], ["shuttle.x", "max(shuttle.vx)"]):
        found = study(guide, vary, outputs, stop_time=0.3, workers=1)
        assert found.outputs["shuttle.x"][1] == motion.outputs()["shuttle.x"]
