"""Run the reliability campaign and print its tables.

    python benchmarks/reliability.py --short
    python benchmarks/reliability.py --page docs/reliability.md
    python benchmarks/reliability.py --part calls --part draws --seed 1000

The parts are described in ``docs/reliability.md`` and in ``tests/support/reliability``.  The exit
status is 1 if there is a failure; failures are listed with the words that repeat them.
"""

import argparse
import importlib
import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from reliability.report import Part

PARTS = {
    # Name: size of the long run, size of the short run.
    "calls": (2_000_000, 100_000),
    "python_calls": (300, 40),
    "states": (20_000, 2_000),
    "draws": (2_000, 20),
    "texts": (5_000, 300),
    "faults": (20, 3),
    "hostile": (4, 2),
    "readers": (5, 5),
    "threads": (8, 4),
    "versions": (3, 1),
}
"""Calls in total, actions of each Python FMU, damaged states in total, draws of each mechanism,
texts of each kind, points of failure of each command, kinds of links and devices, kinds of files
that cannot be read, threads, and environments with versions of dependencies."""


def main() -> int:
    """Run the chosen parts; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--part", action="append", choices=PARTS, metavar="PART",
        help=f"part to run: {', '.join(PARTS)} (default: all); may be repeated",
    )  # fmt: skip
    parser.add_argument("--short", action="store_true", help="a few minutes in total")
    parser.add_argument("--seed", type=int, default=0, help="first seed (default: %(default)s)")
    parser.add_argument("--page", type=Path, help="page whose tables are replaced")
    parser.add_argument("--show", type=int, default=40, help="failures to list (default: 40)")
    options = parser.parse_args()
    failed = 0
    for name in options.part or PARTS:
        size = PARTS[name][options.short]
        begin = time.process_time(), time.monotonic()
        print(f"{name}:", file=sys.stderr)
        part = importlib.import_module(f"reliability.{name}").run(size, options.seed)
        print(f"\n{part.title} ({time.monotonic() - begin[1]:.0f} s)\n\n{part.table()}")
        for line in part.failures[: options.show]:
            print(f"failure: {line}")
        failed += len(part.failures)
        if options.page:
            replace(options.page, name, part)
    return 1 if failed else 0


def replace(page: Path, name: str, part: Part) -> None:
    """Replace the table of a part between the comments of its name on a page."""
    text = page.read_text(encoding="utf-8")
    block = f"<!-- {name} -->\n{part.table()}\n<!-- end -->"
    changed = re.sub(rf"<!-- {name} -->.*?<!-- end -->", lambda _: block, text, flags=re.DOTALL)
    page.write_text(changed, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
