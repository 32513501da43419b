"""``prbm picture`` and ``prbm animate``: drawings and films of mechanisms."""

import argparse
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from ..analysis.adequacy import Vibration, notes
from ..analysis.stress_field import StressRecorder
from ..base.atomic import FileError, check_file
from ..base.errors import ParameterError
from ..base.names import unknown
from ..base.progress import reporter
from ..base.unit_text import length_unit
from ..files.mechanism_file import load, read_mechanism, shipped
from ..files.settings import UserMistake, optional_quantity, settings
from ..interface.scales import extent
from ..mechanics.assembly import assemble
from ..mechanics.stress import with_stress
from ..mechanism.description import Mechanism
from ..mechanism.expressions import affine
from ..plots.animation import AnimationError, check_encoder, write_film
from ..plots.figures import save
from ..plots.motion import FPS, film, fmpy_command, motion, needed
from ..plots.picture import picture
from ..plots.scene import Scene
from ..runs.result import Columns, Result, ResultError, names, read_csv
from ..runs.run import simulate
from .duration import given_inputs, span

CENTRE_DIGITS = 3  # Decimal places of a printed centre of mass.


def write_picture(options: argparse.Namespace) -> None:
    """Draw a mechanism to a PNG file."""
    mechanism = load(options.mechanism)
    path = options.out or Path(f"{mechanism.name}.png")
    if not path.suffix:  # The name of a folder, as with --out of other commands.
        path = path / f"{mechanism.name}.png"
    check_file(path)
    values = settings(mechanism, options.set)
    figure = picture(mechanism, values, options.modes)
    try:
        print(save(figure, path))
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{error.filename}: cannot be written ({error.strerror})") from None
    for sentence in plates(mechanism, mechanism.values(values)):
        print(sentence)
    if options.modes:
        for sentence in notes(mechanism, values, [Vibration()]):
            print(sentence)


def plates(mechanism: Mechanism, values: Mapping[str, float]) -> Iterator[str]:
    """Yield mass, moment of inertia and centre of mass of each body that is cut from a plate."""
    for body in mechanism.bodies:
        if body.outline and isinstance(body.mass, str):
            mass, inertia, *centre = (
                affine(quantity)(values) for quantity in (body.mass, body.inertia, *body.centre)
            )
            factor, unit = length_unit(extent(mechanism))
            x, y = (f"{round(factor * c, CENTRE_DIGITS) + 0.0:g}" for c in centre)
            yield (
                f"{body.name}: {1e3 * mass:.4g} g, {1e6 * inertia:.4g} kg.mm2, centre of mass at "
                f"({x}, {y}) {unit}"
            )


def run_animation(options: argparse.Namespace) -> None:
    """Write a film of a result, or of a new simulation."""
    path = Path(options.files[-1])
    if len(options.files) == 1 and _is_mechanism(options.files[0]):
        raise UserMistake(f"give the file to write, too: prbm animate {path} {path.stem}.gif")
    check_encoder(path)
    check_file(path)
    start, stop = (
        optional_quantity(options.start, "s", "--from"),
        optional_quantity(options.stop, "s", "--to"),
    )
    recorder = StressRecorder() if options.stress else None
    moved = motion(_result(options, recorder))
    fps = FPS if options.fps is None else options.fps
    stress = None if recorder is None else recorder.field
    scene = Scene(moved, film(moved, options.slow, fps, start, stop), stress=stress)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AnimationError(f"{path}: cannot be written ({error.strerror})") from None
    print(write_film(scene, path, reporter()))


def _result(options: argparse.Namespace, recorder: StressRecorder | None) -> Result:
    """Return the result to show, read from a file or simulated."""
    mechanism, files = _named(options)
    if len(files) == 1:
        if mechanism is None:
            raise ParameterError(
                "nothing to show: give RESULT.csv, MECHANISM, --model or --mechanism"
            )
        if recorder is not None:
            mechanism = with_stress(mechanism)
        changes = settings(mechanism, options.set)
        stop_time, step = span(mechanism, changes, options.stop_time, engine=options.engine)
        return simulate(
            mechanism, changes, inputs=given_inputs(options), stop_time=stop_time, step=step,
            engine=options.engine, observer=recorder,
        )  # fmt: skip
    if options.input:
        raise UserMistake("--input: a result is shown; give a mechanism to simulate instead")
    if recorder is not None:
        raise UserMistake("--stress: a result has no stress in all sections; give a mechanism")
    if len(files) > 2:
        raise ParameterError(f"{len(files)} files are given; expected RESULT.csv OUT, or OUT")
    columns = read_csv(files[0])
    mechanism = mechanism or _owner(columns)
    changes, known = settings(mechanism, options.set), mechanism.values()
    for name in changes:
        if name not in known:
            raise ParameterError(unknown(name, known))
    return Result(mechanism, mechanism.values(changes), columns)


def _named(options: argparse.Namespace) -> tuple[Mechanism | None, list[str]]:
    """Return the mechanism that the command line names, if any, and the remaining files."""
    if options.mechanism is not None:
        return read_mechanism(options.mechanism), options.files
    if options.model is not None:
        return load(options.model), options.files
    first = options.files[0]
    if len(options.files) == 2 and _is_mechanism(first):
        return load(first), options.files[1:]
    return None, options.files


def _is_mechanism(name: str) -> bool:
    return name in shipped() or name.endswith(".toml")


def _owner(columns: Columns) -> Mechanism:
    """Return the shipped mechanism whose angles are exactly those of a result.

    Guides with and without stretching flexures have the same angles.  Among several candidates,
    the one with the fewest coordinates whose loops are closed is returned.
    """
    recorded = {name for name in names(columns) if name.endswith(".angle")}
    every = [read_mechanism(path) for path in shipped().values()]
    alike = sorted((m for m in every if _angle_names(m) == recorded), key=_size)
    for mechanism in alike:
        if _closes_loops(columns, mechanism):
            return mechanism
    fewer = [m for m in every if recorded and _parts(names(columns)) == _parts(needed(m))]
    if fewer and not alike:
        raise ResultError(
            "the result lacks the angles of the links; simulate again with\n"
            + "\nor ".join(fmpy_command(m) for m in fewer)
        )
    raise ResultError(
        "the columns do not identify the mechanism of this result: name it with "
        f"--model ({', '.join(shipped())}) or --mechanism FILE.toml"
    )


def _closes_loops(columns: Columns, mechanism: Mechanism) -> bool:
    """Return whether the angles of a result close the loops of a mechanism."""
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
