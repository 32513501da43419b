"""A result in motion: links, flexures, bodies, walls and impacts, to a file or to a window.

python -m prbm.plots.animation --model PRBDM2R motion.gif
python -m prbm.plots.animation result.csv motion.mp4
"""

import argparse
import functools
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..base.atomic import check_file
from ..base.errors import ParameterError, PrbmError
from ..base.names import unknown
from ..base.progress import Progress, reporter
from ..commands.arguments import ANIMATION_USAGE, animation_arguments
from ..commands.duration import span
from ..files.mechanism_file import find, load, shipped
from ..files.settings import quantity, settings
from ..mechanics.assembly import assemble
from ..mechanism.description import Mechanism
from ..runs.result import Columns, Result, ResultError, names, read_csv
from ..runs.run import simulate
from .motion import FPS, film, fmpy_command, motion, needed
from .scene import COLOURS, DPI, SIZE, Scene, pictures


class AnimationError(PrbmError, RuntimeError):
    """A film cannot be shown or written here."""


def animate(
    result: Result | Columns,
    path: str | Path,
    mechanism: Mechanism | None = None,
    values: Mapping[str, float] | None = None,
    *,
    slow: float | None = None,
    fps: float = FPS,
    start: float | None = None,
    stop: float | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a film of a result to a GIF or MP4 file, whole or not at all.

    Parameters
    ----------
    result, mechanism, values
        As :func:`motion` has them.
    path : str or Path
        File to write: .gif (by Pillow) or .mp4 (by ffmpeg).
    slow, fps, start, stop
        As :func:`film` has them.
    progress : callable or None
        Told the fraction that is done, from 0 to 1.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ResultError, ParameterError
        As :func:`motion` and :func:`film` do.
    AnimationError
        If the file cannot be written, or what writes it is not installed.
    """
    path = Path(path)
    write = _writer(path)
    moved = motion(result, mechanism, values)
    scene = Scene(moved, film(moved, slow, fps, start, stop))
    return _written(path, write, scene, progress or (lambda fraction: None))


def show(
    result: Result | Columns,
    mechanism: Mechanism | None = None,
    values: Mapping[str, float] | None = None,
    *,
    slow: float | None = None,
    fps: float = FPS,
    start: float | None = None,
    stop: float | None = None,
) -> None:
    """Show a film of a result in a window, again and again until that is closed.

    Parameters are those of :func:`animate`.

    Raises
    ------
    AnimationError
        If no window can be opened.
    """
    moved = motion(result, mechanism, values)
    chosen = film(moved, slow, fps, start, stop)
    pyplot, figure = _window()
    from matplotlib.animation import FuncAnimation

    scene = Scene(moved, chosen, figure)
    running = FuncAnimation(
        figure, scene.frame, frames=len(chosen.times), interval=1e3 / fps, cache_frame_data=False
    )
    pyplot.show(block=True)
    del running  # a window only runs the film as long as somebody keeps it


def _window() -> tuple[Any, Figure]:
    """Return pyplot and a figure that has a window."""
    remedy = (
        "run it where there is a display, with PyQt6, PySide6 or tkinter installed, or write a "
        "file: animate(result, 'motion.gif')"
    )
    try:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=SIZE, dpi=DPI)
    except Exception as error:  # each toolkit raises its own
        raise AnimationError(f"no window can be opened ({error}); {remedy}") from None
    name = pyplot.get_backend()
    if getattr(figure.canvas, "required_interactive_framework", None) is None and not (
        name.lower() in ("nbagg", "webagg", "notebook") or "ipympl" in name
    ):
        pyplot.close(figure)
        raise AnimationError(
            f"no window can be opened: matplotlib draws to files only (backend {name}); {remedy}"
        )
    return pyplot, figure


Write = Callable[[Path, Scene, Progress], None]


def _writer(path: Path) -> Write:
    """Return what writes a file of this kind."""
    kind = path.suffix.lower()
    if kind == ".gif":
        try:
            import PIL.Image  # noqa: F401
        except ImportError:
            raise AnimationError(
                f"{path.name}: GIF files need Pillow; install it with: pip install pillow"
            ) from None
        return _write_gif
    if kind == ".mp4":
        return functools.partial(_write_mp4, ffmpeg=_ffmpeg(path))
    raise AnimationError(f"{path}: cannot tell what to write; end the name in .gif or .mp4")


def _written(path: Path, write: Write, scene: Scene, progress: Progress) -> Path:
    with _whole(path) as partial:
        write(partial, scene, progress)
    return path


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Give a name beside the file, which becomes the file if all goes well."""
    partial = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        partial.touch()  # now rather than after the work
        yield partial
        os.replace(partial, path)
    except OSError as error:
        raise AnimationError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        partial.unlink(missing_ok=True)


Frame = TypeVar("Frame")


def _told(frames: Iterator[Frame], count: int, progress: Progress) -> Iterator[Frame]:
    for k, frame in enumerate(frames, start=1):
        yield frame
        progress(k / count)


def _write_gif(path: Path, scene: Scene, progress: Progress) -> None:
    from PIL import Image

    colours = _Colours(scene)

    def image(pixels: NDArray[np.uint8]) -> Image.Image:
        result = Image.fromarray(colours.indices(pixels))
        result.putpalette(colours.palette.tobytes())
        return result

    frames = map(image, pictures(scene))
    with path.open("wb") as file:
        next(frames).save(
            file,
            format="GIF",
            save_all=True,
            append_images=_told(frames, len(scene.film.times) - 1, progress),
            duration=10 * round(100 / scene.film.fps),
            loop=0,
        )


class _Colours:
    """One palette of 256 colours for all frames, so that nothing flickers.

    Those of the scene, then the most frequent: plain colours stay what they are and only blends
    of two are rounded.
    """

    def __init__(self, scene: Scene) -> None:
        last = len(scene.film.times) - 1
        hits = sorted(scene.film.hits)[:1]
        some = [0, *hits, *(min(k + 3, last) for k in hits), last // 2, last]
        pixels = np.concatenate([_packed(frame).ravel() for frame in pictures(scene, some)])
        colours, frequency = np.unique(pixels, return_counts=True)
        own = np.array([int(colour[1:], 16) for colour in COLOURS])
        common = colours[np.argsort(-frequency, kind="stable")]
        chosen = np.concatenate([own, common[~np.isin(common, own)]])[:256]
        chosen = np.pad(chosen, (0, 256 - len(chosen)), mode="edge")
        self.palette = np.stack([chosen >> 16, chosen >> 8, chosen], axis=1).astype(np.uint8)
        self.index = np.full(1 << 24, -1, np.int16)

    def indices(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return which colour of the palette is nearest to each pixel."""
        packed = _packed(pixels)
        new = np.unique(packed[self.index[packed] < 0])
        if len(new):
            rgb = np.stack([new >> 16, new >> 8 & 255, new & 255], axis=1)
            difference = rgb[:, None, :] - self.palette.astype(int)
            self.index[new] = (difference**2).sum(axis=2).argmin(axis=1)
        return self.index[packed].astype(np.uint8)


def _packed(pixels: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return colours as numbers, 0xRRGGBB."""
    result: NDArray[np.int64] = pixels.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    return result


def _ffmpeg(path: Path) -> str:
    """Return the ffmpeg program of the system, or the one that imageio-ffmpeg brings."""
    program = shutil.which("ffmpeg")
    if program is None:
        try:
            import imageio_ffmpeg  # type: ignore[import-untyped, unused-ignore]

            program = str(imageio_ffmpeg.get_ffmpeg_exe())
        except (ImportError, RuntimeError):
            raise AnimationError(
                f"{path.name}: MP4 files need ffmpeg, which is not installed; install it with: "
                "pip install imageio-ffmpeg, or write a .gif"
            ) from None
    return program


def _write_mp4(path: Path, scene: Scene, progress: Progress, *, ffmpeg: str) -> None:
    width, height = scene.figure.canvas.get_width_height()
    command = [
        ffmpeg, "-loglevel", "error", "-y",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
        "-r", f"{scene.film.fps:g}", "-i", "-",
        "-an", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
        "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-movflags", "+faststart", str(path),
    ]  # fmt: skip
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            for pixels in _told(pictures(scene), len(scene.film.times), progress):
                process.stdin.write(pixels.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass
        complaint = process.stderr.read().decode(errors="replace").strip()
    if process.returncode:
        raise AnimationError(f"{ffmpeg} failed: {complaint or 'without a word'}")


# --- command ----------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    """Animate a result, or a mechanism simulated now."""
    parser = argparse.ArgumentParser(
        prog="python -m prbm.plots.animation",
        usage=f"%(prog)s {ANIMATION_USAGE}",
        description="Write a GIF or MP4 film of a result, or of a mechanism simulated now.",
    )
    animation_arguments(parser)
    options = parser.parse_args(arguments)
    try:
        print(run(options))
    except PrbmError as error:
        parser.exit(2, f"{parser.prog}: {error}\n")
    return 0


def run(options: argparse.Namespace) -> Path:
    """Write the film that a command line says; return the file, whose folder is made.

    Raises
    ------
    PrbmError
        If there is nothing to show, or it cannot be written.
    """
    path = Path(options.files[-1])
    write = _writer(path)
    check_file(path)
    start, stop = _seconds(options.start, "--from"), _seconds(options.stop, "--to")
    moved = motion(_result(options))
    fps = FPS if options.fps is None else options.fps
    scene = Scene(moved, film(moved, options.slow, fps, start, stop))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AnimationError(f"{path}: cannot be written ({error.strerror})") from None
    return _written(path, write, scene, reporter())


def _seconds(text: str | None, option: str) -> float | None:
    return None if text is None else quantity(text, "s", option)


def _result(options: argparse.Namespace) -> Result:
    """Return the result that was asked for: read, or simulated."""
    mechanism, files = _named(options)
    if len(files) == 1:
        if mechanism is None:
            raise ParameterError("name what to show: RESULT.csv, --model or --mechanism")
        changes = settings(mechanism, options.set)
        stop_time, step = span(mechanism, changes, options.stop_time)
        return simulate(mechanism, changes, stop_time=stop_time, step=step)
    if len(files) > 2:
        raise ParameterError(f"{len(files)} files are given: RESULT.csv OUT, or OUT")
    columns = read_csv(files[0])
    mechanism = mechanism or _owner(columns)
    changes, known = settings(mechanism, options.set), mechanism.values()
    for name in changes:
        if name not in known:
            raise ParameterError(unknown(name, known))
    return Result(mechanism, mechanism.values(changes), columns)


def _named(options: argparse.Namespace) -> tuple[Mechanism | None, list[str]]:
    """Return the mechanism that was named, if one was, and the files that are left."""
    if options.mechanism is not None:
        return load(options.mechanism), options.files
    if options.model is not None:
        return find(options.model), options.files
    first = options.files[0]
    if len(options.files) == 2 and (first in shipped() or first.endswith(".toml")):
        return find(first), options.files[1:]
    return None, options.files


def _owner(columns: Columns) -> Mechanism:
    """Return the one shipped mechanism that has just the angles that a result holds.

    Where several have, as guides whose flexures stretch or do not, the first whose loops close,
    and of these the one with the fewest coordinates.
    """
    recorded = {name for name in names(columns) if name.endswith(".angle")}
    every = [load(path) for path in shipped().values()]
    alike = sorted((m for m in every if _angle_names(m) == recorded), key=_size)
    owners = [m for m in alike if _is_of(columns, m)]
    if not owners:
        fewer = [m for m in every if recorded and _parts(names(columns)) == _parts(needed(m))]
        if fewer and not alike:
            raise ResultError(
                "the result lacks the angles of the links; simulate again with\n"
                + "\nor ".join(fmpy_command(m) for m in fewer)
            )
        raise ResultError(
            "cannot tell from its columns which mechanism this is the result of: say so with "
            f"--model ({', '.join(shipped())}) or --mechanism FILE.toml"
        )
    return owners[0]


def _is_of(columns: Columns, mechanism: Mechanism) -> bool:
    """Tell whether the angles in a result close the loops of a mechanism."""
    try:
        motion(columns, mechanism)
    except ResultError:
        return False
    return True


def _size(mechanism: Mechanism) -> int:
    return assemble(mechanism, mechanism.values()).n


def _angle_names(mechanism: Mechanism) -> set[str]:
    return {name for name in needed(mechanism) if name.endswith(".angle")}


def _parts(variables: Iterable[str]) -> set[str]:
    """Return the angles of the bodies and the gaps of the stops among variables."""
    return {
        name
        for name in variables
        if name.endswith((".angle", ".gap")) and not name.startswith("link[")
    }


if __name__ == "__main__":
    sys.exit(main())
