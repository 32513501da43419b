"""Build the FMUs: ``python build_fmu.py --help``.

Puts the source beside this file first, so that it needs no installation of the project itself.
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent / "fmu_src"))

    from prbm.commands.build_fmu import main

    sys.exit(main())
