"""Simulations for studies that write to standard error or hang."""

import os
import sys
import time

from prbm.sweeps.children import Job
from prbm.sweeps.outputs import OK, Outcome


class Talking(Job):
    """Writes a line, or writes another one and ends its process."""

    def run(self, row):
        print("the reason" if row["a"] else "a line that is longer", file=sys.stderr, flush=True)
        if row["a"]:
            os._exit(3)
        return Outcome(OK, values=(0.0,))


class Hanging(Talking):
    """A simulation that cannot be opened: that never ends."""

    def opened(self):
        time.sleep(1e6)
