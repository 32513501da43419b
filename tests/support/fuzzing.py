"""Fuzzing of native FMUs: of their tables, and of sequences of calls.

With clang, libFuzzer searches for inputs that reach new code.  Without clang, the same targets
mutate tables and choose calls at random.  Both run with sanitizers.
"""

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from c_importer import (
    ANVIL,
    KERNEL,
    POSIX,
    SOURCES,
    TWO_STOPS,
    Job,
    compile_c,
    execute,
    importer,
    kernel_library,
    native,
    needs,
)
from guides import various
from many_parts import elastic
from prbm.interface.tables import tables
from prbm.mechanics.independent import independent
from shared import once

SANITIZERS = (
    "-O0",  # The compilation takes seconds; with optimization a minute.
    "-g",
    "-fno-omit-frame-pointer",
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
)
ENVIRONMENT = {
    "ASAN_OPTIONS": "abort_on_error=1:detect_leaks=1:allocator_may_return_null=1",
    "UBSAN_OPTIONS": "print_stacktrace=1",
}
FUZZERS = Path(__file__).with_name("fuzz")
MODELS = ("PRBDM", "PRBDM2R", TWO_STOPS, ANVIL)
CALLS = 500  # Calls per sequence.
SEED_COUNT = 20  # Initial sequences of libFuzzer.
SEQUENCE_BYTES_MAX = 4096  # Bytes that choose the calls of one sequence.
INPUT_SECONDS_MAX = 20  # libFuzzer counts a slower input as a failure.
MEMORY_MAX = 2048  # MB
TIMEOUT_MARGIN = 120.0  # s; a search that runs this much too long is stopped.


TABLE_COUNTS = re.compile(r"^(\d+) tables, (\d+) accepted, (\d+) started$", re.MULTILINE)


@dataclass(frozen=True)
class Found:
    """The result of a fuzzer: its exit status (0 for success) and its output."""

    status: int
    output: str

    def table_counts(self) -> tuple[int, int, int]:
        """Return the numbers of tables, of those accepted, and of simulations started."""
        tried, accepted, started = map(int, TABLE_COUNTS.search(self.output).groups())
        return tried, accepted, started


def sanitized_library() -> Path:
    """Return the library of the native FMUs, compiled with sanitizers."""
    return kernel_library("sanitized", SANITIZERS)


def sanitized_importer() -> Path:
    """Return the importer, compiled with sanitizers."""
    return importer(flags=SANITIZERS)


def has_libfuzzer() -> bool:
    return shutil.which("clang") is not None


@cache
def _target(name: str) -> Path:
    """Compile a fuzz target: for libFuzzer if there is clang, else with random mutations."""
    sources = [FUZZERS / f"{name}.c"]
    if name == "calls":
        sources += [path for path in sorted(SOURCES.glob("*.c")) if path.name != "main.c"]
    else:
        sources.append(KERNEL / "prbm_fmu.c")
    clang = has_libfuzzer()
    flags = [
        *SANITIZERS, "-fsanitize=fuzzer" if clang else "-DSTANDALONE", *POSIX,
        "-DPRBM=",  # Makes the functions of the kernel visible instead of static.
        "-Wno-unused-function",  # Headers of the kernel declare functions of its single file.
        "-I", str(SOURCES),
    ]  # fmt: skip
    compiler = "clang" if clang else "cc"
    return once(f"fuzz-{name}", lambda path: compile_c(path, sources, flags, "", compiler))


def _run(command: Sequence[object], seconds: float, **environment: str) -> Found:
    try:
        done = subprocess.run(
            [*map(str, command)], capture_output=True, text=True, check=False, errors="replace",
            timeout=seconds + TIMEOUT_MARGIN, env=os.environ | ENVIRONMENT | environment,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        return Found(-1, f"still running {TIMEOUT_MARGIN} s after its end: {error.stderr!r}")
    return Found(done.returncode, done.stdout + done.stderr)


def _libfuzzer(target: Path, corpus: Path, seconds: float, seed: int, longest: int) -> list[object]:
    return [
        target, f"-max_total_time={seconds:.0f}", f"-seed={seed}", f"-max_len={longest}",
        f"-timeout={INPUT_SECONDS_MAX}", f"-rss_limit_mb={MEMORY_MAX}", "-print_final_stats=1",
        f"-artifact_prefix={corpus.parent}/", corpus,
    ]  # fmt: skip


def fuzz_tables(folder: Path, seconds: float, seed: int) -> Found:
    """Mutate the tables of some mechanisms for a number of seconds."""
    corpus = folder / "tables"
    corpus.mkdir(exist_ok=True)
    seeds = []
    for model in MODELS:
        content = (native(model, 3) / "resources" / "mechanism.bin").read_bytes()
        seeds.append(corpus / f"{model}.bin")
        seeds[-1].write_bytes(content)
    # They have parts that the other models lack: a joint, a bar, a chain; guides with friction,
    # torsion, springs that act on one side, start values.
    for whole in (elastic(), various()):
        seeds.append(corpus / f"{whole.name}.bin")
        seeds[-1].write_bytes(tables(whole, (), "token", independent(whole)))
    target = _target("tables")
    if has_libfuzzer():
        longest = 2 * max(path.stat().st_size for path in seeds)
        return _run(_libfuzzer(target, corpus, seconds, seed + 1, longest), seconds)
    return _run([target, int(seconds), seed, *seeds], seconds, KEEP=str(folder / "last.bin"))


def fuzz_calls(folder: Path, model: str, fmi: int, sequences: int, seed: int) -> Found:
    """Call functions in random sequences in model exchange or co-simulation."""
    job = Job(native(model, fmi), "me", library=sanitized_library())
    done = execute(
        job, "calls", seed, sequences, CALLS,
        program=sanitized_importer(), environment=ENVIRONMENT, timeout=3600.0,
    )  # fmt: skip
    return Found(done.status, done.output.decode() + done.errors)


def search_calls(folder: Path, model: str, fmi: int, seconds: float, seed: int) -> Found:
    """Let libFuzzer look for sequences of calls that reach new code."""
    needs("clang")
    flags = (*SANITIZERS, "-fsanitize=fuzzer-no-link")
    library = kernel_library("fuzzed", flags, "clang")
    file, corpus = folder / "job.txt", folder / f"calls-{model}-{fmi}"
    file.write_text(Job(native(model, fmi), "me", library=library).text(), encoding="utf-8")
    corpus.mkdir(exist_ok=True)
    for number in range(SEED_COUNT):
        content = np.random.default_rng(seed + number).bytes(SEQUENCE_BYTES_MAX)
        (corpus / f"seed-{number}").write_bytes(content)
    command = _libfuzzer(_target("calls"), corpus, seconds, seed + 1, SEQUENCE_BYTES_MAX)
    command.insert(1, "-len_control=0")  # Long sequences from the start.
    return _run(command, seconds, PRBM_JOB=str(file))
