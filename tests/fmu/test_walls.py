"""The laws of moving walls in FMUs, for all interfaces (prbm.hybrid.walls)."""

import itertools
import math

import numpy as np
import pytest

from fmu_host import Instance as PythonInstance
from native_host import OK, Instance, Integrator
from prbm.systems.cosimulation import simulate
from support import energy_balance, simulation

CO_SIMULATIONS = [(2, "cs"), (3, "cs"), (3, "events"), (3, "late")]
"""Versions and interfaces of co-simulation with native FMUs."""
every_co_simulation = pytest.mark.parametrize(("fmi", "kind"), [("python", "cs"), *CO_SIMULATIONS])
every_interface = pytest.mark.parametrize(
    ("fmi", "kind"), [("python", "cs"), *CO_SIMULATIONS, (2, "me"), (3, "me")]
)
PRESSED = {"release.displacement": 0.0}
AMPLITUDE, RATE = 1e-3, 10 * math.pi

pytestmark = [pytest.mark.fmu, pytest.mark.native]


def sine(t):
    return {
        "stop.displacement": AMPLITUDE * math.sin(RATE * t),
        "stop.velocity": AMPLITUDE * RATE * math.cos(RATE * t),
    }


def points(end, longest=2e-2):
    """Return communication points at random distances from 1 us up."""
    rng, found = np.random.default_rng(7), [0.0]
    while found[-1] < end:
        found.append(found[-1] + float(np.exp(rng.uniform(math.log(1e-6), math.log(longest)))))
    return found


class Guide(PythonInstance):
    """An instance of a Python FMU with the methods of a native instance."""

    time = 0.0

    def initialize(self, *, values):
        return super().initialize(**{name.replace(".", "__"): x for name, x in values.items()})

    def set(self, values):
        super().set(values)
        return OK

    def advance(self, end):
        assert self.step(self.time, end - self.time) == OK
        self.time = end

    def saved(self):
        state = self.fmu.getFMUState()
        data = self.fmu.serializeFMUstate(state)
        self.fmu.freeFMUState(state)
        return data

    def restore(self, data):
        state = self.fmu.deSerializeFMUstate(data)
        self.fmu.setFMUState(state)
        self.fmu.freeFMUState(state)

    def reset(self):
        self.fmu.reset()
        self.time = 0.0


@pytest.fixture
def opened(fmus, native):
    """Return a function that instantiates an FMU of a model, version and interface."""

    def instance(model, fmi, kind):
        return Guide(fmus[model]) if fmi == "python" else Instance(native[model, fmi], kind)

    return instance


AWAY = {"release.displacement": 0.0, "gravity.x": 0.0, "stop.position": 0.01}
"""Values for a shuttle at rest, with the wall out of reach."""


def place(found):
    """Return the displacement of the wall, up to a constant [m]."""
    return found["stop.gap"] + found["stop.point.displacement"]


@pytest.mark.slow
@every_co_simulation
@pytest.mark.parametrize("longest", [1e-3, 1e-2])
def test_a_wall_is_within_twice_the_acceleration_times_the_step_squared(opened, fmi, kind, longest):
    grid = points(0.25, longest)
    with opened("PRBDM", fmi, kind).initialize(values=AWAY) as instance:
        begin = place(instance.values())
        for t, end in itertools.pairwise(grid):
            assert instance.set(sine(t)) == OK
            instance.advance(end)
            if t > 6 * longest and end - t > 0.1 * longest:
                off = place(instance.values()) - begin - sine(end)["stop.displacement"]
                assert abs(off) < 2 * AMPLITUDE * RATE**2 * longest**2


@every_co_simulation
def test_position_error_of_a_wall_after_a_jump_is_at_most_the_jump(opened, fmi, kind):
    jump = -1e-3
    with opened("PRBDM", fmi, kind).initialize(values=AWAY) as instance:
        begin = place(instance.values())
        for t, end in itertools.pairwise(points(0.15)):
            given = jump if t > 0.05 else 0.0
            assert instance.set({"stop.displacement": given}) == OK
            instance.advance(end)
            off = place(instance.values()) - begin - given
            assert abs(off) <= abs(jump) * (1 + 1e-9)
    assert off == pytest.approx(0.0, abs=1e-12)


