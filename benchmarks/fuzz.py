"""Fuzz the native FMUs for a while: their tables, and the functions of both standards.

    python benchmarks/fuzz.py
    python benchmarks/fuzz.py --minutes 60 --keep build/fuzz

The time is shared out: a quarter for arbitrary tables, a half for sequences of calls that libFuzzer
searches (with clang; the tables, too, are then searched), a quarter for sequences that a generator
of random numbers chooses, all under the address, undefined-behaviour and leak sanitizers.  Ends
with status 1 and what was said when one of them finds something; the input that did it is kept.
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
SEQUENCES = 200  # at once
TELLING = ("Done ", "cov:", "tables,", "sequences")  # lines that say how much was tried


def searches(folder: Path, seconds: float, seed: int) -> Iterator[tuple[str, Callable[[], Found]]]:
    """Yield what is to be done, each with its name; together they take the seconds."""
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
    """Go on with further sequences until the time is over or one fails."""
    end, tried = time.monotonic() + seconds, 0
    while True:
        found = fuzz_calls(folder, model, fmi, SEQUENCES, seed + tried)
        tried += SEQUENCES
        if found.status != 0 or time.monotonic() > end:
            return Found(found.status, f"{found.said}{tried} sequences, seeds {seed} and up\n")


def main() -> None:
    """Fuzz, say how much, and fail if something was found."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=None, help="default: another one each time")
    parser.add_argument("--keep", type=Path, help="folder of the inputs; a temporary one if not")
    arguments = parser.parse_args()
    seed = int(time.time()) % 10**6 * 1000 if arguments.seed is None else arguments.seed
    print(f"seed {seed}, {'libFuzzer' if has_libfuzzer() else 'no clang: random mutations only'}")
    folder = arguments.keep or Path(tempfile.mkdtemp(prefix="prbm_fuzz_"))
    folder.mkdir(parents=True, exist_ok=True)
    for name, search in searches(folder, 60 * arguments.minutes, seed):
        found = search()
        if found.status != 0:
            sys.exit(f"{name}: status {found.status}; inputs in {folder}\n{found.said[-20000:]}")
        lines = [line for line in found.said.splitlines() if any(t in line for t in TELLING)]
        print(f"{name}: {'; '.join(line.strip() for line in lines[-2:])}", flush=True)


if __name__ == "__main__":
    main()
