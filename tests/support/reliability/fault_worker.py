"""Run a command again and again with a fault at each of its changes of files.

``python fault_worker.py JOB`` reads a JSON file with ``fault`` (the library to arm, also in
``LD_PRELOAD``), ``folder``, ``command`` (a name of :data:`COMMANDS`), ``old`` and ``new``
(arguments), ``points`` (largest number of faults) and ``log``.  It prints a JSON object with the
number of faults and the failures.
"""

import ctypes
import json
import os
import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from prbm.commands import command_line
from prbm.kernel import compiler

KILL, FULL_DISK = 1, 2
KILLED = -9
PARTIAL = ".partial"  # End of the name of a journal.


def _compile(_: Sequence[str]) -> int:
    compiler.libraries(("host",))
    return 0


COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {
    "build": lambda words: command_line.main(["build", *words]),
    "simulate": command_line.main,
    "study": command_line.main,
    "compile": _compile,
}


class Attempt(NamedTuple):
    """The status of a command, the changes of files, and those that failed."""

    status: int
    changes: int
    failed: int


class Worker:
    """The command of a job, run in forked processes."""

    def __init__(self, job: dict[str, Any]) -> None:
        self.job, self.folder = job, Path(job["folder"])
        self.fault = ctypes.CDLL(job["fault"])
        self.run = COMMANDS[job["command"]]
        self.log = Path(job["log"])

    def attempt(self, words: Sequence[str], kind: int = 0, at: int = 0) -> "Attempt":
        """Run the command with a fault."""
        source, sink = os.pipe()
        child = os.fork()
        if child == 0:
            with self.log.open("w", encoding="utf-8") as file:
                os.dup2(file.fileno(), 1)
                os.dup2(file.fileno(), 2)
            self.fault.fault_arm(os.fsencode(self.folder), kind, at)
            status = 99
            try:
                status = self.run(words)
            except SystemExit as error:
                status = error.code if isinstance(error.code, int) else 1
            except BaseException as error:
                print(f"Traceback: {type(error).__name__}: {error}", file=sys.stderr)
            sys.stdout.flush()
            sys.stderr.flush()
            counts = self.fault.fault_count(), self.fault.fault_failed()
            os.write(sink, bytes(json.dumps(counts), "ascii"))
            os._exit(status)
        os.close(sink)
        counts = json.loads(os.read(source, 100) or b"[0, 0]")
        os.close(source)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        return Attempt(status, *counts)

    def content(self) -> dict[str, bytes]:
        """Return the finished files by name."""
        paths = (p for p in sorted(self.folder.rglob("*")) if p.is_file())
        hidden = (".", "lock")
        return {
            p.relative_to(self.folder).as_posix(): p.read_bytes()
            for p in paths
            if not p.name.startswith(hidden)
        }

    def restore(self, files: dict[str, bytes]) -> None:
        """Replace the content of the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(mode=0o700, parents=True)
        for name, content in files.items():
            path = self.folder / name
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            path.write_bytes(content)

    def searched(self) -> dict[str, Any]:
        """Try all faults; return their numbers and the failures."""
        old, new = self.job["old"], self.job["new"]
        self.restore({})
        if old is not None:
            self.attempt(old)
        before = self.content()
        status, changes, _ = self.attempt(new)
        after = self.content()
        failures = [f"without a fault: status {status}, {changes} changes"]
        failures = failures if status or not changes or not after else []
        stride = max(1, changes // self.job["points"])
        points = range(1, changes + 1, stride)
        for kind in (KILL, FULL_DISK):
            for at in points:
                self.restore(before)
                found = self.attempt(new, kind, at)
                failures += [f"{self._name(kind, at)}: {x}" for x in self._wrong(
                    kind, found, before, after
                )]  # fmt: skip
        return {"changes": changes, "faults": 2 * len(points), "failures": failures}

    def _name(self, kind: int, at: int) -> str:
        return f"{self.job['command']}, {'killed' if kind == KILL else 'disk full'} at {at}"

    def _wrong(
        self, kind: int, found: "Attempt", before: dict[str, bytes], after: dict[str, bytes]
    ) -> list[str]:
        """Return the violations after a fault: partial files, tracebacks, no recovery."""
        text, wrong = self.log.read_text(encoding="utf-8", errors="replace"), []
        if "Traceback" in text:
            wrong.append(f"traceback: {text[-300:]!r}")
        if kind == KILL and found.status != KILLED:
            wrong.append(f"the process was not killed: status {found.status}")
        reported = found.status and text.strip()
        if found.failed and not reported and self.job["command"] != "compile":
            wrong.append(f"status {found.status} with the output {text[-200:]!r}")
        for name, content in self.content().items():
            if name.endswith(PARTIAL):  # Completed rows, from which the next run continues.
                continue
            if content not in (before.get(name), after.get(name)):
                wrong.append(f"{name} is neither old nor new")
        status = self.attempt(self.job["new"]).status
        if status or self.content() != after:
            wrong.append(f"the next run fails: status {status}")
        return wrong


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        result = Worker(json.load(file)).searched()
    print(json.dumps(result))