class Driven(Integrator):
    """An integrator that sets a wall at each evaluation.

    ``motion(t)`` returns the inputs; ``happened(t, values)`` receives the outputs in an event, and
    returns whether it has changed the motion.
    """

    def __init__(self, instance, motion, happened=lambda t, values: False):
        super().__init__(instance)
        self.motion, self.happened, self.now = motion, happened, instance.time
        instance.update = self.update

    def put(self, time, x):
        super().put(time, x)
        self.now = time
        self.it.set(self.motion(time))

    def update(self):
        again = True
        while again:
            again = self.it.function("newDiscreteStates", "updateDiscreteStates")()[0]
            if self.happened(self.now, self.it.values()):
                self.it.set(self.motion(self.now))
                again = True
        self.fmu.enterContinuousTimeMode()


@pytest.mark.parametrize("fmi", [2, 3])
def test_in_model_exchange_uniform_motion_is_followed_exactly(native, fmi):
    distance, speed = 5e-3, -0.1
    values = AWAY | {"stop.position": distance, "stop.velocity": speed}
    with Instance(native["PRBDM", fmi], "me", substep=2e-3) as instance:
        instance.initialize(values=values)
        motion = lambda t: {"stop.displacement": speed * t, "stop.velocity": speed}  # noqa: E731
        Driven(instance, motion).advance(0.051)
        found = instance.values()
    assert found["stop.impact_count"] == 1
    assert found["stop.impact_time"] == pytest.approx(-distance / speed, abs=1e-9)
    assert found["stop.approach_speed"] == pytest.approx(-speed, rel=1e-9)


def impact_time(instance, kind, motion, step):
    """Return the time at which a moving wall hits a shuttle at rest [s]."""
    instance.initialize(values=AWAY | {"stop.position": 2e-3} | motion(0.0))
    k = 0
    while not (found := instance.values())["stop.impact_count"]:
        if kind == "me":
            Driven(instance, motion).advance((k + 1) * step)
        else:
            assert instance.set(motion(k * step)) == OK
            instance.advance((k + 1) * step)
        k += 1
    return found["stop.impact_time"]


@every_interface
def test_impact_times_of_an_accelerated_wall_converge_with_the_square_of_the_step(
    opened, fmi, kind
):
    """The errors are below 2 a h^2 over the closing speed; in model exchange there are none."""
    acceleration, distance = 1.0, 2e-3

    def motion(t):
        d, v = -acceleration * t**2 / 2, -acceleration * t
        return {"stop.displacement": d, "stop.velocity": v}

    true, errors = math.sqrt(2 * distance / acceleration), []
    for step in (7e-3, 3.5e-3, 1.75e-3):
        with opened("PRBDM", fmi, kind) as instance:
            errors.append(abs(impact_time(instance, kind, motion, step) - true))
        bound = 2 * acceleration * step**2 / (acceleration * true)
        assert errors[-1] < (1e-9 if kind == "me" else bound)
    if kind != "me":
        assert errors[2] < errors[0] / 8


def bounces(instance, step, end=0.16):
    """Return the times of the impacts on a wall whose inputs are set at steps and in events."""
    instance.initialize(values={"stop.velocity": sine(0.0)["stop.velocity"]})
    times = []
    for k in range(round(end / step)):
        if instance.kind == "me":
            Driven(instance, sine).advance((k + 1) * step)
        else:
            assert instance.set(sine(k * step)) == OK
            while instance.time < (k + 1) * step:
                left = (k + 1) * step - instance.time
                event, _, _, instance.time = instance.fmu.doStep(instance.time, left)
                if event:
                    instance.change(sine(instance.time))
        found = instance.values()
        if found["stop.impact_count"] > len(times):
            times.append(found["stop.impact_time"])
    return np.array(times)


