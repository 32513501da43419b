"""Build FMUs from the source beside this file, without an installation of the project.

Usage: ``python build_fmu.py --help``.
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent / "fmu_src"))

    from prbm.__main__ import build

    sys.exit(build())
