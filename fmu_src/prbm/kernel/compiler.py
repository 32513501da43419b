"""Compilation of the C kernel, once for each platform, with a cache in the user's folder.

The library is the same for every mechanism, so an export compiles nothing if the package or the
cache has it.  The system's compiler compiles for this machine; the compiler of the Python package
``ziglang`` compiles for every platform, on Linux for glibc 2.17 or later.
"""

import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import shlex
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path

from ..base.atomic import write
from ..base.errors import PrbmError
from ..base.lock import locked
from ..base.progress import waiting
from .prebuilt import prebuilt
from .sources import UNIT, files_digest, kernel

HOST, ALL = "host", "all"
FLAGS = (
    "-std=c99", "-O3", "-ffp-contract=off", "-fvisibility=hidden", "-g0",
    # The following options do not change results.  Vectors are used explicitly where they help.
    "-fno-math-errno", "-fno-trapping-math", "-fno-tree-vectorize",
)  # fmt: skip
LINK = {
    "linux": (
        "-fPIC", "-shared", "-s", "-Wl,--build-id=none", "-Wl,-Bsymbolic", "-Wl,--no-undefined",
    ),
    "windows": ("-shared", "-s"),
    "darwin": ("-fPIC", "-dynamiclib", "-Wl,-install_name,@rpath/prbm_fmu.dylib"),
    "wasi": (
        "-mexec-model=reactor", "-s", "-Wl,--export-dynamic", "-Wl,--export=malloc",
        "-Wl,--export=free",
    ),
}  # fmt: skip
_loaded: dict[str, bytes] = {}  # Libraries of this process by the names of their cache entries.
ERROR_LINES_MAX = 6  # Lines of a compiler's output in an error message.
TEMPORARY = ("TMPDIR", "TMP", "TEMP")  # Variables that name the folder of a compiler's files.
MAGIC = b"prbm library\n"
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
OTHER_FOLDER = "set the environment variable TMPDIR to a folder that you can write to"
INSTALL = (
    "install one (on Debian or Ubuntu 'apt install gcc', on macOS 'xcode-select --install'), or "
    "the compiler of the Python package ziglang with 'python -m pip install ziglang'"
)


class CompilerError(PrbmError):
    """The kernel cannot be compiled; the message has the reason and a remedy."""


class NoCompilerError(CompilerError):
    """No compiler was found for a platform."""


@dataclass(frozen=True)
class Product:
    """A library that is compiled from the sources of the kernel.

    Parameters
    ----------
    name : str
        Name of the library without its suffix.
    flags : tuple of str
        Options of the compiler in addition to :data:`FLAGS`.
    """

    name: str
    flags: tuple[str, ...] = ()


FMU = Product("prbm_fmu")  # The library of native FMUs.
ENGINE = Product("prbm_engine", ("-DPRBM_ENGINE",))  # The library of the Python package.
PRODUCTS = (FMU, ENGINE)
LIVE = Product("prbm_live", (*ENGINE.flags, "-mllvm", "-inline-threshold=5"))
"""The module of live pages, for web browsers.  With less inlining it is a quarter smaller."""


@dataclass(frozen=True)
class Platform:
    """A platform on which native FMUs run.

    Parameters
    ----------
    name : str
        Platform tuple of FMI 3.0, which is also the name of the folder in ``binaries``.
    folder2 : str
        Name of the folder in FMI 2.0; the tuple for platforms that FMI 2.0 does not name.
    suffix : str
        Suffix of shared libraries.
    target : str
        Name of the platform for ziglang.
    """

    name: str
    folder2: str
    suffix: str
    target: str

    @property
    def system(self) -> str:
        """The operating system."""
        return self.name.partition("-")[2]


PLATFORMS = {
    p.name: p
    for p in (
        Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17"),
        Platform("aarch64-linux", "aarch64-linux", ".so", "aarch64-linux-gnu.2.17"),
        Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu"),
        Platform("aarch64-windows", "aarch64-windows", ".dll", "aarch64-windows-gnu"),
        Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos.11.0"),
        Platform("aarch64-darwin", "aarch64-darwin", ".dylib", "aarch64-macos.11.0"),
    )
}
BROWSER = Platform("wasm32-wasi", "wasm32-wasi", ".wasm", "wasm32-wasi")
"""WebAssembly, the platform of live pages.  FMUs have no libraries for it."""
SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "darwin"}
MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}


def this_platform() -> Platform | None:
    """Return the platform of this machine, None if it is not supported."""
    machine = MACHINES.get(platform.machine().lower())
    return PLATFORMS.get(f"{machine}-{SYSTEMS.get(sys.platform)}")


