"""A simulation in the C kernel, with the interface of the class Simulation of the package."""

import ctypes
import re
import shutil
import subprocess
import zlib
from functools import cache
from pathlib import Path

import numpy as np

from kernel_library import FLAGS, KERNEL
from prbm.fmu.start import interface
from prbm.interface.tables import slots, tables
from prbm.mechanics.assembly import assemble
from prbm.mechanics.independent import independent
from prbm.mechanism.description import Mechanism
from shared import once

DOUBLE, POINTER, BOOL, INT = ctypes.c_double, ctypes.c_void_p, ctypes.c_bool, ctypes.c_int
SENTENCE = 640  # Bytes of an error message.
FUNCTIONS = {
    "simulation_set": (BOOL, POINTER, INT, DOUBLE, POINTER),
    "simulation_get": (BOOL, POINTER, INT, POINTER, POINTER),
    "simulation_start": (BOOL, POINTER, DOUBLE, DOUBLE, BOOL, POINTER),
    "simulation_advance": (BOOL, POINTER, DOUBLE, POINTER),
    "simulation_advance_some": (BOOL, POINTER, DOUBLE, BOOL, POINTER, POINTER, POINTER),
    "simulation_handle_event": (BOOL, POINTER, POINTER),
    "simulation_restore": (BOOL, POINTER, POINTER, POINTER),
    "simulation_reset": (None, POINTER),
    "simulation_close": (None, POINTER),
    "simulation_open": (POINTER, POINTER),
    "simulation_bytes": (ctypes.c_size_t, POINTER),
    "simulation_state_count": (ctypes.c_size_t, POINTER),
    "simulation_save": (None, POINTER, POINTER),
    "simulation_time": (DOUBLE, POINTER),
    "mechanism_open": (POINTER, POINTER, ctypes.c_size_t, POINTER),
    "mechanism_close": (None, POINTER),
    "exchange_begin": (None, POINTER),
    "exchange_states": (INT, POINTER),
    "exchange_indicators": (INT, POINTER),
    "exchange_slot": (INT, POINTER, INT),
    "exchange_set_time": (None, POINTER, DOUBLE),
    "exchange_set": (None, POINTER, POINTER),
    "exchange_get": (None, POINTER, POINTER),
    "exchange_derivatives": (BOOL, POINTER, POINTER, POINTER),
    "exchange_event_indicators": (BOOL, POINTER, POINTER, POINTER),
    "exchange_completed_step": (BOOL, POINTER, POINTER, POINTER),
    "exchange_event": (BOOL, POINTER, POINTER, POINTER),
    "exchange_directional": (BOOL, POINTER, POINTER, POINTER, POINTER, POINTER),
}


class KernelMistake(Exception):
    """The error message of a function of the kernel."""


Changes = tuple[tuple[str, str, str], ...]
"""For each change of the kernel: the file, a text in it, and its replacement."""