def test_times_of_successive_impacts_converge_with_the_square_of_the_step_in_event_mode(native):
    """The velocity of the wall is exact at each impact, so that no error accumulates."""
    with Instance(native["PRBDM", 3], "me") as instance:
        true, errors = bounces(instance, 1e-3), []
    assert len(true) == 3
    for step in (2e-3, 1e-3, 5e-4):
        with Instance(native["PRBDM", 3], "events") as instance:
            errors.append(np.abs(bounces(instance, step) - true).max())
    assert errors[1] / errors[0] == pytest.approx(1 / 4, rel=0.1)
    assert errors[2] / errors[1] == pytest.approx(1 / 4, rel=0.1)


class FreeMass:
    """A partner that moves the wall and receives the impulses."""

    def __init__(self, mobility, speed):
        self.mobility, self.speed = mobility, speed
        self.place = self.since = self.received = 0.0

    def motion(self, t):
        place = self.place + self.speed * (t - self.since)
        return {"stop.displacement": place, "stop.velocity": self.speed}

    def receive(self, t, values):
        """Add the impulses since the last call; return whether there are any."""
        change = self.mobility * (values["stop.impulse_sum"] - self.received)
        self.place, self.since = self.motion(t)["stop.displacement"], t
        self.speed, self.received = self.speed + change, values["stop.impulse_sum"]
        return change != 0.0

    @property
    def energy(self):
        return self.speed**2 / self.mobility / 2


@every_interface
def test_momentum_and_energy_are_exchanged_with_a_free_mass(opened, fmi, kind):
    """The impulse is (1 + eps) u/(W + w); the work of the wall is the energy that the mass loses.

    In a second impact the moving shuttle hits the mass.
    """
    mobility, restitution, speed = 5.0, 0.6, -0.1
    mass = FreeMass(mobility, speed)
    values = AWAY | mass.motion(0.0)
    values |= {"stop.position": 2e-3, "stop.mobility": mobility, "stop.restitution": restitution}
    with opened("PRBDM", fmi, kind) as instance:
        instance.initialize(values=values)
        before, lost = instance.values(), mass.energy
        for k in range(150):
            if kind == "me":
                Driven(instance, mass.motion, mass.receive).advance((k + 1) * 1e-3)
            else:
                assert instance.set(mass.motion(k * 1e-3)) == OK
                instance.advance((k + 1) * 1e-3)
            found = instance.values()
            if kind != "me" and found["stop.impulse_sum"] != mass.received:
                mass.receive(found["stop.impact_time"], found)
            if found["stop.impact_count"] == 1:
                total = before["stop.point.mobility"] + mobility
                expected = (1 + restitution) * -speed / total
                assert found["stop.impulse_sum"] == pytest.approx(expected, rel=1e-9)
    lost -= mass.energy
    assert found["stop.impact_count"] >= 2
    assert found["energy.work"] == pytest.approx(lost, rel=1e-12)
    assert energy_balance(found) == pytest.approx(energy_balance(before), abs=1e-9)
    if kind != "me":
        velocity = found["stop.gap_rate"] + found["stop.point.velocity"]
        assert velocity == pytest.approx(mass.speed, abs=1e-12)


@every_co_simulation
def test_uniform_motion_is_followed_exactly(opened, fmi, kind):
    speed, distance = -0.1, 5e-3
    values = AWAY | {"stop.position": distance, "stop.velocity": speed}
    with opened("PRBDM", fmi, kind) as instance:
        instance.initialize(values=values)
        for t, end in itertools.pairwise(points(0.1)):
            assert instance.set({"stop.displacement": speed * t, "stop.velocity": speed}) == OK
            instance.advance(end)
            found = instance.values()
            if found["stop.impact_count"]:
                break
    assert found["stop.impact_time"] == pytest.approx(-distance / speed, abs=1e-9)
    assert found["stop.approach_speed"] == pytest.approx(-speed, rel=1e-9)


@every_co_simulation
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_a_pressed_body_stays_on_its_wall(opened, model, fmi, kind):
    with opened(model, fmi, kind).initialize(values=PRESSED) as instance:
        count, rested = None, False
        for t, end in itertools.pairwise(points(0.2)):
            assert instance.set(sine(t)) == OK
            instance.advance(end)
            found = instance.values()
            if rested:
                assert found["stop.contact"]
            elif t > 0.05:
                rested = found["stop.contact"]
                count = found["stop.impact_count"]
    assert rested
    assert found["stop.impact_count"] == count
    start = energy_balance(simulation(model, PRESSED).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-9)


