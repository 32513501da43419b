"""A mechanism in motion in the C kernel, with the interface of the Python engine.

:class:`prbm.hybrid.simulation.Simulation` is the specification of each method and attribute.
"""

import ctypes
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.errors import ParameterError, SimulationError
from ..base.names import unknown
from ..base.tolerances import TOLERANCE_USED_MAX
from ..hybrid.configuration import Configuration, Scales, checked_tolerance
from ..hybrid.front import Latched
from ..hybrid.given import changed_values, checked_times, start_values
from ..hybrid.outputs import Outputs
from ..hybrid.records import Impact
from ..hybrid.simulation import Simulation
from ..hybrid.snapshot import check_owner
from ..interface import tables
from ..mechanics.arrays import Real
from ..mechanics.assembly import assemble, calculated
from ..mechanics.compliant_stops import COMPLIANT_STATES
from ..mechanics.start import Instability
from ..mechanics.stress import SectionStresses, section_positions
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.parameters import number
from .library import MESSAGE_LENGTH, library

Slots = NDArray[np.intc]
UNFINISHED = -2  # Result of a call that is to be repeated, ENGINE_UNFINISHED in C.
MOTION_GROUPS = ("bodies", "probes")
OUTPUT_GROUPS = (
    *MOTION_GROUPS, "stops", "springs", "guides", "base", "energies", "latched", "compliant",
    "links", "stretches", "stresses", "frequency", "calculated",
)  # fmt: skip
"""The groups of values that are outputs, in the order of the Python engine."""


