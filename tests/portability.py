"""Run the default tests as on other machines, and print a table of the variants.

    python tests/portability.py
    python tests/portability.py --only Nehalem --only "order 1" --part tests/kernel
    python tests/portability.py --list

A variant is a set of environment variables, an interpreter or a user.  Before its tests, a probe
runs in the same environment and shows that the variant has its effect.  A variant that is not
possible on this machine, or has no effect, is doubtful: the table has the reason.  The exit status
is 1 if a test fails or all variants are doubtful, and 0 otherwise.
"""

import argparse
import getpass
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NOBODY = "nobody"
ODD_NAME = "Prüfung mit Abständen 試験"
LANGUAGE = "de_DE.UTF-8"
FAILURES_SHOWN = 20


@dataclass(frozen=True)
class Probe:
    """A Python expression with the modules that it uses, which shows the effect of a variant.

    ``expected`` is a part of its value as text.  If it is None, the value must differ from that
    in the unchanged environment.
    """

    modules: str
    expression: str
    expected: str | None


@dataclass(frozen=True)
class Variant:
    """A way to run the tests.

    Values of ``environment`` may contain ``{folder}``, the folder of the run.  ``doubt`` returns
    the reason why the variant is not possible on this machine, or an empty text.  ``python`` is
    the version of the interpreter, and ``user`` the user of the process.
    """

    name: str
    environment: tuple[tuple[str, str], ...] = ()
    arguments: tuple[str, ...] = ()
    probes: tuple[Probe, ...] = ()
    doubt: Callable[[], str] = str
    umask: int = -1
    user: str | None = None
    python: str | None = None


@dataclass(frozen=True)
class Outcome:
    """A line of the table; ``doubt`` is the reason why no test ran."""

    name: str
    doubt: str = ""
    passed: int = 0
    skipped: int = 0
    seconds: float = 0.0
    failures: tuple[str, ...] = ()


@cache
def processor_flags() -> frozenset[str]:
    """Return the instructions of this processor, as named by Linux."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return frozenset()
    pairs = (line.partition(":") for line in text.splitlines())
    return frozenset(
        w for name, _, value in pairs if name.strip() == "flags" for w in value.split()
    )


def for_linux(*machines: str) -> str:
    """Return a reason if this is not Linux, or another machine than those named."""
    if not sys.platform.startswith("linux"):
        return f"for Linux only; this is {sys.platform}"
    if machines and platform.machine() not in machines:
        return f"for {' and '.join(machines)} only; this is {platform.machine()}"
    return ""


def for_processor(*flags: str) -> str:
    """Return a reason if this is not Linux on x86-64, or the processor lacks instructions."""
    missing = [flag for flag in flags if flag not in processor_flags()]
    lacking = f"the processor has no {' and no '.join(missing)}" if missing else ""
    return for_linux("x86_64") or lacking


def for_root() -> str:
    """Return a reason if this process cannot run another one as another user."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        return f"only root can change the user; this is {getpass.getuser()}, who is no root"
    return "" if interpreter_of(NOBODY) else f"no Python >= 3.11 that {NOBODY} may execute"


def for_locale() -> str:
    """Return a reason if the locale cannot be generated."""
    program = "" if shutil.which("localedef") else "no program localedef"
    source = Path("/usr/share/i18n/locales/de_DE").exists()
    return for_linux() or program or ("" if source else "no source of the locale de_DE")


def interpreter(version: str) -> str | None:
    """Return the path of an interpreter by version: on the path or of pyenv."""
    installed = Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}")
    paths = [*map(str, sorted(installed)), shutil.which(f"python{version}")]
    return next((path for path in paths if path and works(path)), None)


def works(path: str, user: str | None = None) -> bool:
    """Return whether an interpreter can make an environment for the tests, as a user."""
    code = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))"
    try:
        done = subprocess.run(
            [path, "-I", "-c", code], cwd="/", capture_output=True, check=False, **identity(user)
        )
    except OSError:
        return False
    return done.returncode == 0


@cache
def interpreter_of(user: str) -> str | None:
    """Return the path of an interpreter that a user may execute."""
    paths = (sys.executable, "/usr/bin/python3", "/usr/local/bin/python3")
    return next((path for path in paths if works(path, user)), None)


def identity(user: str | None) -> dict:
    """Return the arguments of a process that has the rights of a user only."""
    if user is None:
        return {}
    import pwd

    entry = pwd.getpwnam(user)
    return {"user": entry.pw_uid, "group": entry.pw_gid, "extra_groups": []}


