"""A small co-simulation master on FMPy's classes.

A system consists of named FMUs and of connections from outputs to inputs, ``name.variable``:

    guide --- shuttle.vx ---> coil          {"coil.velocity": "guide.shuttle.vx",
      ^--------- force --------'             "guide.force.x": "coil.force"}

Values are exchanged at communication points only.  The scheme determines the inputs of a step:

    jacobi          every FMU uses the outputs at the beginning of the step
    gauss-seidel    the FMUs step one after the other, in the order of the mapping; each uses the
                    outputs that the FMUs before it have at the end of the step

The error of both schemes is of first order in the step.

With ``events=True``, FMUs of FMI 3.0 that have event mode end a step early at their events:

1. These FMUs step first, with the outputs at the beginning of the step.
2. If one of them stops earlier than the others, the others are restored and step to its time.
3. The FMUs without event mode follow to that time.
4. Outputs are exchanged and event mode is repeated until no input changes.
"""

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Self

from fmpy.fmi2 import (  # type: ignore[import-untyped]
    fmi2LastSuccessfulTime,
    fmi2Terminated,
)

from ..base.progress import Progress
from ..fmu.unpack import plain_folder
from ..runs.result import Columns, structured
from ..runs.run import Source, communication_points
from .components import (
    CO_SIMULATION,
    Component,
    CouplingError,
    Value,
    check_instances,
    check_wire,
    start_value,
)
from .nodes import NUMBERED, check_types

GAUSS_SEIDEL, JACOBI = "gauss-seidel", "jacobi"
STEP_RTOL = 1e-12  # Round-off of communication points, as a fraction of the last one.
UPDATES_MAX = 100  # event iterations at one time before the system is rejected as an endless loop


class Instance(Component):
    """An FMU in a co-simulation, its variables by name.

    Parameters
    ----------
    name : str
        Name of the instance.
    fmu : str or Path
        An FMU for co-simulation, of FMI 2.0 or 3.0.
    folder : str or Path
        An empty folder into which the FMU is unpacked.
    events : bool
        Use event mode and early return if the FMU has them (default: False).

    Raises
    ------
    CouplingError
        If the FMU cannot be read, loaded or instantiated, or has no co-simulation.
    """

    def __init__(
        self, name: str, fmu: str | Path, folder: str | Path, events: bool = False
    ) -> None:
        super().__init__(name, fmu, folder, CO_SIMULATION)
        self.events = events and self.version > 2 and bool(self.interface.hasEventMode)
        self.varies = bool(self.interface.canHandleVariableCommunicationStepSize)
        self.restorable = bool(self.interface.canGetAndSetFMUstate)
        self.updating = False  # in event mode
        self.stepping = False  # in step mode of an instance with events: discrete inputs are locked
        self.end = ""  # the message that the FMU has ended the simulation, with its last step
        self.connected: dict[str, Value] = {}
        self.instantiate(eventModeUsed=self.events, earlyReturnAllowed=self.events)

    # -- start and end --

    def initialize(self, time: float, stop_time: float | None, tolerance: float | None) -> None:
        """Enter initialization mode."""
        self.time = time
        experiment = {"tolerance": tolerance, "startTime": time, "stopTime": stop_time}
        if self.version == 2:
            self.call("setupExperiment", **experiment)
            self.call("enterInitializationMode")
        else:
            self.call("enterInitializationMode", **experiment)

    def begin(self) -> None:
        """Leave initialization mode, into event mode if the instance has events."""
        self.call("exitInitializationMode")
        self.updating = self.events

    def close(self) -> None:
        """Terminate the simulation and free the instance, in any state."""
        with suppress(Exception):  # Fails if the instance has failed before or was not initialized.
            self.fmu.terminate()
        self.fmu.freeInstance()

    # -- steps and events --

    def step(self, end: float) -> bool:
        """Step towards a time [s]; return whether an event is due at the new ``time``.

        An FMU that completes its step and ends the simulation with it sets ``end``.

        Raises
        ------
        CouplingError
            If the step fails, or the FMU ends the simulation within it.
        """
        if self.version == 2:
            self._step_fmi2(end)
            return False
        result = self.call("doStep", self.time, end - self.time)
        event, terminated, early, reached = result
        complete = early or _equal(reached, end)
        self.time = reached if early else end
        self._end_run(terminated, complete)
        return bool(event)

    def _step_fmi2(self, end: float) -> None:
        """Step to a time [s].  An FMU of FMI 2.0 ends the simulation by the status Discard."""
        self.last_error = ""
        try:
            self.call("doStep", self.time, end - self.time)
        except CouplingError:
            why = self.last_error
            if not self._status("getBooleanStatus", fmi2Terminated):
                raise
            reached = self._status("getRealStatus", fmi2LastSuccessfulTime)
            complete = reached is not None and _equal(reached, end)
            self.time = end if complete else self.time
            self._end_run(True, complete, why)
        self.time = end

    def _status(self, function: str, kind: int) -> Any:
        """Return a status of an FMU of FMI 2.0 whose step has failed; None: not available."""
        try:
            return getattr(self.fmu, function)(kind)
        except Exception:  # The functions are optional.
            return None

    def _end_run(self, terminated: bool, complete: bool = False, why: str = "") -> None:
        """Note the end of the simulation by the FMU after a complete step, or raise it."""
        if not terminated:
            return
        reason = why and f": {why}"
        self.end = f"{self.name} terminated the simulation at {self.time:g} s{reason}"
        if not complete:
            raise CouplingError(self.end)

    def enter_events(self) -> None:
        """Enter event mode, if the instance uses it."""
        if self.events and not self.updating:
            self.call("enterEventMode")
            self.updating, self.stepping = True, False

    def update(self) -> bool:
        """Update the discrete states once; return whether another update is needed."""
        if not self.updating:
            return False
        more, terminated, *_ = self.call("updateDiscreteStates")
        self._end_run(terminated)
        return bool(more)

    def leave_events(self) -> None:
        """Return to step mode."""
        if self.updating:
            self.call("enterStepMode")
            self.updating, self.stepping = False, True

    def at_events(self, name: str) -> bool:
        """Return whether :meth:`enter_events` must be called before this variable is set."""
        return self.stepping and self.variable(name).variability != "continuous"

    @contextmanager
    def saved_state(self, needed: bool) -> Iterator[Callable[[], None]]:
        """Save the present state; yield the function that restores it."""
        if not needed:
            yield lambda: None
            return
        if not self.restorable:
            raise CouplingError(
                f"{self.name} cannot restore a saved state, which a system with several FMUs in "
                "event mode needs: use only one FMU with event mode, or events=False"
            )
        state, time = self.call("getFMUState"), self.time

        def restore() -> None:
            self.call("setFMUState", state)
            self.time, self.end = time, ""

        try:
            yield restore
        finally:
            self.call("freeFMUState", state)


