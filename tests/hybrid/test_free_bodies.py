"""Bodies that nothing connects to the ground: flight, impacts, rest, and what they exclude."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from free_bodies import ball, flying, pendulum, row_of_balls
from prbm.base.errors import MechanismError, ParameterError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.assembly import assemble
from prbm.mechanics.modal import modes
from prbm.mechanics.statics import equilibrium
from prbm.mechanism.parts import Body, Joint, Release, Stop
from prbm.runs.engine import simulation as started
from support import energy_balance

engines = pytest.mark.parametrize(
    "engine", ["python", pytest.param("kernel", marks=pytest.mark.native)]
)
G = 9.81


def advanced(mechanism, engine, times, values=None, **options):
    """Yield the outputs of an engine at times [s]."""
    sim = started(mechanism, values or {}, engine=engine, **options)
    for t in times:
        sim.advance(float(t))
        yield sim.outputs()


@engines
def test_a_ball_bounces_as_in_closed_form_and_rests(engine):
    """Impact k is at t_1 (1 + 2 sum of eps^i), with the closing speed g t_1 eps^k.

    The last bounces, below the speed of rest, are left out: the ball rests up to
    2 eps v/(g (1 - eps)) before the limit of the times.
    """
    eps, first = 0.7, math.sqrt(2.0 / G)
    times = first * (1 + 2 * np.cumsum([0.0, *(eps**k for k in range(1, 12))]))
    outputs = advanced(ball(eps), engine, [*(times + 1e-6), 4.0])
    for k, (t, out) in enumerate(zip(times, outputs, strict=False)):
        assert out["floor.impact_count"] == k + 1
        assert out["floor.impact_time"] == pytest.approx(t, abs=1e-9)
        assert out["floor.approach_speed"] == pytest.approx(G * first * eps**k, abs=1e-9)
    *_, last = advanced(ball(eps), engine, [4.0])
    assert last["floor.contact"]
    assert last["floor.force"] == pytest.approx(G)
    assert last["base.force.y"] == pytest.approx(-G)
    assert last["energy.dissipated"] == pytest.approx(G)
    limit = first * (1 + eps) / (1 - eps)
    assert 0.0 < limit - last["floor.impact_time"] < 4 * 1e-3 / (G * (1 - eps)) + 1e-3


def reference_ball(times, eps=0.7, least=0.1):
    """Return height and velocity of the BouncingBall of the Reference FMUs in closed form.

    Its impacts are ``h = 0, v = -eps v``; a rebound below ``least`` [m/s] ends the motion.
    """
    start, h, v, moving = 0.0, 1.0, 0.0, True
    for t in times:
        while moving and t >= (hit := start + (v + math.sqrt(v * v + 2.0 * G * h)) / G):
            start, h, v = hit, 0.0, eps * (G * (hit - start) - v)
            moving = v >= least
        s = t - start
        yield (h + v * s - G * s * s / 2, v - G * s) if moving else (0.0, 0.0)


@engines
def test_the_ball_of_the_reference_fmus_has_the_same_heights_and_velocities(engine):
    """The least rebound of 0.1 m/s is a closing speed of 0.1/0.7 m/s."""
    (floor,) = ball().stops
    like = ball(stops=(replace(floor, rest_speed=0.1 / 0.7),))
    times = np.linspace(0.0, 3.0, 301)
    rested = 0
    for (h, v), out in zip(reference_ball(times), advanced(like, engine, times), strict=True):
        assert 1.0 + out["ball.y"] == pytest.approx(h, abs=1e-9)
        assert out["ball.vy"] == pytest.approx(v, abs=1e-9)
        rested += out["floor.contact"]
    assert rested > 50


@engines
def test_a_projectile_flies_on_a_parabola_through_its_drawn_place_and_far_away(engine):
    """The displacement passes through zero, where polar coordinates would be singular."""
    thrown = ball(stops=(), release=Release("ball", 60.0, displacement=-2.0, velocity=10.0))
    u = np.exp(1j * np.pi / 3)
    times = np.linspace(0.0, 30.0, 8)
    for t, out in zip(times, advanced(thrown, engine, times), strict=True):
        place = (10.0 * t - 2.0) * u - 0.5j * G * t**2
        assert complex(out["ball.x"], out["ball.y"]) == pytest.approx(place, rel=1e-11, abs=1e-11)
        velocity = 10.0 * u - 1j * G * t
        assert complex(out["ball.vx"], out["ball.vy"]) == pytest.approx(velocity, rel=1e-11)
        assert out["ball.omega"] == 0.0
        assert energy_balance(out) == pytest.approx(50.0 - G * math.sin(math.pi / 3) * 2.0)


@engines
@pytest.mark.parametrize("ratio", [0.1, 1.0, 3.0, 100.0])
@pytest.mark.parametrize("restitution", [1.0, 0.5, 0.0])
def test_two_balls_exchange_momentum_by_newtons_law(engine, ratio, restitution):
    pair = row_of_balls((1.0, ratio), restitution)
    (out,) = advanced(pair, engine, [0.2])
    v = (1.0 - restitution * ratio) / (1.0 + ratio)
    assert out["ball0.vx"] == pytest.approx(v, abs=1e-9)
    assert out["ball1.vx"] == pytest.approx(v + restitution, abs=1e-9)
    assert out["ball0.x"] == pytest.approx(0.1 + 0.1 * v, abs=1e-9)
    assert out["energy.dissipated"] == pytest.approx(
        0.5 * (1 - restitution**2) * ratio / (1 + ratio), abs=1e-9
    )


@engines
def test_a_row_of_separated_equal_balls_passes_the_velocity_on(engine):
    (out,) = advanced(row_of_balls((1.0,) * 4), engine, [0.35])
    assert [out[f"ball{k}.vx"] for k in range(4)] == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-9)


@engines
@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_balls_that_touch_are_struck_one_after_the_other_as_balls_close_together(
    engine, restitution
):
    """Newton's law alone does not determine the motion of balls in contact."""
    touching, close = (
        next(advanced(row_of_balls((1.0,) * 3, restitution, gaps), engine, [0.02]))
        for gaps in (0.0, 1e-6)
    )
    for k in range(3):
        assert touching[f"ball{k}.vx"] == pytest.approx(close[f"ball{k}.vx"], abs=1e-9)
    assert sum(touching[f"ball{k}.vx"] for k in range(3)) == pytest.approx(1.0)