@every_co_simulation
def test_work_of_a_wall_under_a_body_is_force_times_velocity_of_the_true_wall(opened, fmi, kind):
    """The difference is within the force times the error of the wall's velocity, a h/4."""
    step, rows = 1e-3, []
    with opened("PRBDM", fmi, kind).initialize(values=PRESSED | sine(0.0)) as instance:
        for k in range(150):
            assert instance.set(sine(k * step)) == OK
            instance.advance((k + 1) * step)
            found = instance.values()
            if k >= 50:
                assert found["stop.contact"]
                velocity = sine((k + 1) * step)["stop.velocity"]
                rows.append((-found["stop.force"] * velocity, found["energy.work"]))
    power, work = np.array(rows).T
    expected = np.sum((power[1:] + power[:-1]) / 2) * step
    bound = found["stop.force"] * AMPLITUDE * RATE**2 * step / 4 * (len(rows) - 1) * step
    assert work[-1] - work[0] == pytest.approx(expected, abs=bound)
    assert abs(expected) > 50 * bound


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("kind", ["events", "late"])
def test_a_pressed_body_stays_on_a_wall_whose_inputs_are_set_in_events(native, kind, inside):
    """In event mode (inside) a velocity acts at once, else from the beginning of the step."""
    with Instance(native["PRBDM", 3], kind).initialize(values=PRESSED) as instance:
        for k in range(200):
            instance.change(sine(k * 1e-3)) if inside else instance.set(sine(k * 1e-3))
            instance.advance((k + 1) * 1e-3)
            if k == 100:
                count = instance.values()["stop.impact_count"]
        found = instance.values()
    assert found["stop.contact"]
    assert found["stop.impact_count"] == count
    assert found["shuttle.x"] == pytest.approx(sine(0.2)["stop.displacement"], abs=2e-6)
    start = energy_balance(simulation("PRBDM", PRESSED).outputs())
    assert energy_balance(found) == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("mobility", [0.0, 5.0])
@pytest.mark.parametrize("speed", [-5e-4, 5e-4, -2e-2])
@pytest.mark.parametrize("kind", ["events", "me"])
def test_a_jump_below_rest_speed_keeps_a_stop_closed_and_is_a_capture(
    native, kind, speed, mobility
):
    """The impulse -speed/(W + w) acts on the body and, by the sum of impulses, on the partner."""
    values = PRESSED | {"stop.mobility": mobility}
    with Instance(native["PRBDM", 3], kind).initialize(values=values) as instance:
        instance.advance(1e-3)
        before = instance.values()
        instance.change({"stop.velocity": speed})
        found = instance.values()
        impulse = found["stop.impulse_sum"] - before["stop.impulse_sum"]
        after = speed + mobility * impulse
        instance.change({"stop.velocity": after})  # The partner returns its new velocity.
        again = instance.values()
    assert again["stop.impulse_sum"] == pytest.approx(found["stop.impulse_sum"], abs=1e-15)
    assert again["shuttle.vx"] == pytest.approx(found["shuttle.vx"], abs=1e-15)
    assert found["stop.contact"] == (abs(speed) < 1e-3)
    assert found["stop.impact_count"] == (abs(speed) >= 1e-3)
    assert energy_balance(found) == pytest.approx(energy_balance(before), abs=1e-12)
    if found["stop.contact"]:
        total = mobility + found["stop.point.mobility"]
        assert impulse == pytest.approx(-speed / total, rel=1e-6)
        assert found["shuttle.vx"] == pytest.approx(after, rel=1e-9)
        work = found["energy.work"] - before["energy.work"]
        assert work == pytest.approx(-impulse * (speed + after) / 2, rel=1e-9)
        lost = found["energy.dissipated"] - before["energy.dissipated"]
        assert lost == pytest.approx(-impulse * speed / 2, rel=1e-6)


