"""Build the FMUs: ``python build_fmu.py --help``.

Puts the source beside this file first, so that it needs no installation of the project itself.
"""

import sys
from pathlib import Path


def main() -> int:
    """Run the exporter of this source tree."""
    sys.path.insert(0, str(Path(__file__).resolve().parent / "fmu_src"))
    try:
        from prbm_fmu import cli
    except ModuleNotFoundError as error:
        print(
            f"build_fmu.py needs the Python package {error.name}; install what it needs with "
            "'python -m pip install .' in its folder",
            file=sys.stderr,
        )
        return 2
    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