@engines
@pytest.mark.parametrize("degrees", [0.0, 37.0])
@pytest.mark.parametrize("gaps", [0.0, 0.1])
@pytest.mark.parametrize("masses", [(1.0, 1.0, 1.0), (2.0, 0.3, 1.0, 5.0, 0.7)])
def test_balls_without_restitution_move_on_together(engine, masses, gaps, degrees):
    """Their velocity is that of the centre of mass; each contact is struck at most once.

    A ball that is struck pushes the one that it touches, so that no contact chatters.
    """
    row = row_of_balls(masses, 0.0, gaps, degrees)
    *_, last = advanced(row, engine, [1.0, 2.0, 20.0])
    u, common = np.exp(1j * np.radians(degrees)), masses[0] / sum(masses)
    for k in range(len(masses)):
        velocity = complex(last[f"ball{k}.vx"], last[f"ball{k}.vy"])
        assert velocity == pytest.approx(common * u, abs=1e-9)
    for k in range(len(masses) - 1):
        assert last[f"hit{k}.gap"] == pytest.approx(0.0, abs=1e-9)
        assert last[f"hit{k}.impact_count"] <= 1
        assert last[f"hit{k}.impulse_sum"] == pytest.approx(common * sum(masses[k + 1 :]))
    lost = 0.5 * masses[0] * (1.0 - common)
    assert last["energy.dissipated"] == pytest.approx(lost)


@engines
def test_a_ball_that_sticks_to_its_neighbour_passes_the_impact_on(engine):
    """The first contact has restitution 0.5, the second one none: impacts follow each other."""
    row = row_of_balls((1.0, 1.0, 1.0), 0.5, 0.0)
    mixed = replace(row, stops=(row.stops[0], replace(row.stops[1], restitution=0.0)))
    (out,) = advanced(mixed, engine, [0.1])
    assert [out[f"ball{k}.vx"] for k in range(3)] == pytest.approx([0.25, 0.375, 0.375], abs=1e-12)