KERNELS = (
    "numpy, scipy.linalg, threadpoolctl",
    "sorted({library['architecture'] for library in threadpoolctl.threadpool_info() "
    "if library['internal_api'] == 'openblas'})",
)
THREADS = (
    KERNELS[0],
    "sorted({library['num_threads'] for library in threadpoolctl.threadpool_info() "
    "if library['internal_api'] == 'openblas'})",
)
FEATURES = (
    "numpy._core._multiarray_umath as core",
    "[name for name in core.__cpu_dispatch__ if core.__cpu_features__[name]]",
)
DIGITS = (
    "hashlib, math",
    "hashlib.sha1(repr([(math.sin(0.37 * k), math.exp(0.013 * k), math.pow(k, 0.3)) "
    "for k in range(1000)]).encode()).hexdigest()[:8]",
)
FOLDERS = (
    "os, tempfile", "os.fsencode(tempfile.gettempdir()), os.fsencode(os.path.expanduser('~'))"
)  # fmt: skip
LOCALE = ("sys, locale", "(sys.getfilesystemencoding(), locale.getencoding())")
DECIMAL = (
    "locale", "locale.setlocale(locale.LC_ALL, '') and locale.localeconv()['decimal_point']"
)  # fmt: skip
VARIABLES_OF_FOLDERS = ("TMPDIR", "TEMP", "TMP", "HOME")
OPTIMIZED = "ignore:assertions not in test modules:pytest.PytestConfigWarning"
ENCODINGS = (
    "-o", "filterwarnings=error\nignore::EncodingWarning\nerror::EncodingWarning:prbm"
)  # fmt: skip
"""Filters in the form of the settings, where the name of a module is that of a package, too."""


def blas(kernel: str, *flags: str) -> Variant:
    """Return the variant with the routines of OpenBLAS for a processor."""
    return Variant(
        kernel, (("OPENBLAS_CORETYPE", kernel),), (), (Probe(*KERNELS, f"['{kernel}']"),),
        lambda: for_processor(*flags),
    )  # fmt: skip


def order(seed: int) -> Variant:
    """Return the variant with a random order of all tests."""
    return Variant(
        f"order {seed}",
        arguments=("--random-order-bucket=global", f"--random-order-seed={seed}"),
    )


def version(number: str) -> Variant:
    """Return the variant with another interpreter, in a new virtual environment."""
    return Variant(
        f"Python {number}",
        probes=(Probe("sys", "sys.version", f"{number}."),),
        doubt=lambda: "" if interpreter(number) else f"no interpreter python{number}",
        python=number,
    )


VARIANTS = (
    Variant("unchanged"),
    blas("Nehalem", "sse4_2"),
    blas("Haswell", "avx2", "fma"),
    blas("SkylakeX", "avx512f", "avx512bw", "avx512vl", "avx512dq"),
    blas("Zen", "avx2", "fma"),
    Variant("BLAS threads", (("OPENBLAS_NUM_THREADS", "2"),), (), (Probe(*THREADS, "[2]"),)),
    Variant(
        "NumPy without AVX", (("NPY_DISABLE_CPU_FEATURES", "{features}"),), (),
        (Probe(*FEATURES, "[]"), Probe(*FEATURES, None)),
    ),
    Variant(
        "glibc without FMA", (("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"),), (),
        (Probe(*DIGITS, None),), lambda: for_linux("x86_64"),
    ),
    order(1), order(2), order(3),
    Variant(
        "odd folders",
        tuple((name, f"{{folder}}/{ODD_NAME}/{name}") for name in VARIABLES_OF_FOLDERS),
        (), (Probe(*FOLDERS, repr(ODD_NAME.encode())[2:-1]),),
    ),
    Variant(
        "locale C", (("LC_ALL", "C"), ("PYTHONCOERCECLOCALE", "0"), ("PYTHONUTF8", "0")), (),
        (Probe(*LOCALE, "('ascii', 'ANSI_X3.4-1968')"),), for_linux,
    ),
    Variant(
        "locale de_DE", (("LC_ALL", LANGUAGE), ("LOCPATH", "{folder}/locales")), (),
        (Probe(*DECIMAL, "','"),), for_locale,
    ),
    Variant(
        "time zone", (("TZ", "Pacific/Chatham"),), (),
        (Probe("time", "time.timezone", "-45900"),), for_linux,
    ),
    Variant(
        "umask 077", probes=(Probe("os", "os.umask(0)", str(0o077)),),
        doubt=for_linux, umask=0o077,
    ),
    Variant(
        "optimized", (("PYTHONOPTIMIZE", "1"),), ("-W", OPTIMIZED),
        (Probe("sys", "sys.flags.optimize", "1"),),
    ),
    Variant(
        "encoding",
        (("PYTHONWARNDEFAULTENCODING", "1"), ("PYTHONWARNINGS", "ignore::EncodingWarning")),
        ENCODINGS,
        (Probe("sys", "sys.flags.warn_default_encoding", "1"),),
    ),
    Variant(
        "unprivileged user", (), (),
        (Probe("os, pwd", "pwd.getpwuid(os.getuid()).pw_name", NOBODY),), for_root, user=NOBODY,
    ),
    version("3.12"), version("3.13"), version("3.14"),
)  # fmt: skip
"""All variants but ``combined``, which has the properties of those in COMBINED."""