def libraries(
    platforms: Sequence[str],
    progress: Callable[[str], None] = lambda step: None,
    product: Product = FMU,
) -> dict[Platform, bytes]:
    """Return the compiled kernel for platforms.

    Parameters
    ----------
    platforms : sequence of str
        Names of platforms, :data:`HOST` or :data:`ALL`.
    progress : callable
        Called with a description of each stage.
    product : Product
        The library to compile.

    Returns
    -------
    dict of Platform to bytes
        The shared library of each platform.

    Raises
    ------
    CompilerError
        If there is no compiler for one of the platforms, or it fails.
    DamagedLibraryError
        If a library of the installed package is damaged.
    """
    result, files = {}, _sources()
    for name in platforms:
        if name == HOST:
            here = _host()
            found = None if os.environ.get("CC", "").strip() else _packaged(here, product, files)
            result[here] = found or _library(here, _host_compilers(), product, files, progress)
    names = PLATFORMS if ALL in platforms else [name for name in platforms if name in PLATFORMS]
    for name in names:
        chosen = PLATFORMS[name]
        result[chosen] = _prebuilt(chosen, product, files) or _library(
            chosen, _zig(chosen), product, files, progress
        )
    return result


def _sources() -> dict[str, bytes]:
    """Return the files of the kernel."""
    try:
        return kernel()
    except OSError as error:
        raise CompilerError(
            f"{error.filename} cannot be read ({error.strerror}): correct the permissions of the "
            "installed package, or install it again"
        ) from None


def browser_module(progress: Callable[[str], None] = lambda step: None) -> bytes:
    """Return the kernel as a WebAssembly module without imports, with the functions of engine.h.

    It is the same for every mechanism: the tables are passed in its memory.

    Raises
    ------
    NoCompilerError
        If the installed package has no module, and ziglang is not installed.
    CompilerError
        If ziglang fails.
    DamagedLibraryError
        If the module of the installed package is damaged.
    """
    files = _sources()
    found = prebuilt(f"{BROWSER.name}/{LIVE.name}{BROWSER.suffix}", files)
    if found is None and importlib.util.find_spec("ziglang") is None:
        raise NoCompilerError(
            "a page that simulates its mechanism needs the compiler of the Python package "
            "ziglang: install it with 'python -m pip install ziglang'"
        )
    return found or _library(BROWSER, _zig(BROWSER), LIVE, files, progress)


def _packaged(here: Platform, product: Product, files: Mapping[str, bytes]) -> bytes | None:
    """Return the library of the installed package for this machine; None if it has none."""
    own = prebuilt(f"{HOST}/{product.name}{here.suffix}", files)
    return own or _prebuilt(here, product, files)


def _prebuilt(wanted: Platform, product: Product, files: Mapping[str, bytes]) -> bytes | None:
    """Return the library of the installed package for any machine of a platform, if it has one."""
    return prebuilt(f"{wanted.name}/{product.name}{wanted.suffix}", files)


def _host() -> Platform:
    here = this_platform()
    if here is None:
        raise NoCompilerError(
            f"native FMUs do not support this machine ({platform.machine()}, {sys.platform}); "
            f"--platform all builds them for {', '.join(PLATFORMS)}"
        )
    return here


# --- compilers ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Compiler:
    """A compiler.

    Parameters
    ----------
    command : tuple of str
        The command with its first arguments.
    identity : str
        Text that distinguishes compilers and their versions in the cache.
    name : str
        Name for messages.
    duration : float
        Approximate time to compile the kernel [s], for messages.
    """

    command: tuple[str, ...]
    identity: str
    name: str
    duration: float = 10.0


def _host_compilers() -> Iterator[Compiler]:
    """Yield the compilers for this machine in order of preference; only CC if that is set."""
    found = False
    for compiler in _system_compilers():
        found = True
        yield compiler
    if os.environ.get("CC", "").strip():
        return
    try:
        yield from _zig(_host())
    except NoCompilerError:
        if not found:
            raise NoCompilerError(
                f"the kernel needs a C compiler, and none was found: {INSTALL}"
            ) from None


def _system_compilers() -> Iterator[Compiler]:
    """Yield the compilers of this system, or the one that the environment variable CC names."""
    chosen = os.environ.get("CC", "").strip()
    static = () if sys.platform == "darwin" else ("-static-libgcc",)
    for text in [chosen] if chosen else ["cc", "gcc", "clang"]:
        command = _words(text)
        path = shutil.which(command[0])
        version = _version((path, *command[1:])) if path else None
        if version is not None and path is not None:
            own = static if "Free Software" in version else ()
            yield Compiler((path, *command[1:], *own), version, text)
        elif chosen:
            raise CompilerError(
                f"the environment variable CC = {chosen!r} is not a working C compiler; unset it, "
                "or set it to one"
            )


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text, posix=os.name == "posix")
    except ValueError:
        return [text]