def _compile(folder: Path, changes: Changes = ()) -> None:
    """Compile the kernel up to the simulation, all functions visible."""
    shutil.copytree(KERNEL, folder)
    for file, old, new in changes:
        text = (folder / file).read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{old} in {file}"
        (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    kernel = (folder / "prbm_fmu.c").read_text(encoding="utf-8").partition("#ifdef PRBM_ENGINE")[0]
    source, built = folder / "kernel.c", folder / "kernel.so"
    source.write_text(kernel, encoding="utf-8")
    flags = [flag for flag in FLAGS if not flag.startswith("-I")]
    if changes:  # A changed kernel runs once and shortly.
        flags.append("-O0")
    subprocess.run(["cc", *flags, f"-I{folder}", str(source), "-o", str(built), "-lm"], check=True)


@cache
def library(changes: Changes = ()) -> ctypes.CDLL:
    """Return the kernel up to the simulation, compiled once, all functions visible."""
    name = f"kernel-simulation-{zlib.crc32(repr(changes).encode())}"
    found = ctypes.CDLL(str(once(name, lambda f: _compile(f, changes)) / "kernel.so"))
    for name, (result, *arguments) in FUNCTIONS.items():
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


@cache
def _sizes() -> list[int]:
    """Return the numbers of a saved state: scalars, of a stop, and of its contact."""
    text = (KERNEL / "hybrid" / "snapshot.c").read_text(encoding="utf-8")
    names = "SCALARS", "PER_STOP_STATE", "PER_CONTACT_STATE"
    return [int(re.search(rf"\b{name} = (\d+)", text)[1]) for name in names]


def _some_states(mechanism: Mechanism) -> tuple[int, ...]:
    """Return as many coordinates as are independent, for a co-simulation."""
    system = assemble(mechanism, mechanism.values())
    return tuple(range(system.n - len(system.loops)))


class KernelSimulation:
    """A simulation of a mechanism in the kernel.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : dict
        Parameters and inputs that differ from their defaults.
    exchange : bool
        Whether the simulation is for model exchange.
    described : bool
        Whether the tables describe the variables of FMI, and have states that suit model exchange,
        which needs the start in Python.
    changes : tuple
        Changes of the sources of the kernel.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        values: dict[str, float] | None = None,
        *,
        start_time: float = 0.0,
        tolerance: float = 0.0,
        exchange: bool = False,
        described: bool = True,
        changes: Changes = (),
    ) -> None:
        self.tables, self.inner, self.states_of = None, None, None
        self.library = library(changes)
        self.sentence = ctypes.create_string_buffer(SENTENCE)
        self.stops, self.points = mechanism.stops, len(mechanism.rubbing)
        phased = any(spring.side for spring in mechanism.springs)
        self.springs = len(mechanism.springs) if phased else 0
        chosen = independent(mechanism) if described or exchange else _some_states(mechanism)
        self.slots = slots(mechanism, chosen)
        data = tables(mechanism, interface(mechanism, {}) if described else (), "token", chosen)
        self.tables = self.library.mechanism_open(data, len(data), self.sentence)
        self._check(self.tables is not None)
        self.inner = self.library.simulation_open(self.tables)
        self.set(values or {})
        self.call("simulation_start", start_time, tolerance, exchange)

    def __del__(self) -> None:
        if self.inner:
            self.library.simulation_close(self.inner)
        if self.tables:
            self.library.mechanism_close(self.tables)

    def _check(self, ok: bool) -> None:
        if not ok:
            raise KernelMistake(self.sentence.value.decode())

    def call(self, name, *arguments) -> None:
        """Call a function that may fail; raise its error message."""
        self._check(getattr(self.library, name)(self.inner, *arguments, self.sentence))

    # -- interface of Simulation --

    def set(self, changes: dict[str, float]) -> None:
        for name, value in changes.items():
            self.call("simulation_set", self.slots[name], value)

    def advance(self, time: float) -> None:
        self.call("simulation_advance", time)

    def get(self, name: str) -> float:
        value = DOUBLE()
        self.call("simulation_get", self.slots[name], ctypes.byref(value))
        return value.value

    def outputs(self) -> dict[str, float]:
        return {name: self.get(name) for name in self.slots}

    # -- the state --

    @property
    def state(self) -> np.ndarray:
        numbers = np.empty(self.library.simulation_state_count(self.inner))
        self.library.simulation_save(self.inner, pointer(numbers))
        return numbers

    def restore(self, state: np.ndarray) -> None:
        self.call("simulation_restore", pointer(state))

    def pending(self) -> tuple[int, int, float]:
        """Return kind, contact and time [s] of the pending event, see ``simulation_save``."""
        kind, contact, _, time = self.state[5:9]
        return int(kind), int(contact), float(time)

    def modes(self) -> list[int]:
        """Return the modes of all contacts."""
        return [int(mode) for mode in self.state[self._mode_places()]]

    def set_modes(self, modes: list[int]) -> None:
        """Set the modes of all contacts."""
        state = self.state
        state[self._mode_places()] = modes
        self.restore(state)

    def touching(self, stop: int) -> int:
        """Return the phase of the contact at a compliant stop."""
        return int(self.state[self._mode_places()[stop] + _sizes()[1] + 3])

    def set_contact(self, stop: int, phase: int, speed: float, depth: float = 0.0) -> None:
        """Set the phase, the reference speed and the depth of the contact at a compliant stop."""
        state, (_, per_stop, _) = self.state, _sizes()
        at = self._mode_places()[stop] + per_stop + 3  # Behind three maxima.
        state[at : at + 3] = phase, speed, depth
        self.restore(state)

    def coils(self) -> list[int]:
        """Return the phases of all springs, if one acts on one side."""
        return [int(phase) for phase in self.state[self._coil_places()]]

    def set_coils(self, phases: list[int]) -> None:
        """Set the phases of all springs."""
        state = self.state
        state[self._coil_places()] = phases
        self.restore(state)

    def _coil_places(self) -> list[int]:
        """Return the places of the phases of springs in the saved state."""
        at = ([_sizes()[0], *self._stop_ends()])[-1] + self.points
        return [*range(at, at + self.springs)]

    def _stop_ends(self) -> list[int]:
        """Return the places behind the numbers of each stop in the saved state."""
        at, per_stop, per_contact = _sizes()
        sizes = [per_stop + (per_contact if stop.compliant else 0) for stop in self.stops]
        return [at + sum(sizes[: k + 1]) for k in range(len(sizes))]

    def _mode_places(self) -> list[int]:
        """Return the places of the modes in the saved state."""
        at, per_stop, per_contact = _sizes()
        places = []
        for stop in self.stops:
            places.append(at)
            at += per_stop + (per_contact if stop.compliant else 0)
        return [*places, *range(at, at + 2 * self.points, 2)]  # Modes and sides in turn.

    # -- model exchange --

    @property
    def states(self) -> list[str]:
        """Return the names of the states of model exchange."""
        names = {slot: name for name, slot in self.slots.items()}
        count = self.library.exchange_states(self.inner)
        return [names[self.library.exchange_slot(self.inner, k)] for k in range(count)]

    def exchange_set(self, time: float, x: np.ndarray) -> None:
        self.library.exchange_set_time(self.inner, time)
        self.library.exchange_set(self.inner, pointer(x))

    def exchange_get(self) -> np.ndarray:
        x = np.empty(self.library.exchange_states(self.inner))
        self.library.exchange_get(self.inner, pointer(x))
        return x

    def begin(self) -> None:
        """Begin model exchange at the present states."""
        self.derivatives()
        self.library.exchange_begin(self.inner)

    def derivatives(self) -> np.ndarray:
        dx = np.empty(self.library.exchange_states(self.inner))
        self.call("exchange_derivatives", pointer(dx))
        return dx

    def indicators(self) -> np.ndarray:
        z = np.empty(self.library.exchange_indicators(self.inner))
        self.call("exchange_event_indicators", pointer(z))
        return z

    def completed_step(self) -> bool:
        event = BOOL()
        self.call("exchange_completed_step", ctypes.byref(event))
        return event.value

    def event(self) -> bool:
        changed = BOOL()
        self.call("exchange_event", ctypes.byref(changed))
        return changed.value

    def directional(self, dx: np.ndarray, du: np.ndarray) -> np.ndarray:
        result = np.empty(len(self.slots))
        self.call("exchange_directional", pointer(dx), pointer(du), pointer(result))
        return result


def pointer(x: np.ndarray) -> int:
    """Return the address of an array of doubles."""
    assert x.dtype == np.float64
    assert x.flags.c_contiguous
    return x.ctypes.data
