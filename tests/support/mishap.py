"""An FMU that logs its runs and fails as its parameter ``trouble`` selects."""

import os
import signal
import time
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

FINE, RAISES, CRASHES, EXITS, HANGS, CRASHES_ONCE, KILLS_WORKER, EXHAUSTS = range(8)


class Mishap(Fmi2Slave):
    """y = x t, or a failure in the first step.

    Each run appends x to the file whose path is in the environment variable MISHAP_LOG.
    """

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.trouble, self.pause, self.y = 1.0, FINE, 0.0, 0.0
        settable = {
            "causality": Fmi2Causality.parameter,
            "variability": Fmi2Variability.tunable,
        }
        self.register_variable(Real("x", **settable))
        self.register_variable(Real("pause", **settable))
        self.register_variable(Integer("trouble", **settable))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        """Append x to the log and wait for the time ``pause`` [s]."""
        with open(os.environ["MISHAP_LOG"], "a", encoding="utf-8") as log:
            log.write(f"{self.x!r}\n")
        time.sleep(self.pause)

    def do_step(self, current_time, step_size):
        """Make a step, or fail as selected."""
        if self.trouble == RAISES:
            raise ArithmeticError("the spring is broken")
        if self.trouble == CRASHES:
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.trouble == EXITS:
            os._exit(3)
        if self.trouble == HANGS:
            time.sleep(1e6)
        if self.trouble == KILLS_WORKER:
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(1e6)
        if self.trouble == EXHAUSTS:
            import resource

            used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (used + 2**26, used + 2**26))
            self.y = float(len(bytearray(2**30)))
        mark = Path(os.environ["MISHAP_LOG"]).with_suffix(".mark")
        if self.trouble == CRASHES_ONCE and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGSEGV)
        self.y = self.x * (current_time + step_size)
        return True
