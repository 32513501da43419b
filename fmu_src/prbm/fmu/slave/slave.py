"""A mechanism as a co-simulation slave of FMI 2.0, inside the wrapper library pythonfmu.

Properties of the wrapper (0.7.0), and their consequences:

* An exception in any method becomes ``fmi2Fatal``.  When the instance is freed, the wrapper then
  releases its references a second time and the process crashes.  So no method of an instance
  raises: :func:`_never_raises`.
* ``doStep`` alone can return another status: False becomes ``fmi2Discard``.  No method can return
  ``fmi2Error``.  So every error is logged at once, and ``doStep`` returns False until it is
  corrected.  If only a reset corrects it, the message says so.
* A get cannot be rejected either, and a value of another type than the requested one leaves a
  pending exception.  So an invalid get is logged and returns NaN, 0 or False.
* Log messages reach the importer as formats of C's printf: a ``%`` must be doubled.
* ``reset`` creates a new Python object of the same class; no state has to be cleared.
* The process may crash when it ends: see the module ``finalization``.
"""

import functools
import hashlib
import json
from collections.abc import Callable
from typing import Any, ClassVar

from pythonfmu import Fmi2Slave  # type: ignore[import-untyped]
from pythonfmu.enums import Fmi2Status  # type: ignore[import-untyped]

from .finalization import note_library
from .instance import Instance
from .messages import CATEGORIES, Messages
from .resolved import EMPTY, Model, read


def _never_raises(fallback: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Turn every exception of a method, Ctrl-C included, into a failure of the instance."""

    def decorate(method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def guarded(self: "MechanismSlave", *args: Any, **kwargs: Any) -> Any:
            try:
                return method(self, *args, **kwargs)
            except BaseException as error:
                self.messages.discard(self.instance.fail(error))
                return fallback

        return guarded

    return decorate


class MechanismSlave(Fmi2Slave):  # type: ignore[misc]
    """One instance of a mechanism, as pythonfmu calls it.

    The script that pythonfmu loads imports this class from the FMU's copy of the package ``prbm``
    and derives the class of the FMU from it.
    """

    model: ClassVar[Model | None] = None
    log_categories: ClassVar[dict[str, str]] = CATEGORIES

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        kind = type(self)
        note_library(self.resources, kind.__name__)
        if kind.model is None:
            kind.model = read(self.resources)
        self.messages = Messages(self.log, self.instance_name)
        identity = f"{kind.__name__}.{kind.__module__}"
        self.instance = Instance(kind.model, identity, self.messages)

    @_never_raises(None)
    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Set the time at which the simulation starts, and its relative tolerance."""
        self.instance.setup(start_time, tolerance)

    @_never_raises(None)
    def enter_initialization_mode(self) -> None:
        """Do nothing: the simulation is created when one of its values is requested."""

    @_never_raises(None)
    def exit_initialization_mode(self) -> None:
        """Start the simulation.  A failure is logged, and ``doStep`` returns False."""
        self.instance.begin()

    @_never_raises(False)
    def do_step(self, current_time: float, step_size: float) -> bool:
        """Continue to the next communication point; log the reason if that is not possible."""
        return self.instance.step(current_time, step_size)

    @_never_raises(None)
    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set parameters and inputs."""
        self.instance.set_real(vrs, values)

    @_never_raises(None)
    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        """Reject the values: no Integer can be set."""
        self.instance.refuse_all(vrs, "Integer")

    @_never_raises(None)
    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Reject the values: no Boolean can be set."""
        self.instance.refuse_all(vrs, "Boolean")

    @_never_raises(None)
    def set_string(self, vrs: list[int], values: list[str]) -> None:
        """Reject the values: the model has no String."""
        self.instance.refuse_all(vrs, "String")

    def get_real(self, vrs: list[int]) -> list[float]:
        """Return values of Real variables, NaN for all other references."""
        return self._get(vrs, "Real")

    def get_integer(self, vrs: list[int]) -> list[int]:
        """Return values of Integer variables, 0 for all other references."""
        return self._get(vrs, "Integer")

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Return values of Boolean variables, False for all other references."""
        return self._get(vrs, "Boolean")

    def get_string(self, vrs: list[int]) -> list[str]:
        """Return empty strings: the model has no String."""
        return self._get(vrs, "String")

    def _get(self, vrs: list[int], kind: str) -> list[Any]:
        try:
            return self.instance.get(vrs, kind)
        except BaseException as error:
            self.messages.error(self.instance.fail(error))
            return [EMPTY[kind]] * len(vrs)

    @_never_raises({})
    def _get_fmu_state(self) -> dict[str, Any]:
        return self.instance.saved()

    @_never_raises(None)
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self.instance.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        text = json.dumps(state).encode()
        return hashlib.sha256(text).digest() + text

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """Return a serialized state, or an empty one, which is rejected, if a byte has changed."""
        size = hashlib.sha256().digest_size
        digest, text = state[:size], state[size:]
        if hashlib.sha256(text).digest() != digest:
            return {}
        data: dict[str, Any] = json.loads(text)
        return data

    def log(
        self,
        msg: str,
        status: Fmi2Status = Fmi2Status.ok,
        category: str | None = None,
        debug: bool | None = None,
    ) -> None:
        """Send a message to the importer's log."""
        text = msg.encode(errors="replace").decode().replace("%", "%%")
        super().log(text, status, category, debug)