COMBINED = (
    "Nehalem", "NumPy without AVX", "glibc without FMA", "order 1", "odd folders", "time zone",
    "umask 077",
)  # fmt: skip


def combined() -> Variant:
    """Return the variant that differs most from the usual environment on this machine."""
    parts = [v for v in VARIANTS if v.name in COMBINED and not v.doubt()]
    return Variant(
        "combined",
        tuple(pair for v in parts for pair in v.environment),
        tuple(word for v in parts for word in v.arguments),
        tuple(probe for v in parts for probe in v.probes if probe.expected is not None),
        umask=max(v.umask for v in parts),
    )


def numpy_features() -> str:
    """Return the optional instructions that NumPy uses here, as a list of words."""
    from numpy._core import _multiarray_umath as core

    used = core.__cpu_features__
    return " ".join(name for name in core.__cpu_dispatch__ if used[name])


class Run:
    """The run of the tests in one variant, in a new folder."""

    def __init__(self, variant: Variant, folder: Path, options: argparse.Namespace) -> None:
        self.variant = variant
        self.folder = folder
        self.options = options
        self.root = ROOT
        self.python = sys.executable
        self.environment = self._environment()

    def _environment(self) -> dict[str, str]:
        """Return the variables of the process; make the folders that they name."""
        own = {
            name: value.format(folder=self.folder, features=numpy_features())
            for name, value in self.variant.environment
        }
        if self.variant.user:
            own |= {name: str(self.folder / name) for name in ("TMPDIR", "HOME")}
        for name in own.keys() & set(VARIABLES_OF_FOLDERS):
            Path(own[name]).mkdir(parents=True)
        others = {n for v in VARIANTS for n, _ in v.environment} - set(VARIABLES_OF_FOLDERS)
        kept = {
            name: value
            for name, value in os.environ.items()
            if name not in others and not name.startswith("PYTHON")
        }
        return kept | own

    def prepare(self) -> None:
        """Make the locale, the virtual environment and the copy of the files that are needed."""
        if "LOCPATH" in self.environment:
            target = self.folder / "locales" / LANGUAGE
            target.parent.mkdir()
            call("localedef", "-i", "de_DE", "-f", "UTF-8", str(target))
        if self.variant.python:
            self.python = self._virtual_environment(interpreter(self.variant.python))
        if self.variant.user:
            if interpreter_of(self.variant.user) != sys.executable:
                self.python = self._virtual_environment(interpreter_of(self.variant.user))
            self.root = self.folder / "files"
            ignored = shutil.ignore_patterns(".git", "__pycache__", ".*_cache", ".hypothesis")
            shutil.copytree(ROOT, self.root, ignore=ignored)
            for path in (self.folder, *self.folder.glob("[!v]*"), *self.root.rglob("*")):
                shutil.chown(path, self.variant.user)

    def _virtual_environment(self, base: str | None) -> str:
        """Return the interpreter of a new environment with the package and all tools."""
        path = self.folder / "venv"
        call(str(base), "-m", "venv", str(path))
        python = str(path / ("Scripts" if os.name == "nt" else "bin") / "python")
        call(python, "-m", "pip", "install", "-q", f"{ROOT}[test]")
        return python

    def _call(self, *words: str, **options) -> subprocess.CompletedProcess:
        """Run the interpreter in the environment of the variant."""
        return subprocess.run(
            [self.python, *words], cwd=self.root, env=self.environment, umask=self.variant.umask,
            check=False, **identity(self.variant.user), **options,
        )  # fmt: skip

    def value(self, probe: Probe) -> str:
        """Return the value of the expression of a probe as text."""
        code = f"import {probe.modules}; print(ascii(({probe.expression})))"
        done = self._call("-c", code, capture_output=True)
        text = (done.stdout + done.stderr).decode(errors="replace").strip()
        return text.splitlines()[-1] if text else ""

    def doubt(self) -> str:
        """Return the reason why the variant has no effect, or an empty text."""
        for probe in self.variant.probes:
            found = self.value(probe)
            if probe.expected is None:
                usual = Run(Variant("unchanged"), self.folder, self.options).value(probe)
                if found == usual:
                    return f"no effect: {found} as without it"
            elif probe.expected not in found:
                return f"no effect: {found} instead of {probe.expected}"
        return ""

    def tests(self) -> Outcome:
        """Run the tests; return their outcome."""
        results = self.folder / "results.xml"
        words = ["-m", "pytest", "-q", "-n", str(self.options.processes), "-p", "no:cacheprovider"]
        words += [*self.variant.arguments, f"--junitxml={results}", *self.options.part]
        begin = time.monotonic()
        status = self._call(*words).returncode
        seconds = time.monotonic() - begin
        cases = [*ET.parse(results).getroot().iter("testcase")] if results.exists() else []
        failed = [*failures(cases)]
        skipped = sum(case.find("skipped") is not None for case in cases)
        if status and not failed:
            failed = [f"pytest ended with status {status}"]
        passed = len(cases) - len(failed) - skipped
        return Outcome(self.variant.name, "", max(passed, 0), skipped, seconds, (*failed,))


