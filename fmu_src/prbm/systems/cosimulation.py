"""FMUs side by side: a small master for co-simulation, on FMPy's classes.

A system is some FMUs with names, and connections from outputs to inputs, ``name.variable``:

    guide --- shuttle.vx ---> coil          {"coil.velocity": "guide.shuttle.vx",
      ^--------- force --------'             "guide.force.x": "coil.force"}

Between two communication points nothing is exchanged.  What an input gets is decided by a scheme:

    jacobi          all inputs are the outputs at the beginning of the step
    gauss-seidel    the FMUs go one after the other, in the order of their names, and each sees
                    the outputs at the end of the step of those before it

Both make an error of the first order in the step.  With events, FMUs of FMI 3.0 that know event
mode end a step where something happens to them, and the others follow to that time: those with
events go first, with the outputs at the beginning of the step; if one of them ends earlier than the
others, these are put back and repeat the step to its time.  There the outputs are exchanged and
event mode is repeated until no input changes any more.
"""

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Self

from ..base.progress import Progress
from ..runs.result import Columns, structured
from ..runs.run import Source, communication_points
from .components import CO_SIMULATION, Component, CouplingError, Value, check_wire, start_value

GAUSS_SEIDEL, JACOBI = "gauss-seidel", "jacobi"
MOST_UPDATES = 100  # of discrete states at one time; more than this is a loop without end


class Instance(Component):
    """An FMU in a co-simulation, its variables by name.

    Parameters
    ----------
    name : str
        Of the instance.
    fmu : str or Path
        An FMU for co-simulation, of FMI 2.0 or 3.0.
    folder : str or Path
        An empty folder, where it is unpacked.
    events : bool
        Whether event mode and early return are used, if the FMU has them.

    Raises
    ------
    CouplingError
        If there is no FMU that can do that.
    """

    def __init__(
        self, name: str, fmu: str | Path, folder: str | Path, events: bool = False
    ) -> None:
        super().__init__(name, fmu, folder, CO_SIMULATION)
        self.events = events and self.version > 2 and bool(self.interface.hasEventMode)
        self.restorable = bool(self.interface.canGetAndSetFMUstate)
        self.updating = False
        self.stepping = False  # in step mode, where events may be had: no discrete inputs then
        self.given: dict[str, Value] = {}
        self.instantiate(eventModeUsed=self.events, earlyReturnAllowed=self.events)

    # -- life --

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
        """Leave initialization mode; with events, one is in event mode then."""
        self.call("exitInitializationMode")
        self.updating = self.events

    def close(self) -> None:
        """End the simulation and give the instance back, whatever has happened to it."""
        with suppress(Exception):  # it has failed before, or has not begun
            self.fmu.terminate()
        self.fmu.freeInstance()

    # -- motion --

    def step(self, end: float) -> bool:
        """Go to a time [s]; return whether something happens where it got to, ``time``."""
        result = self.call("doStep", self.time, end - self.time)
        if self.version == 2:
            self.time = end
            return False
        happens, terminated, early, reached = result
        self.time = reached if early else end
        if terminated:
            raise CouplingError(f"{self.name} has ended the simulation at {self.time:g} s")
        return bool(happens)

    def enter_events(self) -> None:
        """Go into event mode, if there is one."""
        if self.events and not self.updating:
            self.call("enterEventMode")
            self.updating, self.stepping = True, False

    def update(self) -> bool:
        """Let happen what is due; return whether there is more of it."""
        return self.updating and bool(self.call("updateDiscreteStates")[0])

    def leave_events(self) -> None:
        """Go back to steps."""
        if self.updating:
            self.call("enterStepMode")
            self.updating, self.stepping = False, True

    def at_events(self, name: str) -> bool:
        """Return whether a variable may be set now only after :meth:`enter_events`."""
        return self.stepping and self.variable(name).variability != "continuous"

    @contextmanager
    def kept(self, needed: bool) -> Iterator[Callable[[], None]]:
        """Keep the present state; what is yielded returns to it."""
        if not needed:
            yield lambda: None
            return
        if not self.restorable:
            raise CouplingError(
                f"{self.name} cannot return to a state that it has left, which a system with "
                "several FMUs with events takes: use one of them only, or events=False"
            )
        state, time = self.call("getFMUState"), self.time

        def back() -> None:
            self.call("setFMUState", state)
            self.time = time

        try:
            yield back
        finally:
            self.call("freeFMUState", state)