@engines
@pytest.mark.parametrize("angle", [0.1, 1.0, 2.5, 3.1])
def test_a_pendulum_without_flexures_has_the_period_of_the_elliptic_integral(engine, angle):
    """The period is 4 K(sin^2(a/2))/omega, with omega^2 = m g l/(J + m l^2)."""
    m, l, J = 0.5, 0.3, 2e-3
    omega = math.sqrt(m * G * l / (J + m * l**2))
    period = 4 * ellipk(math.sin(angle / 2) ** 2) / omega
    swing = pendulum(angle, l, J)
    quarter, half, full = advanced(swing, engine, [period / 4, period / 2, period], tolerance=1e-11)
    assert quarter["bob.angle"] == pytest.approx(0.0, abs=1e-6)
    assert half["bob.angle"] == pytest.approx(-angle, abs=1e-6)
    assert full["bob.angle"] == pytest.approx(angle, abs=1e-6)
    assert full["mode.frequency"] == pytest.approx(omega / (2 * math.pi))


def double_pendulum(swing, times, m=(0.5, 0.3), J=(2e-3, 7e-4), l=0.3, c=(0.2, 0.15)):
    """Return the angles of two bodies on pins, (2, k), by Lagrange's equations [rad].

    The first body has its mass at the distance c[0] from its pin, and the second pin at l.
    """
    couple = m[1] * l * c[1]
    M = np.diag([J[0] + m[0] * c[0] ** 2 + m[1] * l**2, J[1] + m[1] * c[1] ** 2])
    weight = G * np.array([m[0] * c[0] + m[1] * l, m[1] * c[1]])

    def rate(_, y):
        (a, b), v = y[:2], y[2:]
        M[0, 1] = M[1, 0] = couple * math.cos(a - b)
        turned = couple * math.sin(a - b) * np.array([-(v[1] ** 2), v[0] ** 2])
        return [*v, *np.linalg.solve(M, turned - weight * np.sin(y[:2]))]

    start = [*swing, 0.0, 0.0]
    found = solve_ivp(rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13)
    return found.y[:2]


@engines
def test_a_double_pendulum_moves_as_lagranges_equations_require(engine):
    """Released with the lower body held; the upper one hangs in equilibrium beside it."""
    bodies = (
        Body("upper", 0.5, 2e-3, (0.0, -0.2), {"pin": (0.0, 0.0), "low": (0.0, -0.3)}),
        Body("lower", 0.3, 7e-4, (0.0, -0.45), {"pin": (0.0, -0.3)}),
    )
    chain = replace(
        pendulum(0.0), bodies=bodies, release=Release("lower", angle=2.0),
        joints=(
            Joint("pin", "ground.pin", "upper.pin"), Joint("elbow", "upper.low", "lower.pin"),
        ),
    )  # fmt: skip
    times = np.linspace(0.0, 2.0, 21)
    outputs = [*advanced(chain, engine, times, tolerance=1e-11)]
    start = [outputs[0][f"{name}.angle"] for name in ("upper", "lower")]
    assert start == pytest.approx([0.0, 2.0], abs=1e-9)
    expected = double_pendulum(start, times)
    for name, angles in zip(("upper", "lower"), expected, strict=True):
        found = [out[f"{name}.angle"] for out in outputs]
        np.testing.assert_allclose(found, angles, atol=1e-6)
    assert np.ptp(expected[0]) > 0.5


@engines
def test_a_free_mechanism_conserves_momentum_while_its_parts_vibrate(engine):
    """The centre of mass of plate and tip falls on a parabola; their angular momentum is kept."""
    alone = replace(flying(), stops=(), frictions=(), release=Release("tip", 40.0, 3e-3))
    masses = {body.name: body for body in alone.bodies}
    parts = [masses["plate"], masses["tip"]]
    g = complex(*alone.gravity)
    soft = (replace(k, density=50.0, youngs_modulus=1e7, axial=False) for k in alone.flexure_types)
    light = replace(alone, flexure_types=tuple(soft))

    def momentum(out, t):
        total, spin = 0j, 0.0
        for body in parts:
            v = complex(out[f"{body.name}.vx"], out[f"{body.name}.vy"]) - g * t
            z = complex(*body.centre) + complex(out[f"{body.name}.x"], out[f"{body.name}.y"])
            z -= 0.5 * g * t**2
            total += body.mass * v
            spin += body.mass * (z.conjugate() * v).imag + body.inertia * out[f"{body.name}.omega"]
        return total, spin

    times = np.linspace(0.0, 0.01, 4)
    rotation = []
    for t, out in zip(times, advanced(light, engine, times, tolerance=1e-10), strict=True):
        total, spin = momentum(out, t)
        assert abs(total) < 1e-3 * 0.05  # The leaf has 2e-4 of the mass.
        assert abs(spin) < 1e-3 * 0.05 * 0.1
        rotation.append(out["tip.omega"])
    assert max(map(abs, rotation)) > 0.05  # The parts do vibrate.


