"""Messages of an instance, in the importer's log and on the standard error stream."""

import sys
from collections.abc import Callable
from weakref import WeakMethod

from pythonfmu.enums import Fmi2Status  # type: ignore[import-untyped]

EVENTS = "logEvents"
CATEGORIES = {
    EVENTS: "Impacts, with time, speeds and energy loss.",
    "logStatusWarning": "Warnings; the simulation continues.",
    "logStatusDiscard": "Reasons why a communication step was rejected or not completed.",
    "logStatusError": "Rejected values, with their bounds and a remedy.",
}


class Messages:
    """The messages of one instance.

    FMPy ends a simulation at ``fmi2Discard`` without a message, and pythonfmu forwards log messages
    only if the importer requests logging.  Warnings and the reasons of rejected steps are therefore
    printed, too, each text once.

    Parameters
    ----------
    log : bound method
        Logs a text with a status and a category; None is the category of the status.  The
        reference is weak: an instance is deleted as soon as pythonfmu releases it, not by a later
        garbage collection.
    name : str
        Name of the instance.
    """

    def __init__(self, log: Callable[[str, Fmi2Status, str | None], None], name: str) -> None:
        self._log = WeakMethod(log)
        self.name = name
        self.printed: set[str] = set()

    def event(self, sentence: str) -> None:
        """Log an event."""
        self._log_text(sentence, Fmi2Status.ok, EVENTS)

    def warning(self, sentence: str) -> None:
        """Log and print a warning, unless it has been printed before."""
        if sentence not in self.printed:
            self._log_text(sentence, Fmi2Status.warning)
            self._print(sentence)

    def error(self, sentence: str) -> None:
        """Log an error; it is not printed."""
        self._log_text(sentence, Fmi2Status.error)

    def discard(self, sentence: str) -> None:
        """Log the reason of a rejected step, and print it once."""
        self._log_text(sentence, Fmi2Status.discard)
        self._print(sentence)

    def error_once(self, sentence: str) -> None:
        """Log and print an error, unless it has been printed before; the simulation continues."""
        if sentence not in self.printed:
            self.error(sentence)
            self._print(sentence)

    def _log_text(self, sentence: str, status: Fmi2Status, category: str | None = None) -> None:
        log = self._log()
        if log is not None:
            log(sentence, status, category)

    def _print(self, sentence: str) -> None:
        if sentence not in self.printed and sys.stderr is not None:
            print(f"{self.name}: {sentence}", file=sys.stderr, flush=True)
        self.printed.add(sentence)