class Tables:
    """The tables of a mechanism in the kernel, for all simulations of it.

    Raises
    ------
    MechanismError
        If the mechanism has more parts than the kernel supports.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        system = assemble(mechanism, mechanism.values())
        own = range(system.n - len(system.loops))  # Any choice: model exchange alone uses them.
        content = tables.tables(mechanism, (), "", own)
        message = ctypes.create_string_buffer(MESSAGE_LENGTH)
        self.library = library()
        self.address = self.library.prbm_mechanism_open(content, len(content), message)
        if not self.address:
            raise SimulationError(message.value.decode())
        closing = weakref.finalize(self, self.library.prbm_mechanism_close, self.address)
        closing.atexit = False
        groups = tables.slot_groups(mechanism, own)
        slots = {name: k for k, name in enumerate(n for names in groups.values() for n in names)}
        self.slots = {name: slots[name] for group in OUTPUT_GROUPS for name in groups[group]}
        self.motions = [name for group in MOTION_GROUPS for name in groups[group]]
        self.outputs_and_time = np.array([*self.slots.values(), slots["time"]], np.intc)
        self.counts = [f"{stop.name}.impact_count" for stop in mechanism.stops]
        self.contacts = [f"{stop.name}.contact" for stop in mechanism.stops]


_tables: dict[int, tuple[Tables, "weakref.ref[Mechanism]"]] = {}


def tables_of(mechanism: Mechanism) -> Tables:
    """Return the tables of a mechanism, which are kept as long as the mechanism exists."""
    key = id(mechanism)
    if key not in _tables:
        gone = weakref.ref(mechanism, lambda _: _tables.pop(key, None))
        _tables[key] = Tables(mechanism), gone
    return _tables[key][0]


def _observed(library: ctypes.CDLL, address: int, count: int) -> list[list[float]]:
    """Return the times and ``count`` values that the kernel has kept beside events."""
    rows = np.empty((library.prbm_observed_count(address), 1 + count))
    library.prbm_observed(address, rows.ctypes.data)
    return rows.tolist()  # type: ignore[no-any-return]


class KernelSimulation:
    """A mechanism in motion in the C kernel.

    Parameters, attributes and errors are those of :class:`prbm.hybrid.simulation.Simulation`.  The
    step size is always adaptive.  Several threads may use one simulation, one after another.

    Raises
    ------
    CompilerError, LibraryError
        If there is no library.
    MechanismError
        If the mechanism has more parts than the kernel supports.
    """

    engine = "kernel"

    def __init__(
        self,
        mechanism: Mechanism,
        values: Mapping[str, float] | None = None,
        *,
        start_time: float = 0.0,
        tolerance: float | None = None,
    ) -> None:
        self.values, self.given, start = start_values(mechanism, values, start_time)
        if tolerance is not None:
            tolerance = checked_tolerance(tolerance)
        self.mechanism = mechanism
        self._wanted = tolerance
        self._open()
        self._set({**self.values, **self.given})
        if not self._library.prbm_start(
            self._address, start, tolerance or 0.0, self._message
        ):  # fmt: skip
            # The specification distinguishes the kinds of errors.
            Simulation(mechanism, values, start_time=start_time, tolerance=tolerance)
            raise self._error()

    def _open(self) -> None:
        """Allocate the simulation in the kernel."""
        self._lock = threading.Lock()
        self._tables = tables_of(self.mechanism)
        self._library = self._tables.library
        self._message = ctypes.create_string_buffer(MESSAGE_LENGTH)
        self._address = self._library.prbm_open(self._tables.address)
        if not self._address:
            raise SimulationError(f"there is not enough memory to simulate {self.mechanism.name}")
        closing = weakref.finalize(self, self._library.prbm_close, self._address)
        closing.atexit = False
        self._record: list[Impact] | None = None
        self._outputs: tuple[float, Outputs] | None = None

    def _error(self) -> SimulationError:
        """Return the error that the kernel reports."""
        return SimulationError(self._message.value.decode(errors="replace"))

    # -- mechanism and parameters --

    @property
    def tolerance(self) -> float:
        """Relative tolerance of the integration."""
        wanted = self.values["solver.tolerance"] if self._wanted is None else self._wanted
        return min(wanted, TOLERANCE_USED_MAX)

    @property
    def frequency(self) -> float:
        """Fundamental frequency about the equilibrium under gravity at the start [Hz]; 0: none."""
        return float(self._at(self._slots(["mode.frequency"]))[0])

    @property
    def system(self) -> System:
        """The constant arrays, for the parameters that act from the next step on."""
        return self.configuration.system

    @cached_property
    def configuration(self) -> Configuration:
        """Mechanism, parameters, tolerances and scales, computed when they are needed."""
        frequency, values = self.frequency, dict(self.values)
        system, known = assemble(self.mechanism, values), calculated(self.mechanism, values)
        scales = Scales.of(system, 2 * np.pi * frequency)
        return Configuration(
            self.mechanism, values, system, known, self.tolerance, None, frequency, scales
        )

    @property
    def time(self) -> float:
        """Present time [s]."""
        return float(self._library.prbm_time(self._address))

    @property
    def step_count(self) -> int:
        """Integration steps since the start."""
        return int(self._library.prbm_steps(self._address))

    def set(self, changes: Mapping[str, float]) -> None:
        """Change inputs and tunable parameters from the present time on.

        Raises
        ------
        ParameterError
            If a name is unknown or belongs to a fixed parameter, or a value is out of bounds.  No
            value is then changed.
        """
        values, given = changed_values(self.mechanism, self.values, self.given, changes)
        with self._lock:
            self._set({**values, **given})
        if values != self.values:
            vars(self).pop("configuration", None)
        self.values, self.given = values, given

    def _set(self, numbers: Mapping[str, float]) -> None:
        """Set all parameters and all inputs."""
        x = np.fromiter(numbers.values(), float, len(numbers))
        if not self._library.prbm_set(self._address, 0, len(x), x.ctypes.data, self._message):
            raise ParameterError(self._message.value.decode(errors="replace"))

    # -- time --

    def advance(self, time: float) -> None:
        """Continue the motion to a time.  An error leaves the simulation unchanged.

        Raises
        ------
        ParameterError, SimulationError
            As :meth:`prbm.hybrid.simulation.Simulation.advance`.
        """
        time = number("time", time, "s")
        with self._lock:
            self._repeat(lambda: self._library.prbm_advance(self._address, time, self._message))

    def _repeat(self, call: Callable[[], int]) -> None:
        """Call a function of the kernel until it is finished, and take the impacts.

        A signal of the system, such as Ctrl-C, acts between two calls.
        """
        try:
            while (count := call()) == UNFINISHED:
                pass
        except BaseException:
            self._library.prbm_abandon(self._address)
            raise
        if count < 0:
            raise self._error()
        self._take_impacts(count)

    def instability(self) -> Instability:
        """Return the numbers of unstable directions at the start.

        As :meth:`prbm.hybrid.simulation.Simulation.instability`.
        """
        counts = np.zeros(2, np.intc)
        with self._lock:
            if not self._library.prbm_instability(
                self._address, counts.ctypes.data, self._message
            ):  # fmt: skip
                raise self._error()
        return Instability(*counts.tolist())

    def check_effort(self, step: float) -> None:
        """Reject a communication step [s] of the default experiment that needs too many steps.

        Raises
        ------
        SimulationError
            As :meth:`prbm.hybrid.stability.FastestMode.check_effort`.
        """
        if not self._library.prbm_check_step(self._address, step, self._message):
            raise self._error()

    # -- impacts --

    @property
    def record(self) -> list[Impact] | None:
        """If a list, all impacts are appended to it."""
        return self._record

    @record.setter
    def record(self, record: list[Impact] | None) -> None:
        with self._lock:
            self._record = record
            self._library.prbm_record(self._address, record is not None)

    def _take_impacts(self, count: int) -> None:
        """Append the impacts that the kernel has recorded to the record."""
        if count == 0 or self._record is None:
            return
        n = self._size
        numbers = np.empty((count, self._library.prbm_impact_size(self._address)))
        self._library.prbm_impacts(self._address, numbers.ctypes.data)
        for row in numbers:
            q, before, after = row[-3 * n :].reshape(3, n)
            stop, hits, *numbers = row[: -3 * n].tolist()
            latched, time = Latched(int(hits), *numbers), numbers[0]
            name = self.mechanism.stops[int(stop)].name
            self._record.append(Impact(name, time, q, before, after, latched.impulse, latched))

    # -- state and outputs --

    @cached_property
    def _size(self) -> int:
        """Number of coordinates."""
        return int(self._library.prbm_coordinates(self._address))

    def state(self) -> Real:
        """Return y = (q, v, dissipated energy, work) at the present time, on the constraints.

        The states of compliant stops follow, see :mod:`prbm.mechanics.compliant_stops`.
        """
        compliant = sum(stop.compliant for stop in self.mechanism.stops)
        y = np.empty(2 * self._size + 2 + COMPLIANT_STATES * compliant)
        with self._lock:
            if not self._library.prbm_state(self._address, y.ctypes.data, self._message):
                raise self._error()
        return y

    def section_stresses(self) -> SectionStresses:
        """Return the stress of both faces in all sections at the present time, by flexure [Pa].

        As :meth:`prbm.hybrid.simulation.Simulation.section_stresses`.
        """
        counts = {name: len(position) for name, position in section_positions(self.system).items()}
        faces = np.empty(2 * sum(counts.values()))
        with self._lock:
            if not self._library.prbm_sections(self._address, faces.ctypes.data, self._message):
                raise self._error()
        found, first = {}, 0
        for name, m in counts.items():
            found[name] = faces[first : first + m], faces[first + m : first + 2 * m]
            first += 2 * m
        return found

    def outputs(self) -> Outputs:
        """Return all outputs, locals and calculated parameters at the present time, by name.

        They are in SI units and rad.  Displacements and energies are zero at the straight shape.
        """
        now = self.time
        if self._outputs is None or self._outputs[0] != now:
            *numbers, now = self._at(self._tables.outputs_and_time).tolist()
            found: Outputs = dict(zip(self._tables.slots, numbers, strict=True))
            for name in self._tables.counts:
                found[name] = int(found[name])
            for name in self._tables.contacts:
                found[name] = bool(found[name])
            self._outputs = now, found
        return dict(self._outputs[1])

    def motions(self) -> dict[str, float]:
        """Return only the positions and velocities of bodies and probes, by name of the output."""
        names = self._tables.motions
        return dict(zip(names, self._at(self._slots(names)).tolist(), strict=True))

    def _at(self, slots: Slots) -> Real:
        """Return values by slot, (k,)."""
        x = np.empty(len(slots))
        with self._lock:
            if not self._library.prbm_values(
                self._address, len(slots), slots.ctypes.data, x.ctypes.data, self._message
            ):
                raise self._error()
        return x

    def _slots(self, names: Sequence[str]) -> Slots:
        """Return the slots of outputs by name, (k,)."""
        known = self._tables.slots
        for name in names:
            if name not in known:
                raise ParameterError(unknown(name, known))
        return np.array([known[name] for name in names], np.intc)

    def sample(
        self,
        times: Sequence[float] | Real,
        names: Sequence[str],
        events: list[list[float]] | None = None,
    ) -> Real:
        """Advance to each of several times and return outputs there, (m, k).

        Parameters and errors as for :meth:`prbm.hybrid.simulation.Simulation.sample`.
        """
        t, slots, done = checked_times(times), self._slots(names), ctypes.c_int(0)
        x = np.empty((len(t), len(slots)))
        arguments = (
            self._address, len(t), t.ctypes.data, len(slots), slots.ctypes.data, x.ctypes.data,
            ctypes.byref(done), self._message,
        )  # fmt: skip
        with self._lock:
            try:
                if events is not None and not self._library.prbm_observe(
                    self._address, len(slots), slots.ctypes.data, self._message
                ):
                    raise self._error()
                self._repeat(lambda: self._library.prbm_sample(*arguments))
            except BaseException:
                self._take_impacts(
                    self._library.prbm_advance(self._address, self.time, self._message)
                )
                raise
            finally:
                self._library.prbm_observe(self._address, 0, None, None)
                if events is not None:
                    events += _observed(self._library, self._address, len(slots))
        return x

    # -- saving and restoring --

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state as plain values that JSON keeps exactly."""
        with self._lock:
            numbers = np.empty(self._library.prbm_saved_count(self._address))
            self._library.prbm_save(self._address, numbers.ctypes.data)
        return {
            "engine": self.engine, "values": dict(self.values), "given": dict(self.given),
            "tolerance": self._wanted, "numbers": numbers.tolist(),
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore a state of :meth:`snapshot`; the motion then continues bit for bit.

        Raises
        ------
        ParameterError
            If the state belongs to another mechanism or engine, or is damaged.
        """
        check_owner(saved, self.engine, self.values)
        try:
            numbers = np.array(saved["numbers"], float)
            values = self.mechanism.values({name: saved["values"][name] for name in self.values})
            known = {name: saved["given"][name] for name in self.given}
            given = changed_values(self.mechanism, values, known, known)[1]
            wanted = saved["tolerance"]
            if wanted is not None:
                wanted = checked_tolerance(wanted)
        except (KeyError, TypeError, ValueError) as error:
            raise ParameterError(f"the saved state is damaged: {error}") from None
        with self._lock:
            if numbers.shape != (self._library.prbm_saved_count(self._address),):
                raise ParameterError("the saved state belongs to another mechanism")
            if not self._library.prbm_restore(self._address, numbers.ctypes.data, self._message):
                raise ParameterError(self._message.value.decode(errors="replace"))
            self.values, self.given = values, given
            self._wanted, self._outputs = wanted, None
            vars(self).pop("configuration", None)

    def __getstate__(self) -> dict[str, Any]:
        return {"mechanism": self.mechanism, "saved": self.snapshot(), "record": self.record}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.mechanism = state["mechanism"]
        self.values, self.given = state["saved"]["values"], state["saved"]["given"]
        self._open()
        self.restore(state["saved"])
        self.record = state["record"]