def test_free_bodies_are_placed_where_they_are_drawn_and_take_no_part_in_modes():
    """Their equilibrium and frequencies are those of the rest of the mechanism, alone."""
    both = flying()
    alone = replace(
        both, bodies=both.bodies[:1], flexures=both.flexures[:1], stops=(), frictions=(),
        forces=(), probes=(), release=Release("stage"), flexure_types=both.flexure_types[:1],
    )  # fmt: skip
    one, other = (assemble(m, m.values()) for m in (alone, both))
    rest, held = equilibrium(one), equilibrium(other)
    by_name = dict(zip((x for x, _ in other.variables), held.q, strict=True))
    for (name, _), x in zip(one.variables, rest.q, strict=True):
        assert by_name[name] == pytest.approx(x, abs=1e-11)
    assert not held.q[other.placed].any()
    frequencies = modes(other, held).frequency
    for f in modes(one, rest).frequency:
        assert np.abs(frequencies / f - 1).min() < 1e-9
    assert len(frequencies) == other.n - len(other.loops) - 6


def test_a_released_free_body_is_displaced_or_turned():
    turned = Simulation(ball(release=Release("ball", angle=2.0))).outputs()
    assert (turned["ball.x"], turned["ball.y"], turned["ball.angle"]) == (0.0, 0.0, 2.0)
    moved = Simulation(ball(release=Release("ball", 90.0, displacement=0.5))).outputs()
    assert (moved["ball.x"], moved["ball.y"]) == pytest.approx((0.0, 0.5))


def test_the_scale_of_lengths_comes_from_the_drawing_or_is_the_radius_of_gyration():
    lone = ball(bodies=(Body("ball", 2.0, 0.5, (0.0, 1.0)),))
    assert assemble(lone, lone.values()).length == 0.5  # All points coincide.
    near = ball(ground={"floor": (0.0, 0.75)})
    assert assemble(near, near.values()).length == 0.25
    far = ball(stops=(Stop("floor", "ball", (0.0, 0.7), -90.0, 0.7),))
    assert assemble(far, far.values()).length == pytest.approx(0.3)


@engines
def test_results_do_not_depend_on_the_scale_of_lengths(engine):
    """Half the drawing, gravity and speeds: half the displacements, at the same times."""
    large, small = (
        row_of_balls((1.0, 2.0)) if s == 1.0 else replace(
            row_of_balls((1.0, 2.0)),
            bodies=tuple(
                Body(b.name, b.mass, b.inertia * s**2, (s * b.centre[0], 0.0))
                for b in row_of_balls((1.0, 2.0)).bodies
            ),
            stops=tuple(
                replace(stop, point=(s * stop.point[0], 0.0), position=s * stop.position)
                for stop in row_of_balls((1.0, 2.0)).stops
            ),
            release=Release("ball0", velocity=s),
        )
        for s in (1.0, 1e-5)
    )  # fmt: skip
    (one,), (other,) = (advanced(m, engine, [0.3]) for m in (large, small))
    for name in ("ball0.x", "ball1.x", "ball0.vx", "ball1.vx"):
        assert other[name] == pytest.approx(1e-5 * one[name], rel=1e-9)


def test_damping_in_proportion_to_mass_is_rejected_with_free_bodies():
    with pytest.raises(
        MechanismError, match=r"damping_zeta = 0\.01: .* flight of ball, .* use damping_beta"
    ):
        ball(damping_zeta=0.01)
    with pytest.raises(ParameterError, match=r"damping\.zeta"):
        ball().values({"damping.zeta": 0.01})


def test_a_pendulum_that_hangs_on_a_free_body_is_free_too():
    hanging = ball(
        bodies=(
            Body("ball", 1.0, 1.0, (0.0, 1.0), {"pin": (0.0, 1.0)}),
            Body("bob", 1.0, 1.0, (0.0, 0.5), {"pin": (0.0, 1.0)}),
        ),
        joints=(Joint("pin", "ball.pin", "bob.pin"),),
        stops=(),
    )
    assert hanging.free_bodies == ("ball", "bob")
    assert assemble(hanging, hanging.values()).n == 4