def bytes_of_next_steps(instance):
    """Advance by ten steps; return the bytes of the values after each.

    In co-simulation, only displacements are set.  In model exchange, a pressed body follows the
    wall.
    """
    rows = []
    for _ in range(10):
        given = sine(instance.time)
        if getattr(instance, "kind", "cs") != "me":
            del given["stop.velocity"]
        assert instance.set(given) == OK
        instance.advance(instance.time + 1e-3)
        rows.append(instance.bytes())
    return rows


START = {"cs": {}, "events": {}, "late": {}, "me": PRESSED | sine(0.0)}
"""Start values by interface."""


@every_interface
def test_a_state_saved_while_a_wall_joins_its_reference_restores_to_the_same_bytes(
    opened, fmi, kind
):
    with opened("PRBDM", fmi, kind).initialize(values=START[kind]) as instance:
        bytes_of_next_steps(instance)
        data, time = instance.saved(), instance.time
        first = bytes_of_next_steps(instance)
        bytes_of_next_steps(instance)
        instance.restore(data)
        instance.time = time
        assert instance.saved() == data
        assert bytes_of_next_steps(instance) == first


@every_interface
def test_a_reset_forgets_the_motion_of_a_wall(opened, fmi, kind):
    with opened("PRBDM", fmi, kind).initialize(values=START[kind]) as instance:
        first = bytes_of_next_steps(instance)
        instance.reset()
        instance.initialize(values=START[kind])
        assert bytes_of_next_steps(instance) == first


@every_interface
def test_walls_of_two_instances_in_one_process_are_independent(opened, fmi, kind):
    with (
        opened("PRBDM", fmi, kind).initialize(values=START[kind]) as one,
        opened("PRBDM", fmi, kind).initialize(values=START[kind]) as other,
    ):
        first = bytes_of_next_steps(one)
        assert other.set({"stop.velocity": 0.01}) == OK
        other.advance(0.02)
        second = bytes_of_next_steps(one)
    with opened("PRBDM", fmi, kind).initialize(values=START[kind]) as alone:
        assert [bytes_of_next_steps(alone), bytes_of_next_steps(alone)] == [first, second]


@pytest.mark.parametrize("fmi", [2, 3])
def test_in_model_exchange_a_pressed_body_follows_its_wall(native, fmi):
    """The inputs are position and velocity of the wall; changes of its velocity cause events."""
    with Instance(native["PRBDM", fmi], "me", substep=1e-4) as instance:
        instance.initialize(values=PRESSED)
        for k in range(300):
            instance.set(sine(k * 1e-4 + 0.05))
            instance.advance((k + 1) * 1e-4)
            if k == 100:
                count = instance.values()["stop.impact_count"]
        found = instance.values()
    assert found["stop.contact"]
    assert found["stop.impact_count"] == count
    assert abs(found["stop.gap"]) < 1e-5


RESTING = {
    "body.stop.displacement": "carrier.shuttle.x",
    "body.stop.velocity": "carrier.shuttle.vx",
    "carrier.force.x": "body.stop.force",
}


@pytest.mark.parametrize("step", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("share", [0.33, 0.40])
def test_a_body_rests_on_a_carrier_of_more_than_eleven_quarters_of_its_mass(native, share, step):
    """At first the whole force acts on the carrier alone, with the acceleration a = share g.

    After one step h the wall has the offset e = -a h^2/2 and the excess u = -a h, so that its cubic
    begins with the acceleration -(6 e/T + 4 u)/T = 11/4 a, T = 2 h.  The body stays while that is
    less than g.
    """
    fmus = {name: native["PRBDM", 3] for name in ("carrier", "body")}
    mass = simulation("PRBDM").values["shuttle.mass"]
    start = {
        "carrier.stop.position": 1.0,
        "carrier.gravity.x": 0.0,
        "carrier.release.displacement": 0.0,
        "carrier.shuttle.mass": mass / share,
        "body.release.displacement": 0.0,
    }
    found = simulate(
        fmus, RESTING, 8 * step, step, start, ["body.stop.contact"], scheme="jacobi", events=True
    )
    assert found["body.stop.contact"].all() == (share < 4 / 11)