def failures(cases: list[ET.Element]) -> Iterator[str]:
    """Yield the names of the tests that failed, with the first line of the reason."""
    for case in cases:
        for found in (*case.findall("failure"), *case.findall("error")):
            reason = (found.get("message") or "").partition("\n")[0]
            yield f"{case.get('classname')}::{case.get('name')}: {reason}"


def call(*words: str) -> None:
    """Run a program.

    Raises
    ------
    RuntimeError
        If it fails; the message is the end of its output.
    """
    done = subprocess.run(words, capture_output=True, check=False)
    if done.returncode:
        lines = (done.stdout + done.stderr).decode(errors="replace").strip().splitlines()
        raise RuntimeError(
            f"{Path(words[0]).name} failed: {lines[-1] if lines else done.returncode}"
        )


def outcome(variant: Variant, options: argparse.Namespace) -> Outcome:
    """Return the outcome of the tests in a variant, or the reason why they did not run."""
    reason = variant.doubt()
    if reason:
        return Outcome(variant.name, reason)
    # The folder is removed without errors: a process that ends late may still write to it.
    with tempfile.TemporaryDirectory(prefix="portable-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        folder.chmod(0o755)
        run = Run(variant, folder, options)
        try:
            run.prepare()
        except RuntimeError as error:
            return Outcome(variant.name, str(error))
        reason = run.doubt()
        return Outcome(variant.name, reason) if reason else run.tests()


def table(outcomes: list[Outcome]) -> str:
    """Return the table of the variants in Markdown, with their failures below it."""
    lines = [
        "| variant | passed | failed | skipped | time in s | doubt |",
        "|---|---|---|---|---|---|",
    ]
    for x in outcomes:
        numbers = f"{x.passed} | {len(x.failures)} | {x.skipped} | {x.seconds:.0f}"
        lines.append(f"| {x.name} | {f'| | | | {x.doubt}' if x.doubt else f'{numbers} |'} |")
    for x in outcomes:
        lines += [f"{x.name}: {failure}" for failure in x.failures[:FAILURES_SHOWN]]
        if len(x.failures) > FAILURES_SHOWN:
            lines.append(f"{x.name}: and {len(x.failures) - FAILURES_SHOWN} further failures")
    return "\n".join(lines)


def status(outcomes: list[Outcome]) -> int:
    """Return 1 if a test failed or all variants are doubtful, else 0."""
    return int(any(x.failures for x in outcomes) or all(x.doubt for x in outcomes))


def main() -> int:
    """Run the chosen variants; return the exit status."""
    known = {v.name: v for v in (*VARIANTS, combined())}
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--only", action="append", choices=known, metavar="NAME",
        help="variant to run (default: all); may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--part", action="append", default=[], metavar="PATH",
        help="folder, file or name of tests (default: all default tests); may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "-n", "--processes", type=int, default=2, help="processes of pytest (default: 2)"
    )
    parser.add_argument("--list", action="store_true", help="print the names of the variants")
    options = parser.parse_args()
    chosen = [known[name] for name in options.only or known]
    if options.list:
        print(table([Outcome(v.name, v.doubt() or "possible here") for v in chosen]))
        return 0
    outcomes = []
    for variant in chosen:
        print(f"variant {variant.name}", flush=True)
        outcomes.append(outcome(variant, options))
    print(f"\n{table(outcomes)}")
    return status(outcomes)


if __name__ == "__main__":
    sys.exit(main())