def _version(command: tuple[str, ...]) -> str | None:
    try:
        done = subprocess.run(
            [*command, "--version"], capture_output=True, encoding="locale", check=True,
            stdin=subprocess.DEVNULL, errors="replace",
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout


def _zig(wanted: Platform) -> list[Compiler]:
    """Return the compiler of the Python package ziglang for a platform."""
    if importlib.util.find_spec("ziglang") is None:
        raise NoCompilerError(
            f"native FMUs for {wanted.name} need the compiler of the Python package ziglang: "
            "install it with 'python -m pip install ziglang'"
        )
    version = importlib.metadata.version("ziglang")
    command = (sys.executable, "-m", "ziglang", "cc", "-target", wanted.target)
    return [Compiler(command, f"ziglang {version} {wanted.target}", "ziglang", duration=25.0)]


# --- compiling ------------------------------------------------------------------------------------


def _library(
    wanted: Platform,
    compilers: Iterable[Compiler],
    product: Product,
    files: Mapping[str, bytes],
    progress: Callable[[str], None],
) -> bytes:
    """Return the library of a platform from the first compiler that succeeds."""
    problem: CompilerError | None = None
    for compiler in compilers:
        try:
            return _cached(Job(wanted, compiler, product, files), progress)
        except CompilerError as error:
            problem = problem or error
    assert problem is not None
    raise problem


@dataclass(frozen=True)
class Job:
    """A library of a platform, the compiler that makes it, and the source files by path."""

    platform: Platform
    compiler: Compiler
    product: Product
    files: Mapping[str, bytes]

    @property
    def output(self) -> str:
        """Name of the file that the compiler writes."""
        return f"{self.product.name}{self.platform.suffix}"

    @property
    def arguments(self) -> tuple[str, ...]:
        """Arguments of the compiler, without libraries."""
        options = (*FLAGS, *self.product.flags)
        return (*options, *LINK[self.platform.system], "-I.", UNIT, "-o", self.output)

    @property
    def digest(self) -> str:
        """Hash of all that the library depends on."""
        compiler, found = self.compiler, hashlib.sha256()
        for text in (
            self.platform.name, compiler.identity, *compiler.command[1:], *self.arguments
        ):  # fmt: skip
            found.update(text.encode(errors="surrogateescape") + b"\0")
        found.update(files_digest(self.files).encode())
        return found.hexdigest()


def compiled(job: Job) -> bytes:
    """Return the library that a compiler makes of the kernel in a temporary folder.

    All paths are relative to that folder, so that the library does not contain them.

    Raises
    ------
    CompilerError
        If the compiler fails, or the temporary folder cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="prbm_") as name:
            for file, content in job.files.items():
                path = Path(name, file)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            return _run(job, Path(name))
    except OSError as error:
        raise CompilerError(
            f"the kernel cannot be compiled in a temporary folder ({error.strerror or error}): "
            f"{OTHER_FOLDER}"
        ) from None


def _run(job: Job, folder: Path) -> bytes:
    """Return the library that a compiler makes of the sources in a folder."""
    compiler, libraries = job.compiler, () if job.platform.system == "windows" else ("-lm",)
    environment = os.environ | {"LC_ALL": "C"} | dict.fromkeys(TEMPORARY, str(folder))
    if compiler.name == "ziglang":
        environment |= _zig_folders(folder)
    try:
        done = subprocess.run(
            [*compiler.command, *job.arguments, *libraries], cwd=folder,
            capture_output=True, encoding="locale", check=False, stdin=subprocess.DEVNULL,
            errors="replace", env=environment,
        )  # fmt: skip
    except OSError as error:
        raise CompilerError(
            f"{compiler.name} cannot be run ({error.strerror}); {INSTALL}"
        ) from None
    made = folder / job.output
    if done.returncode != 0 or not (made.is_file() and made.stat().st_size):
        raise CompilerError(_failure(job.platform, compiler, done))
    return made.read_bytes()


def _zig_folders(folder: Path) -> dict[str, str]:
    """Return environment variables that name the cache folders of ziglang."""
    private = private_cache()
    kept = (private or folder) / "zig"
    with suppress(OSError):
        kept.mkdir(parents=True, exist_ok=True)
    if not os.access(kept, os.W_OK):
        kept = folder / "zig"
    return {"ZIG_GLOBAL_CACHE_DIR": str(kept), "ZIG_LOCAL_CACHE_DIR": str(folder / "zig-local")}


def _failure(wanted: Platform, compiler: Compiler, done: "subprocess.CompletedProcess[str]") -> str:
    """Return the error message of a compiler that failed."""
    lines = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
    output = "; ".join(line.strip() for line in lines[-ERROR_LINES_MAX:]) or "no message"
    return (
        f"{compiler.name} cannot compile the kernel for {wanted.name} (status {done.returncode}: "
        f"{output}); try another compiler: set the environment variable CC, or {INSTALL}"
    )


# --- cache ----------------------------------------------------------------------------------------


def cache_folder() -> Path:
    """Return the folder of the cache, which may not exist or belong to another user."""
    home = Path(os.path.expanduser("~"))
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "prbm-impact"


def private_cache() -> Path | None:
    """Return a folder of the cache to which no other user can write; None if there is none.

    The folder is created if necessary.  If several users share ``XDG_CACHE_HOME``, the usual folder
    may belong to another user; then the number of this user is appended to the folder's name.
    """
    usual = cache_folder()
    if sys.platform == "win32":  # The access control list of the profile protects it.
        return usual if _created(usual) else None
    for folder in (usual, usual.with_name(f"{usual.name}-{os.geteuid()}")):
        if _created(folder):
            real = folder.resolve()  # Without links, which others might change after the check.
            if _private(real):
                return real
    return None


def _created(folder: Path) -> bool:
    """Create a folder for this user alone, if it does not exist; return success."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return False
    return True


def _private(folder: Path) -> bool:
    """Return whether only this user can write to a folder or exchange it.

    A folder of this user to which others could write is restricted.  The files of ziglang in it,
    which others may have changed, are removed; :func:`_read` checks all other files.
    """
    try:
        found = folder.stat()
        if found.st_uid == _user() and found.st_mode & OTHERS_WRITE:
            folder.chmod(0o700)
            shutil.rmtree(folder / "zig", ignore_errors=True)
            found = folder.stat()
        return trusted(found) and all(map(_keeps_entries, folder.parents))
    except OSError:
        return False


def _keeps_entries(parent: Path) -> bool:
    """Return whether no other user can rename or replace the entries of this user in a folder.

    The sticky bit prevents this.  The group with the number of the user has no other members.
    """
    found = parent.stat()
    sticky, own_group = found.st_mode & stat.S_ISVTX, found.st_gid == os.getegid() == _user()
    others = stat.S_IWOTH if own_group else OTHERS_WRITE
    return found.st_uid in (_user(), 0) and (bool(sticky) or not found.st_mode & others)


def trusted(found: os.stat_result) -> bool:
    """Return whether only this user, or the administrator, can write to a file or folder."""
    if sys.platform == "win32":  # Modes and numbers of users have no meaning there.
        return True
    return found.st_uid in (_user(), 0) and not found.st_mode & OTHERS_WRITE


def _user() -> int:
    """Return the number of this user; 0 on Windows."""
    if sys.platform == "win32":
        return 0
    return os.geteuid()


def _cached(job: Job, progress: Callable[[str], None]) -> bytes:
    """Return the library from the cache, or compile it and store it there.

    Without a private folder, or if it cannot be read or written, each process compiles the library.
    """
    name = f"{job.digest[:32]}{job.platform.suffix}"
    if name not in _loaded:
        folder = private_cache()
        if folder is None:
            content = _compile(job, progress)
            progress(
                f"the folder {cache_folder()} cannot be written, or other users can write to it: "
                "the library is not kept; the next export compiles again."
            )
        else:
            entry = folder / name
            content = _read(entry) or _store(entry, job, progress)
        _loaded[name] = content
    return _loaded[name]


def _compile(job: Job, progress: Callable[[str], None]) -> bytes:
    """Report the start of a compilation, and compile; show the remaining time on a terminal."""
    compiler = job.compiler
    progress(
        f"compiling the kernel for {job.platform.name} with {compiler.name}, once, in about "
        f"{compiler.duration:.0f} s"
    )
    with waiting(compiler.duration):
        return compiled(job)


def _store(entry: Path, job: Job, progress: Callable[[str], None]) -> bytes:
    """Compile the library and store it in the cache, unless another process has just done so."""
    with _locked(entry.parent):
        content = _read(entry)
        if content is None:
            content = _compile(job, progress)
            try:
                write(entry, MAGIC + hashlib.sha256(content).digest() + content)
            except OSError:
                progress(f"cannot write to {entry.parent}: the next export compiles again.")
    return content


def _read(entry: Path) -> bytes | None:
    """Return the library of an entry; None if it is missing, damaged, or others can write to it."""
    try:
        with entry.open("rb") as file:
            found = os.fstat(file.fileno())
            if not (stat.S_ISREG(found.st_mode) and trusted(found)):
                return None
            kept = file.read()
    except OSError:
        return None
    head = len(MAGIC) + hashlib.sha256().digest_size
    content = kept[head:]
    if kept[:head] != MAGIC + hashlib.sha256(content).digest():
        return None
    return content


def _locked(folder: Path) -> AbstractContextManager[None]:
    """Keep other exports from compiling into a folder at the same time, during a ``with`` block."""
    return locked(folder / "lock")
