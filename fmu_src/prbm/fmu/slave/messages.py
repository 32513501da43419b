"""Messages of an instance: to the importer's log and, once each, to the standard error stream."""

import sys
from collections.abc import Callable
from weakref import WeakMethod

from pythonfmu.enums import Fmi2Status  # type: ignore[import-untyped]

EVENTS = "logEvents"
CATEGORIES = {
    EVENTS: "Impacts, with their time, speeds and loss of energy.",
    "logStatusWarning": "What the importer should know though the simulation goes on.",
    "logStatusDiscard": "Why a communication step was refused or could not be finished.",
    "logStatusError": "Values that were refused, with their bounds and a remedy.",
}


class Messages:
    """The messages of one instance.

    FMPy ends a simulation at ``fmi2Discard`` without a message, and pythonfmu forwards log messages
    only if the importer has asked for logging.  So the reason of a rejected step is printed, too.

    Parameters
    ----------
    log : bound method
        Logs a text with a status and a category, None for that of the status.  It is referred to
        weakly: an instance is deleted when pythonfmu releases it, not by a later collection.
    name : str
        Name of the instance.
    """

    def __init__(self, log: Callable[[str, Fmi2Status, str | None], None], name: str) -> None:
        self._log = WeakMethod(log)
        self.name = name
        self.printed: set[str] = set()

    def event(self, sentence: str) -> None:
        """Log an event."""
        self._logged(sentence, Fmi2Status.ok, EVENTS)

    def error(self, sentence: str) -> None:
        """Log an error."""
        self._logged(sentence, Fmi2Status.error)

    def discard(self, sentence: str) -> None:
        """Log the reason of a rejected step, and print it once."""
        self._logged(sentence, Fmi2Status.discard)
        self._print(sentence)

    def error_once(self, sentence: str) -> None:
        """Log and print an error that has no effect, unless that was done before."""
        if sentence not in self.printed:
            self.error(sentence)
            self._print(sentence)

    def _logged(self, sentence: str, status: Fmi2Status, category: str | None = None) -> None:
        log = self._log()
        if log is not None:
            log(sentence, status, category)

    def _print(self, sentence: str) -> None:
        if sentence not in self.printed and sys.stderr is not None:
            print(f"{self.name}: {sentence}", file=sys.stderr, flush=True)
        self.printed.add(sentence)