class System:
    """FMUs that are connected: started, advanced, closed at the end of a ``with`` block.

    Parameters
    ----------
    fmus : mapping
        The FMUs by the names of their instances, in the order in which they go.
    connections : mapping
        For inputs, ``name.variable``, the outputs that they get their values from.
    scheme : str
        ``gauss-seidel`` or ``jacobi``.
    events : bool
        Whether event mode is used, of those FMUs that have it.
    watched : sequence of str
        Further variables that ``values`` has.

    Raises
    ------
    CouplingError
        If names do not fit.
    """

    def __init__(
        self,
        fmus: Mapping[str, str | Path],
        connections: Mapping[str, str],
        scheme: str = GAUSS_SEIDEL,
        events: bool = False,
        watched: Sequence[str] = (),
    ) -> None:
        if scheme not in (GAUSS_SEIDEL, JACOBI):
            raise CouplingError(f"scheme = {scheme!r} must be {GAUSS_SEIDEL!r} or {JACOBI!r}")
        for name in fmus:
            if "." in name or not name:
                raise CouplingError(f"{name!r} is no name for an instance: leave out dots")
        self.scheme, self.connections = scheme, dict(connections)
        self.time = 0.0
        self.values: dict[str, Value] = {}
        self.folder = tempfile.TemporaryDirectory(prefix="prbm_system_")
        self.instances: dict[str, Instance] = {}
        try:
            for name, fmu in fmus.items():
                there = Path(self.folder.name) / name
                self.instances[name] = Instance(name, fmu, there, events)
            self.wires, self.read = self._wires(), self._read(watched)
        except BaseException:
            self.close()
            raise

    def _wires(self) -> dict[str, dict[str, str]]:
        """Return for each instance its inputs by their own names, with where they come from."""
        wires: dict[str, dict[str, str]] = {name: {} for name in self.instances}
        for to, source in self.connections.items():
            instance, name = self.parted(to)
            check_wire(to, instance.variable(name), source)
            giver, output = self.parted(source)
            giver.variable(output)
            wires[instance.name][name] = source
        return wires

    def _read(self, watched: Sequence[str]) -> dict[str, list[str]]:
        """Return for each instance the variables that are read of it after a step."""
        read: dict[str, list[str]] = {name: [] for name in self.instances}
        for full in dict.fromkeys([*self.connections.values(), *watched]):
            instance, name = self.parted(full)
            instance.variable(name)
            read[instance.name].append(name)
        return read

    def parted(self, full: str) -> tuple[Instance, str]:
        """Return the instance and the variable of a name ``name.variable``.

        Raises
        ------
        CouplingError
            If there is no such instance.
        """
        name, _, variable = full.partition(".")
        if name not in self.instances:
            raise CouplingError(
                f"{full!r} belongs to none of {', '.join(self.instances)}: write name.variable"
            )
        return self.instances[name], variable

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back the instances and remove what was unpacked."""
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
        """Initialize all instances with start values, ``name.variable``.

        Outputs reach the inputs within initialization mode, along chains as long as the system.
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
        """Give values to inputs and parameters, ``name.variable``."""
        for full, value in values.items():
            instance, name = self.parted(full)
            own = start_value(full, value, instance.variable(name))
            if instance.at_events(name):
                instance.enter_events()
            instance.set({name: own})
        if any(instance.updating for instance in self.instances.values()):
            self.happen()

    # -- exchange --

    def look(self, instance: Instance) -> None:
        """Read the outputs of an instance."""
        found = instance.get(self.read[instance.name])
        self.values |= {f"{instance.name}.{name}": value for name, value in found.items()}

    def wire(self, instance: Instance) -> bool:
        """Set the connected inputs of an instance; return whether one of them has changed.

        If a discrete one has, the instance is in event mode then.
        """
        given = {to: self.values[source] for to, source in self.wires[instance.name].items()}
        changed = {to: x for to, x in given.items() if x != instance.given.get(to)}
        if any(instance.at_events(to) for to in changed):
            instance.enter_events()
        instance.set({to: x for to, x in given.items() if not instance.at_events(to)})
        instance.given = given
        return bool(changed)

    def exchange(self) -> bool:
        """Read all outputs, set all connected inputs; return whether one of them has changed."""
        for instance in self.instances.values():
            self.look(instance)
        return any([self.wire(instance) for instance in self.instances.values()])

    # -- motion --

    def steps(self, end: float) -> Iterator[None]:
        """Go to a communication point [s]; stop at each row of a result on the way."""
        stuck = 0
        while True:
            begin, happens = self.time, self.advance(end)
            yield
            if happens:
                self.happen()
                yield
            if self.time >= end:
                return
            stuck = 0 if self.time > begin else stuck + 1
            if stuck > MOST_UPDATES:
                raise CouplingError(
                    f"at {self.time:g} s there is one event after the other, without an end"
                )

    def row(self, names: Sequence[str]) -> dict[str, Value]:
        """Return the time and values by name."""
        return {"time": self.time, **{name: self.values[name] for name in names}}

    def advance(self, end: float) -> bool:
        """Take one step towards a time [s], which ends earlier where something happens.

        Returns whether something happens at the ``time`` that it got to: :meth:`happen`.
        """
        leaders = [x for x in self.instances.values() if x.events]
        others = [x for x in self.instances.values() if not x.events]
        first = leaders + others if self.scheme == JACOBI else leaders
        for instance in first:
            self.wire(instance)
        if any(instance.updating for instance in leaders):  # a discrete input has changed
            self.happen()
        end, happens = self._lead(leaders, end)
        for instance in leaders:
            self.look(instance)
        for instance in others:
            if self.scheme == GAUSS_SEIDEL:
                self.wire(instance)
            instance.step(end)
            self.look(instance)
        self.time = end
        return happens

    def _lead(self, leaders: list[Instance], end: float) -> tuple[float, bool]:
        """Bring those with events to one time: the end, or the first event of all."""
        with ExitStack() as stack:
            back = [stack.enter_context(x.kept(len(leaders) > 1)) for x in leaders]
            happens = [x.step(end) for x in leaders]
            while (first := min((x.time for x in leaders), default=end)) < end:
                end = first
                for k, instance in enumerate(leaders):
                    if instance.time > end:
                        back[k]()
                        happens[k] = instance.step(end)
        return end, any(happens)

    def happen(self) -> None:
        """Let happen what is due at this time, in all instances with events.

        Raises
        ------
        CouplingError
            If it does not come to an end.
        """
        for instance in self.instances.values():
            instance.enter_events()
        self._update()

    def _update(self) -> None:
        self.exchange()
        for _ in range(MOST_UPDATES):
            more = [instance.update() for instance in self.instances.values()]
            changed = self.exchange()
            if not (changed or any(more)):
                break
        else:
            raise CouplingError(
                f"at {self.time:g} s the instances have exchanged {MOST_UPDATES} times what "
                "happens, without an end: break the loop of connections between their events"
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
) -> Columns:
    """Simulate a system of FMUs.

    Parameters
    ----------
    fmus, connections, scheme, events
        As of :class:`System`.
    stop_time, step : float
        Duration and communication step [s]; the last step may be shorter.
    values : mapping
        Start values of parameters and inputs, ``name.variable``.
    record : sequence of str
        Variables that the result has beside those that are connected, ``name.variable``.
    source : callable or None
        Gives inputs, ``name.variable``, for the step that begins at a time [s].
    tolerance : float or None
        Of the integration in the FMUs; None: their own.
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Returns
    -------
    structured array
        ``time`` and the outputs by name, a row each communication point, in the units of the
        FMUs.  Where something happens with events there are two rows, before it and after it.

    Raises
    ------
    CouplingError
        If names do not fit, or an FMU fails.
    ParameterError
        If there is no step to take.
    """
    times = communication_points(stop_time, step)
    names = list(dict.fromkeys([*record, *connections.values()]))
    rows = []
    with System(fmus, connections, scheme, events, names) as system:
        given = {} if source is None else source(0.0)
        system.start({**(values or {}), **given}, 0.0, stop_time, tolerance)
        rows.append(system.row(names))
        for k, end in enumerate(times[1:], 1):
            if source is not None:
                system.give(source(system.time))
            for _ in system.steps(end):
                rows.append(system.row(names))
            if progress is not None:
                progress(k / (len(times) - 1))
    return structured(rows)
