"""Films of results: links, flexures, bodies, walls and impacts, in a file or in a window."""

import functools
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..base.atomic import FileError, check_file, write
from ..base.errors import PrbmError
from ..base.progress import Progress
from ..mechanism.description import Mechanism
from ..runs.result import Columns, Result
from .motion import FPS, film, motion
from .scene import COLOURS, DPI, SIZE, Scene, pictures


class AnimationError(PrbmError, RuntimeError):
    """A film cannot be shown or written."""


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
    """Write a film of a result to a GIF or MP4 file, completely or not at all.

    Parameters
    ----------
    result, mechanism, values
        As for :func:`motion`.
    path : str or Path
        File to write: .gif (by Pillow) or .mp4 (by ffmpeg).
    slow, fps, start, stop
        As for :func:`film`.
    progress : callable or None
        Called with the completed fraction, from 0 to 1.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ResultError, ParameterError
        As for :func:`motion` and :func:`film`.
    AnimationError
        If the file cannot be written, or the software that encodes it is not installed.
    """
    path = Path(path)
    check_encoder(path)
    moved = motion(result, mechanism, values)
    return write_film(Scene(moved, film(moved, slow, fps, start, stop)), path, progress)


def check_encoder(path: Path) -> None:
    """Reject a file that cannot be encoded here, before its frames are computed.

    Raises
    ------
    AnimationError
        If the name ends neither in .gif nor in .mp4, or the encoder is not installed.
    """
    _writer(path)


def write_film(scene: Scene, path: Path, progress: Progress | None = None) -> Path:
    """Write all frames of a scene to a GIF or MP4 file, completely or not at all.

    Raises
    ------
    AnimationError
        If the file cannot be written, or the software that encodes it is not installed.
    """
    write = _writer(path)
    with _complete(path) as partial:
        write(partial, scene, progress or (lambda fraction: None))
    return path


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
    """Show a film of a result in a window, repeated until the window is closed.

    Parameters as for :func:`animate`.

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
    del running  # The window shows the film only while a reference to it exists.


def _window() -> tuple[Any, Figure]:
    """Return pyplot and a figure with a window."""
    remedy = (
        "run it where there is a display, with PyQt6, PySide6 or tkinter installed, or write a "
        "file: animate(result, 'motion.gif')"
    )
    try:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=SIZE, dpi=DPI)
    except Exception as error:  # Each toolkit has exceptions of its own.
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
    """Return the function that writes a file with this suffix."""
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
    raise AnimationError(f"{path}: unknown kind of film; end the name in .gif or .mp4")


@contextmanager
def _complete(path: Path) -> Iterator[Path]:
    """Yield a path in a temporary folder, whose content is written to the file after success."""
    try:
        path.parent.stat()  # A missing folder is not created.
        check_file(path)
        with tempfile.TemporaryDirectory(prefix="prbm_") as folder:
            draft = Path(folder, f"film{path.suffix}")
            yield draft
            write(path, draft.read_bytes())
    except FileError as error:
        raise AnimationError(str(error)) from None
    except OSError as error:
        raise AnimationError(f"{path}: cannot be written ({error.strerror or error})") from None


Frame = TypeVar("Frame")


def _reported(frames: Iterator[Frame], count: int, progress: Progress) -> Iterator[Frame]:
    """Yield frames and report the completed fraction after each of them."""
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
            append_images=_reported(frames, len(scene.film.times) - 1, progress),
            duration=10 * round(100 / scene.film.fps),
            loop=0,
        )


class _Colours:
    """One palette of 256 colours for all frames: different palettes would flicker.

    The colours of the scene come first, then the most frequent ones.  Plain colours are therefore
    exact, and only blends of two colours are rounded.
    """

    def __init__(self, scene: Scene) -> None:
        last = len(scene.film.times) - 1
        hits = sorted(scene.film.hits)[:1]
        some = [0, *hits, *(min(k + 3, last) for k in hits), last // 2, last]
        pixels = np.concatenate([_packed(frame).ravel() for frame in pictures(scene, some)])
        colours, frequency = np.unique(pixels, return_counts=True)
        own = np.array([int(colour[1:], 16) for colour in (*COLOURS, *scene.stress_colours)])
        common = colours[np.argsort(-frequency, kind="stable")]
        chosen = np.concatenate([own, common[~np.isin(common, own)]])[:256]
        chosen = np.pad(chosen, (0, 256 - len(chosen)), mode="edge")
        self.palette = np.stack([chosen >> 16, chosen >> 8, chosen], axis=1).astype(np.uint8)
        self.index = np.full(1 << 24, -1, np.int16)

    def indices(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the index of the nearest colour of the palette for each pixel."""
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
    """Return the ffmpeg program of the system, or that of the package imageio-ffmpeg."""
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
            for pixels in _reported(pictures(scene), len(scene.film.times), progress):
                process.stdin.write(pixels.tobytes())
            process.stdin.close()
        except BrokenPipeError:
            pass
        complaint = process.stderr.read().decode(errors="replace").strip()
    if process.returncode:
        raise AnimationError(f"{ffmpeg} failed: {complaint or 'without a message'}")