def _equal(reached: float, end: float) -> bool:
    """Return whether an FMU has reached the end of a step [s], to rounding."""
    return abs(reached - end) <= STEP_RTOL * abs(end)


class System:
    """Connected FMUs; a context manager that frees the instances at its end.

    Parameters
    ----------
    fmus : mapping
        The FMUs by the names of their instances, in the order of their steps.
    connections : mapping
        Source output by connected input, both as ``name.variable``.
    scheme : str
        ``gauss-seidel`` (default) or ``jacobi``.
    events : bool
        Use event mode of the FMUs that have it (default: False).
    watched : sequence of str
        Further variables to read into ``values`` after each step, ``name.variable``.
    functions : mapping
        Functions of the value of a source, by connected input; others take the value itself.

    Attributes
    ----------
    time : float
        Current time [s].
    values : dict
        Current values of connected outputs and watched variables, by ``name.variable``.

    Raises
    ------
    CouplingError
        If an FMU cannot be used, a name is unknown or a connection does not lead to an input.
    """

    def __init__(
        self,
        fmus: Mapping[str, str | Path],
        connections: Mapping[str, str],
        scheme: str = GAUSS_SEIDEL,
        events: bool = False,
        watched: Sequence[str] = (),
        functions: Mapping[str, Callable[[Value], Value]] | None = None,
    ) -> None:
        if scheme not in (GAUSS_SEIDEL, JACOBI):
            raise CouplingError(f"scheme = {scheme!r} must be {GAUSS_SEIDEL!r} or {JACOBI!r}")
        check_instances(fmus, ".")
        self.scheme, self.connections = scheme, dict(connections)
        self.functions = dict(functions or {})
        self.time = 0.0
        self.values: dict[str, Value] = {}
        self.folder = tempfile.TemporaryDirectory(prefix="prbm_system_", dir=plain_folder())
        self.instances: dict[str, Instance] = {}
        try:
            for name, fmu in fmus.items():
                there = Path(self.folder.name) / str(len(self.instances))
                self.instances[name] = Instance(name, fmu, there, events)
            self.wires, self.read = self._wires(), self._read(watched)
        except BaseException:
            self.close()
            raise

    def _wires(self) -> dict[str, dict[str, str]]:
        """Return for each instance its connected inputs, with the full name of each source."""
        wires: dict[str, dict[str, str]] = {name: {} for name in self.instances}
        for to, source in self.connections.items():
            instance, name = self.resolve(to)
            given = instance.variable(name)
            check_wire(to, given, source)
            giver, output = self.resolve(source)
            found = giver.variable(output)
            if to not in self.functions:
                check_types(to, given, source, found, NUMBERED)
            wires[instance.name][name] = source
        return wires

    def _read(self, watched: Sequence[str]) -> dict[str, list[str]]:
        """Return for each instance the variables that are read after a step."""
        read: dict[str, list[str]] = {name: [] for name in self.instances}
        for full in dict.fromkeys([*self.connections.values(), *watched]):
            instance, name = self.resolve(full)
            instance.variable(name)
            read[instance.name].append(name)
        return read

    def resolve(self, full: str) -> tuple[Instance, str]:
        """Return the instance and the variable of a name ``name.variable``.

        Raises
        ------
        CouplingError
            If no instance has that name.
        """
        name, _, variable = full.partition(".")
        if name not in self.instances:
            raise CouplingError(
                f"{full!r}: unknown instance; write INSTANCE.VARIABLE with one of "
                f"{', '.join(self.instances)}"
            )
        return self.instances[name], variable

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the instances and delete the unpacked files."""
        while self.instances:
            self.instances.popitem()[1].close()
        self.folder.cleanup()

    # -- start --

    def start(
        self,
        values: Mapping[str, Value] | None = None,
        time: float = 0.0,
        stop_time: float = math.inf,
        tolerance: float | None = None,
    ) -> None:
        """Initialize all instances.

        Outputs are passed to the connected inputs in initialization mode, once per instance.
        That suffices for a chain of connections through the whole system.

        Parameters
        ----------
        values : mapping
            Start values of parameters and inputs, ``name.variable``.
        time, stop_time : float
            Start time (default: 0) and stop time (default: none) [s].
        tolerance : float or None
            Tolerance of the integration in the FMUs; None: that of each FMU.
        """
        self.give(values or {})
        stop = None if math.isinf(stop_time) else stop_time
        self.time = time
        for instance in self.instances.values():
            instance.initialize(time, stop, tolerance)
        for _ in self.instances:
            self.exchange()
        for instance in self.instances.values():
            instance.begin()
        self._update()

    def give(self, values: Mapping[str, Value]) -> None:
        """Set inputs and parameters, ``name.variable``; discrete inputs in event mode."""
        for full, value in values.items():
            instance, name = self.resolve(full)
            own = start_value(full, value, instance.variable(name))
            if instance.at_events(name):
                instance.enter_events()
            instance.set({name: own})
        if any(instance.updating for instance in self.instances.values()):
            self.handle_events()

    # -- exchange --

    def read_outputs(self, instance: Instance) -> None:
        """Read the connected outputs and watched variables of an instance into ``values``."""
        found = instance.get(self.read[instance.name])
        self.values |= {f"{instance.name}.{name}": value for name, value in found.items()}

    def set_connected(self, instance: Instance) -> bool:
        """Set the connected inputs of an instance; return whether one of them has changed.

        The instance enters event mode if a discrete input has changed.
        """
        given = {to: self.values[source] for to, source in self.wires[instance.name].items()}
        for to, value in given.items():
            if function := self.functions.get(f"{instance.name}.{to}"):
                given[to] = function(value)
        changed = {to: x for to, x in given.items() if x != instance.connected.get(to)}
        if any(instance.at_events(to) for to in changed):
            instance.enter_events()
        instance.set({to: x for to, x in given.items() if not instance.at_events(to)})
        instance.connected = given
        return bool(changed)

    def exchange(self) -> bool:
        """Read all outputs, set all connected inputs; return whether one of them has changed."""
        for instance in self.instances.values():
            self.read_outputs(instance)
        return any([self.set_connected(instance) for instance in self.instances.values()])

    # -- steps --

    def steps(self, end: float) -> Iterator[None]:
        """Advance to a communication point [s]; yield there, and before and after each event.

        Raises
        ------
        CouplingError
            If an FMU fails, or after the last yield, if one has ended the simulation.
        """
        stuck = 0
        while True:
            begin, event = self.time, self.advance(end)
            yield
            for instance in self.instances.values():
                if instance.end:
                    raise CouplingError(instance.end)
            if event:
                self.handle_events()
                yield
            if self.time >= end:
                return
            stuck = 0 if self.time > begin else stuck + 1
            if stuck > UPDATES_MAX:
                raise CouplingError(
                    f"more than {UPDATES_MAX} events at {self.time:g} s without progress in time: "
                    "use events=False"
                )

    def row(self, names: Sequence[str]) -> dict[str, Value]:
        """Return the time and values by name."""
        return {"time": self.time, **{name: self.values[name] for name in names}}

    def advance(self, end: float) -> bool:
        """Take one step towards a time [s], which ends at the first event.

        Returns whether an event is due at the new ``time``; :meth:`handle_events` handles it.
        """
        leaders = [x for x in self.instances.values() if x.events]
        others = [x for x in self.instances.values() if not x.events]
        first = leaders + others if self.scheme == JACOBI else leaders
        for instance in first:
            self.set_connected(instance)
        if any(instance.updating for instance in leaders):  # a discrete input has changed
            self.handle_events()
        end, event = self._step_leaders(leaders, end)
        for instance in leaders:
            self.read_outputs(instance)
        for instance in others:
            if self.scheme == GAUSS_SEIDEL:
                self.set_connected(instance)
            instance.step(end)
            self.read_outputs(instance)
        self.time = end
        return event

    def _step_leaders(self, leaders: list[Instance], end: float) -> tuple[float, bool]:
        """Step the instances with events to ``end`` or to the first event of all of them.

        Returns the time that they reached, and whether an event is due there.
        """
        with ExitStack() as stack:
            restore = [stack.enter_context(x.saved_state(len(leaders) > 1)) for x in leaders]
            events = [x.step(end) for x in leaders]
            while (first := min((x.time for x in leaders), default=end)) < end:
                end = first
                for k, instance in enumerate(leaders):
                    if instance.time > end:
                        restore[k]()
                        events[k] = instance.step(end)
        return end, any(events)

    def handle_events(self) -> None:
        """Run the event iteration of the present time in all instances with events.

        Raises
        ------
        CouplingError
            If the iteration does not end.
        """
        for instance in self.instances.values():
            instance.enter_events()
        self._update()

    def _update(self) -> None:
        """Update discrete states and exchange outputs until nothing changes; leave event mode."""
        self.exchange()
        for _ in range(UPDATES_MAX):
            more = [instance.update() for instance in self.instances.values()]
            changed = self.exchange()
            if not (changed or any(more)):
                break
        else:
            raise CouplingError(
                f"the event iteration at {self.time:g} s does not end after {UPDATES_MAX} updates: "
                "break the loop of connections between the events of the instances"
            )
        for instance in self.instances.values():
            instance.leave_events()


def simulate(
    fmus: Mapping[str, str | Path],
    connections: Mapping[str, str],
    stop_time: float,
    step: float,
    values: Mapping[str, Value] | None = None,
    record: Sequence[str] = (),
    scheme: str = GAUSS_SEIDEL,
    events: bool = False,
    source: Source | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
    functions: Mapping[str, Callable[[Value], Value]] | None = None,
) -> Columns:
    """Simulate a system of FMUs.

    Parameters
    ----------
    fmus, connections, scheme, events
        As for :class:`System`.
    stop_time, step : float
        Duration and communication step [s]; the last step may be shorter.
    values : mapping
        Start values of parameters and inputs, ``name.variable``.
    record : sequence of str
        Variables of the result beside the connected outputs, ``name.variable``.
    source : callable or None
        ``source(t)`` returns inputs, ``name.variable``, for the step that begins at t [s].
    tolerance : float or None
        Tolerance of the integration in the FMUs; None: that of each FMU.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.
    functions
        As for :class:`System`.

    Returns
    -------
    structured array
        ``time`` and the variables by name in the units of the FMUs, one row per communication
        point.  With events, each event has two rows: before it and after it.

    Raises
    ------
    CouplingError
        If a name or a connection is invalid, an FMU needs steps of one length, or an FMU fails or
        ends the simulation; ``columns`` of the error are the rows before.
    ParameterError
        If ``stop_time`` or ``step`` is not positive and finite.
    """
    times = communication_points(stop_time, step)
    names = list(dict.fromkeys([*record, *connections.values()]))
    rows = []
    with System(fmus, connections, scheme, events, names, functions) as system:
        _check_even(system, times)
        given = {} if source is None else source(0.0)
        system.start({**(values or {}), **given}, 0.0, stop_time, tolerance)
        rows.append(system.row(names))
        try:
            for k, end in enumerate(times[1:], 1):
                if source is not None:
                    system.give(source(system.time))
                for _ in system.steps(end):
                    rows.append(system.row(names))
                if progress is not None:
                    progress(k / (len(times) - 1))
        except CouplingError as error:
            error.columns = structured(rows)
            raise
    return structured(rows)


def _check_even(system: System, times: Sequence[float]) -> None:
    """Check that all steps have one length, if one of the FMUs needs that."""
    needs = [x.name for x in system.instances.values() if not x.varies]
    if not needs:
        return
    name = needs[0]
    if any(x.events for x in system.instances.values()):
        raise CouplingError(
            f"{name} needs communication steps of one length, and events end steps early: use "
            "events=False"
        )
    first, last = times[1] - times[0], times[-1] - times[-2]
    if abs(last - first) > STEP_RTOL * times[-1]:
        raise CouplingError(
            f"{name} needs communication steps of one length: stop_time = {times[-1]:g} s must be "
            f"a multiple of step = {first:g} s"
        )
