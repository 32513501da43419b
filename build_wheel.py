"""Build a wheel with the libraries of all platforms into the folder ``wheels``.

Usage: ``python build_wheel.py``.  It needs a network for the packages of the build only.
"""

import os
import subprocess
import sys
from pathlib import Path

if __name__ == "__main__":
    command = [sys.executable, "-m", "pip", "wheel", ".", "--no-deps", "--wheel-dir", "wheels"]
    folder = Path(__file__).resolve().parent
    environment = os.environ | {"PRBM_LIBRARIES": "all"}
    sys.exit(subprocess.run(command, cwd=folder, env=environment, check=False).returncode)
