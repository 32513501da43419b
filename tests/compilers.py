"""Print hashes of the motion that the kernel computes, by mechanism, compiler, level and platform.

``python tests/compilers.py`` simulates the default experiments of all shipped mechanisms with every
build whose compiler and emulator are installed.  The status is 1 if a hash differs from that of the
first build.  Options select builds, mechanisms and the first steps of the experiments.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "fmu_src"), str(ROOT / "tests" / "support")]

from builds import BUILDS, DIGITS, FMU_BUILD, digest  # noqa: E402
from prbm.files.mechanism_file import shipped  # noqa: E402


def arguments(words: Sequence[str] | None = None) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--steps", type=int, help="number of steps (default: whole experiments)")
    parser.add_argument(
        "--build", action="append", metavar="WORDS",
        help="builds whose names begin with these words, such as 'aarch64-linux zig', "
        "beside the FMU (default: all)",
    )  # fmt: skip
    parser.add_argument(
        "--model", action="append", choices=[*shipped()], help="a mechanism (default: all)"
    )
    return parser.parse_args(words)


def main(words: Sequence[str] | None = None) -> int:
    """Print the table; return 1 if hashes differ."""
    chosen = arguments(words)
    models = chosen.model or [*shipped()]
    wanted = (FMU_BUILD, *(chosen.build or [""]))
    first: dict[str, str] = {}
    different = []
    width = max(map(len, BUILDS))
    widths = [max(len(model), DIGITS) for model in models]
    print("  ".join([f"{'build':{width}}", *models]))
    for build in (name for name in BUILDS if name.startswith(wanted)):
        print(f"{build:{width}}", end="", flush=True)
        for model, size in zip(models, widths, strict=True):
            try:
                found = digest(model, build, chosen.steps)
            except pytest.skip.Exception as missing:
                print(f"  {missing}", end="")
                break
            print(f"  {found:{size}}", end="", flush=True)
            if found != first.setdefault(model, found):
                different.append(f"{build}, {model}")
        print()
    print("\n".join([f"{len(different)} differences", *different]))
    return bool(different)


if __name__ == "__main__":
    sys.exit(main())
