"""Fuzzing of native FMUs: of their tables, and of sequences of calls.

With clang, libFuzzer looks for inputs that reach new code; without, the same targets mutate and
choose at random.  Sanitizers watch both.
"""

import os
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
from many_parts import elastic
from prbm.interface.tables import tables
from prbm.mechanics.independent import independent
from shared import once

SANITIZERS = (
    "-O0",  # which compiles in seconds what takes a minute else
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
CALLS = 500  # in a sequence
SEEDS, LONGEST = 20, 4096  # sequences to begin with; bytes that choose one
SLOW_INPUT = 20  # s; libFuzzer counts a slower input as a failure
MOST_MEMORY = 2048  # MB
LIMIT = 120.0  # s beyond the time that was asked for


@dataclass(frozen=True)
class Found:
    """What a fuzzer says; status 0 is well."""

    status: int
    said: str


def sanitized_library() -> Path:
    return kernel_library("sanitized", SANITIZERS)


def sanitized_importer() -> Path:
    return importer(flags=SANITIZERS)


def has_libfuzzer() -> bool:
    return shutil.which("clang") is not None


@cache
def _target(name: str) -> Path:
    """Compile a fuzz target: for libFuzzer if clang is there, else to mutate by itself."""
    sources = [FUZZERS / f"{name}.c"]
    if name == "calls":
        sources += [path for path in sorted(SOURCES.glob("*.c")) if path.name != "main.c"]
    else:
        sources.append(KERNEL / "prbm_fmu.c")
    clang = has_libfuzzer()
    flags = [
        *SANITIZERS, "-fsanitize=fuzzer" if clang else "-DSTANDALONE", *POSIX,
        "-DPRBM=",  # the functions of the kernel are not static
        "-I", str(SOURCES),
    ]  # fmt: skip
    compiler = "clang" if clang else "cc"
    return once(f"fuzz-{name}", lambda path: compile_c(path, sources, flags, "", compiler))


def _run(command: Sequence[object], seconds: float, **environment: str) -> Found:
    try:
        done = subprocess.run(
            [*map(str, command)], capture_output=True, text=True, check=False, errors="replace",
            timeout=seconds + LIMIT, env=os.environ | ENVIRONMENT | environment,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        return Found(-1, f"still running {LIMIT} s after its end: {error.stderr!r}")
    return Found(done.returncode, done.stdout + done.stderr)


def _libfuzzer(target: Path, corpus: Path, seconds: float, seed: int, longest: int) -> list[object]:
    return [
        target, f"-max_total_time={seconds:.0f}", f"-seed={seed}", f"-max_len={longest}",
        f"-timeout={SLOW_INPUT}", f"-rss_limit_mb={MOST_MEMORY}", "-print_final_stats=1",
        f"-artifact_prefix={corpus.parent}/", corpus,
    ]  # fmt: skip


def fuzz_tables(folder: Path, seconds: float, seed: int) -> Found:
    """Mutate the tables of the shipped mechanisms for some time."""
    corpus = folder / "tables"
    corpus.mkdir(exist_ok=True)
    seeds = []
    for model in MODELS:
        content = (native(model, 3) / "resources" / "mechanism.bin").read_bytes()
        seeds.append(corpus / f"{model}.bin")
        seeds[-1].write_bytes(content)
    whole = elastic()  # which has a joint, a bar, a chain
    seeds.append(corpus / f"{whole.name}.bin")
    seeds[-1].write_bytes(tables(whole, (), "token", independent(whole)))
    target = _target("tables")
    if has_libfuzzer():
        longest = 2 * max(path.stat().st_size for path in seeds)
        return _run(_libfuzzer(target, corpus, seconds, seed + 1, longest), seconds)
    return _run([target, int(seconds), seed, *seeds], seconds, KEEP=str(folder / "last.bin"))


def fuzz_calls(folder: Path, model: str, fmi: int, sequences: int, seed: int) -> Found:
    """Call functions in arbitrary sequences, chosen by a generator of random numbers."""
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
    for number in range(SEEDS):
        content = np.random.default_rng(seed + number).bytes(LONGEST)
        (corpus / f"seed-{number}").write_bytes(content)
    command = _libfuzzer(_target("calls"), corpus, seconds, seed + 1, LONGEST)
    command.insert(1, "-len_control=0")  # long sequences from the start
    return _run(command, seconds, PRBM_JOB=str(file))
