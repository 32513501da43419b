"""Fuzz the native FMUs: their tables, and the functions of FMI 2.0 and 3.0.

    python benchmarks/fuzz.py
    python benchmarks/fuzz.py --minutes 60 --keep build/fuzz

The time is divided:

- a quarter for arbitrary tables;
- a half for sequences of calls that libFuzzer searches;
- a quarter for random sequences of calls.

Without clang, the tables are mutated at random, and random sequences get three quarters.  All runs
use the address, undefined-behaviour and leak sanitizers.  On a finding, the script prints the
output of the sanitizer, keeps the input and ends with status 1.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "fmu_src"))

from fuzzing import MODELS, Found, fuzz_calls, fuzz_tables, has_libfuzzer, search_calls

VERSIONS = (2, 3)
SEQUENCES = 200  # Sequences per run.
SUMMARIES = ("Done ", "cov:", "tables,", "sequences")  # Parts of lines with the number of trials.


def searches(folder: Path, seconds: float, seed: int) -> Iterator[tuple[str, Callable[[], Found]]]:
    """Yield the searches with their names; all of them together take ``seconds``."""
    yield "tables", lambda: fuzz_tables(folder, seconds / 4, seed)
    pairs = [(model, fmi) for model in MODELS for fmi in VERSIONS]
    for model, fmi in pairs if has_libfuzzer() else []:
        yield (
            f"searched calls, {model}, FMI {fmi}.0",
            lambda model=model, fmi=fmi: search_calls(
                folder, model, fmi, seconds / 2 / len(pairs), seed
            ),
        )
    share = seconds / len(pairs) * (0.25 if has_libfuzzer() else 0.75)
    for model, fmi in pairs:
        yield (
            f"random calls, {model}, FMI {fmi}.0",
            lambda model=model, fmi=fmi: random_calls(folder, model, fmi, share, seed),
        )


def random_calls(folder: Path, model: str, fmi: int, seconds: float, seed: int) -> Found:
    """Run random sequences until the time is over or one fails."""
    end, tried = time.monotonic() + seconds, 0
    while True:
        found = fuzz_calls(folder, model, fmi, SEQUENCES, seed + tried)
        tried += SEQUENCES
        if found.status != 0 or time.monotonic() > end:
            return Found(found.status, f"{found.output}{tried} sequences, seeds {seed} and up\n")


def main() -> None:
    """Run all searches, print the number of trials, and fail on a finding."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--minutes", type=float, default=10.0, help="total time (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=int, default=None, help="first seed (default: from the clock)"
    )
    parser.add_argument("--keep", type=Path, help="folder of the inputs (default: a temporary one)")
    arguments = parser.parse_args()
    seed = int(time.time()) % 10**6 * 1000 if arguments.seed is None else arguments.seed
    print(f"seed {seed}, {'libFuzzer' if has_libfuzzer() else 'no clang: random mutations only'}")
    folder = arguments.keep or Path(tempfile.mkdtemp(prefix="prbm_fuzz_"))
    folder.mkdir(parents=True, exist_ok=True)
    for name, search in searches(folder, 60 * arguments.minutes, seed):
        found = search()
        if found.status != 0:
            sys.exit(f"{name}: status {found.status}; inputs in {folder}\n{found.output[-20000:]}")
        lines = [line for line in found.output.splitlines() if any(t in line for t in SUMMARIES)]
        print(f"{name}: {'; '.join(line.strip() for line in lines[-2:])}", flush=True)


if __name__ == "__main__":
    main()
