"""A simulation for studies that writes to standard error."""

import os
import sys

from prbm.sweeps.children import Job
from prbm.sweeps.outputs import OK, Outcome


class Talking(Job):
    """Writes a line, or writes another one and ends its process."""

    def run(self, row):
        print("the reason" if row["a"] else "a line that is longer", file=sys.stderr, flush=True)
        if row["a"]:
            os._exit(3)
        return Outcome(OK, values=(0.0,))
