"""Random calls of Python FMUs: steps, changes of values, saved and restored states, resets.

A status OK must be true: values are finite, no rigid stop is penetrated, the energy balance stays
within the bound of the native FMUs, and counts do not fall.  A rejected step changes no value and
has a message, and a damaged state is refused.
"""

import contextlib
import math

import numpy as np
from fmpy.fmi1 import FMICallException

from fmu_host import OK, Instance
from prbm.base.atomic import write
from prbm.fmu import python_fmu
from shared import once
from support import energy_balance, mechanism

from .driver import ENERGY_FACTOR, ENERGY_RTOL, GAP_ATOL
from .report import Part

MODELS = ("PRBDM", "PRBDM2R")
STEP = 1e-3  # s
ENERGIES = ("energy.kinetic", "energy.elastic", "energy.gravitational", "energy.dissipated",
            "energy.work")  # fmt: skip
INPUTS = {"force.x": 0.5, "force.y": 0.5, "base.acceleration.x": 5.0, "stop.displacement": 1e-3}
"""Inputs that are changed, and their largest magnitudes [N], [m/s^2], [m]."""
WRONG_STEPS = ((5.0, STEP), (math.nan, STEP), (0.0, -STEP), (0.0, math.inf))
"""Time after the present one, and size of steps that must be rejected [s]."""
TOLERANCE = 1e-8  # Of the default experiments.


class Caller:
    """An instance, its generator of random numbers, and what was wrong."""

    def __init__(self, model: str, instance: Instance, seed: int) -> None:
        self.name, self.instance = f"{model}, seed {seed}", instance
        self.random = np.random.default_rng(seed)
        self.wrong: list[str] = []
        self.calls = self.steps = self.rejected = 0
        self.saved: tuple[object, float, float, float] | None = None
        self.begin()

    def begin(self) -> None:
        """Initialize, and take the energy balance of the start as the reference."""
        self.instance.initialize()
        self.time, self.balance, self.largest, self.count = 0.0, math.nan, 0.0, 0.0
        self.judge()

    def fails(self, text: str) -> None:
        self.wrong.append(f"{self.name}, t = {self.time:.9g} s: {text}")

    def judge(self) -> dict[str, float]:
        """Read all values, and check the laws."""
        self.calls += 1
        values = self.instance.values()
        for name, x in values.items():
            if not math.isfinite(x):
                self.fails(f"{name} is {x}")
        if values["stop.gap"] < -GAP_ATOL:
            self.fails(f"gap {values['stop.gap']:.3g} m")
        if values["stop.impact_count"] < self.count:
            self.fails("the count of impacts fell")
        balance = energy_balance(values)
        self.largest = max(self.largest, *(abs(values[name]) for name in ENERGIES))
        self.balance = balance if math.isnan(self.balance) else self.balance
        bound = (ENERGY_RTOL + ENERGY_FACTOR * TOLERANCE) * self.largest + 1e-12
        if abs(balance - self.balance) > bound:
            self.fails(f"the balance changed by {balance - self.balance:.3g} J")
            self.balance = balance
        self.count = values["stop.impact_count"]
        return values

    def step(self) -> None:
        size = STEP * float(self.random.choice([1e-3, 0.5, 1.0, 3.0]))
        before, messages = self.judge(), len(self.instance.messages)
        self.calls += 1
        if self.instance.step(self.time, size) == OK:
            self.time, self.steps = self.time + size, self.steps + 1
            self.judge()
            return
        self.rejected += 1
        if self.instance.values() != before or len(self.instance.messages) == messages:
            self.fails("a rejected step changed a value, or has no message")
        self.reset()

    def set_wrong(self) -> None:
        later, size = WRONG_STEPS[self.random.integers(len(WRONG_STEPS))]
        before, messages = self.instance.values(), len(self.instance.messages)
        self.calls += 1
        self.rejected += 1
        if self.instance.step(self.time + later, size) == OK:
            self.fails(f"a step of {size} s from {later} s later was accepted")
        if self.instance.values() != before or len(self.instance.messages) == messages:
            self.fails("a wrong step changed a value, or has no message")

    def change(self) -> None:
        name = str(self.random.choice(list(INPUTS)))
        self.calls += 1
        self.instance.set({name: INPUTS[name] * float(self.random.uniform(-1.0, 1.0))})

    def save(self) -> None:
        self.calls += 1
        state = self.instance.fmu.getFMUState()
        self.saved = state, self.time, self.balance, self.largest

    def restore(self) -> None:
        """Restore a state; the energy balance goes on from the time at which it was saved."""
        if self.saved is None:
            return
        self.calls += 1
        state, self.time, self.balance, self.largest = self.saved
        self.count = 0.0
        self.instance.fmu.setFMUState(state)
        self.judge()

    def damage(self) -> None:
        """Refuse a serialized state with another byte; the values remain."""
        state = self.instance.fmu.getFMUState()
        data = bytearray(self.instance.fmu.serializeFMUState(state))
        data[self.random.integers(len(data))] ^= 1 << int(self.random.integers(8))
        before = self.instance.values()
        self.calls += 3
        self.rejected += 1
        with contextlib.suppress(FMICallException):
            self.instance.fmu.setFMUState(self.instance.fmu.deSerializeFMUstate(bytes(data)))
        if self.instance.values() != before:
            self.fails("a damaged state changed a value")

    def reset(self) -> None:
        self.calls += 1
        self.saved = None
        self.instance.fmu.reset()
        self.begin()


ACTIONS = (
    *(Caller.step,) * 10, *(Caller.change,) * 3, Caller.set_wrong, Caller.save, Caller.restore,
    Caller.restore, Caller.damage,
)  # fmt: skip


def fmu(model: str):
    """Return the path of the Python FMU of a mechanism."""
    return once(f"python-{model}.fmu", lambda path: write(path, python_fmu.build(mechanism(model))))


def called(model: str, actions: int, seed: int) -> Caller:
    """Return the caller after a number of random actions."""
    with Instance(fmu(model)) as instance:
        caller = Caller(model, instance, seed)
        for _ in range(actions):
            ACTIONS[caller.random.integers(len(ACTIONS))](caller)
        return caller


def run(actions: int, seed: int = 0, names: list[str] | None = None) -> Part:
    """Make a number of actions with the Python FMUs of two mechanisms."""
    part = Part("Calls of Python FMUs", ("mechanism", "calls", "steps", "rejected", "violations"))
    for model in names or MODELS:
        caller = called(model, actions, seed)
        part.add(model, caller.calls, caller.steps, caller.rejected, len(caller.wrong))
        part.failures += caller.wrong
    part.total()
    return part
