"""Instances of native FMUs in several threads, with ThreadSanitizer.

All threads run the default experiment of the same FMU at once and must give equal results.
"""

import dataclasses
import shutil
import subprocess
from collections.abc import Sequence

import numpy as np

from c_importer import ANVIL, Job, execute, importer, kernel_library, native

from .calls import INTERFACES, NAMES
from .report import Part

FLAGS = ("-O1", "-g", "-fsanitize=thread")
ENVIRONMENT = {"TSAN_OPTIONS": "halt_on_error=0 exitcode=66"}
POINTS = 1e-3 * np.arange(101)  # s
MODELS = (ANVIL, "PRBDM2R")


def before() -> tuple[str, ...]:
    """Return a command that fixes the layout of the memory, which the sanitizer may need."""
    words = ("setarch", "-R")
    if shutil.which(words[0]) is None:
        return ()
    works = subprocess.run([*words, "true"], capture_output=True, check=False).returncode == 0
    return words if works else ()


def races(model: str, fmi: int, kind: str, threads: int) -> str:
    """Return the output of the sanitizer, empty if it finds nothing."""
    library = kernel_library("threads", FLAGS)
    job = dataclasses.replace(Job(native(model, fmi), kind, POINTS), library=library)
    found = execute(
        job, "threads", threads, program=importer(flags=FLAGS), before=before(),
        environment=ENVIRONMENT,
    )  # fmt: skip
    return found.errors or (f"status {found.status}" if found.status else "")


def run(threads: int, seed: int = 0, names: Sequence[str] | None = None) -> Part:
    """Run all interfaces of two mechanisms in threads."""
    del seed  # The runs are not random.
    part = Part("Instances in threads", ("interface", "instances", "races"))
    for fmi, kind in INTERFACES:
        found = {model: races(model, fmi, kind, threads) for model in names or MODELS}
        wrong = [f"{model}: {text[:2000]}" for model, text in found.items() if text]
        part.add(f"FMI {fmi}.0 {NAMES[kind]}", threads * len(found), len(wrong))
        part.failures += wrong
    part.total()
    return part
