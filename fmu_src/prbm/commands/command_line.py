"""The command ``prbm``: its arguments, and the function that runs each command.

Text goes to standard output, progress and errors to standard error.  Tables and figures go into the
folder given by ``--out``, all at once after the computation.  The exit status is 0, 1 if a
computation fails, 2 for a mistake of the user, 130 after Ctrl-C.
"""

import argparse
import importlib
import os
import re
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from ..base.errors import EquilibriumError, PrbmError, SimulationError
from ..base.progress import CLEAR
from ..base.version import __version__
from ..mechanism.flexure import MODELS
from .arguments import (
    ANIMATION_USAGE,
    ProposingParser,
    animation_arguments,
    engine_argument,
    input_argument,
    picture_arguments,
    set_argument,
    stop_time_argument,
    study_arguments,
    sweep_arguments,
)
from .program import FAILED, INTERRUPTED, MISTAKE, OK
from .remedies import in_options

WIDTH = 79  # Columns of a description.
NEGATIVE = re.compile(r"-\.?\d")
MECHANISM = "name of a shipped mechanism (see prbm list), or mechanism file FILE.toml"
QUANTITIES = 'quantities are in SI or have a unit: 0.01, 10mm, "-10 mm"; in lists also -10 0 10 mm'
METHODS = ("algebraic", "simulated", "fitted", "elements", "closed-form")


class _ArgumentError(Exception):
    """Invalid command line."""


class _Parser(ProposingParser):
    """A parser that reports a mistake in one sentence."""

    def error(self, message: str) -> NoReturn:
        raise _ArgumentError(f"{self.prog}: {self.proposed(message)}; see {self.prog} --help")


Commands = Any  # argparse does not name the type of add_subparsers()


def _command(
    commands: Commands,
    name: str,
    run: str,
    summary: str,
    example: str,
    *,
    details: str = "",
    **more: Any,
) -> argparse.ArgumentParser:
    """Add a command.

    Parameters
    ----------
    commands : subparsers of argparse
        The commands so far.
    name : str
        Name of the command.
    run : str
        Its function as module:function, imported when the command runs.
    summary, details : str
        Phrase for the list of commands; further sentences for the help of this command.
    example : str
        Examples of command lines.
    more : dict
        Further arguments of the parser.
    """
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=textwrap.fill(f"{summary[0].upper()}{summary[1:]}.  {details}", WIDTH),
        epilog=f"{example}\n\n{QUANTITIES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        **more,
    )
    parser.set_defaults(run=run, prog=parser.prog)
    return parser


def _examples(*lines: str) -> str:
    return "\n  ".join(["example:" if len(lines) == 1 else "examples:", *lines])


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    p = _Parser(
        prog="prbm",
        description="Analyse a compliant mechanism with stops: natural frequencies, "
        "rest positions,\nmotion through impacts, and parameters from measured data.",
        epilog=_examples(
            "prbm list",
            "prbm modes PRBDM2R",
            "prbm simulate PRBDM2R --set stop.restitution=0.5 --out results",
            "prbm simulate my_mechanism.toml",
        )
        + "\n\nResults are printed; --out DIR also writes tables (CSV) and figures (PNG) into a "
        "folder.\nprbm-build-fmu builds FMUs of the same mechanisms.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    p.add_argument(
        "--version", action="version", version=f"prbm-impact {__version__}",
        help="print the version and exit",
    )  # fmt: skip
    commands = p.add_subparsers(title="commands", metavar="COMMAND", parser_class=_Parser)
    _list(commands)
    _modes(commands)
    _equilibrium(commands)
    _simulate(commands)
    _fit(commands)
    _impact_map(commands)
    _contact(commands)
    _sweep(commands)
    _study(commands)
    _measure(commands)
    _picture(commands)
    _animate(commands)
    _validate(commands)
    _completion(commands)
    return p


# --- arguments --------------------------------------------------------------------------------


def _mechanism(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("mechanism", metavar="MECHANISM", help=MECHANISM)


def _out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="folder for tables and figures (default: none are written)",
    )  # fmt: skip


def _list(commands: Commands) -> None:
    _command(
        commands,
        "list",
        "shipped:print_list",
        "list the shipped mechanisms",
        _examples("prbm list"),
    )


def _modes(commands: Commands) -> None:
    parser = _command(
        commands, "modes", "modes:frequencies",
        "natural frequencies and modes, about the equilibrium under gravity or a held shape",
        _examples("prbm modes PRBDM2R", "prbm modes PRBDM2R --held -10mm --out modes"),
    )  # fmt: skip
    _mechanism(parser)
    parser.add_argument(
        "--count", type=int, default=6, metavar="N", help="number of modes (default: %(default)s)"
    )
    parser.add_argument(
        "--held", metavar="X",
        help="displacement [m] at which the released body is held, or angle [rad] if it is "
        "released by an angle (default: not held)",
    )  # fmt: skip
    set_argument(parser)
    _out(parser)


def _contact(commands: Commands) -> None:
    parser = _command(
        commands, "contact", "contact:contact",
        "stiffness of a compliant stop from radii and materials; force and duration of a hit",
        _examples(
            'prbm contact --radius "5 mm" --youngs-modulus "200 GPa" --mass 53g --speed "0.8 m/s"',
            'prbm contact --thickness 2mm --area "100 mm2" --youngs-modulus "10 MPa"',
        ),
    )  # fmt: skip
    for option, text in (
        ("--radius", "radius of the sphere [m]"),
        ("--wall-radius", "radius of the wall, negative if hollow [m] (default: a plane)"),
        ("--youngs-modulus", "Young's modulus of the sphere or of the pad [Pa]"),
        ("--wall-modulus", "Young's modulus of the wall [Pa] (default: that of the sphere)"),
        ("--wall-poisson", "Poisson's ratio of the wall (default: that of the sphere)"),
        ("--thickness", "thickness of a pad [m], instead of a radius"),
        ("--area", "area of the pad [m2]"),
        ("--stiffness", "contact stiffness, instead of a radius or a thickness"),
        ("--mass", "mass that hits the stop [kg]"),
        ("--speed", "its speed [m/s]"),
    ):
        parser.add_argument(option, metavar="X", help=text)
    for option, default in (("--poisson", "0.3"), ("--exponent", "1"), ("--restitution", "0.6")):
        name = option[2:].replace("poisson", "Poisson's ratio")
        parser.add_argument(
            option, metavar="X", default=default, help=f"{name} (default: {default})"
        )


def _equilibrium(commands: Commands) -> None:
    parser = _command(
        commands, "equilibrium", "rest:rest_positions",
        "rest positions under gravity, the force that holds the released body at other "
        "displacements, and snap-through",
        _examples(
            "prbm equilibrium PRBDM2R",
            "prbm equilibrium PRBDM2R --held -10 -5 5 10 mm",
            "prbm equilibrium Bistable --from -2mm --to 26mm --out curve",
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    text = "displacements [m] or angles [rad] at which the body is held"
    add("--held", nargs="+", metavar="X", help=text)
    add("--from", dest="start", metavar="A", help="first displacement of a force curve [m]")
    add("--to", dest="end", metavar="B", help="last displacement of the force curve [m]")
    add(
        "--points", type=int, default=41, metavar="N",
        help="number of points of the force curve (default: %(default)s)",
    )  # fmt: skip
    set_argument(parser)
    _out(parser)


def _simulate(commands: Commands) -> None:
    parser = _command(
        commands, "simulate", "simulation:run_simulation",
        "simulate the motion after the release, through all impacts",
        _examples(
            "prbm simulate PRBDM2R --set stop.restitution=0.5 --out results",
            "prbm simulate PRBDM2R --spectrum first --out results",
            'prbm simulate PRBDM2R --input "base.acceleration.x=half-sine(50 g, 2 ms)"',
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    stop_time_argument(parser)
    add(
        "--step", metavar="T",
        help="time between rows of the table [s] (default: at most a thousandth of the duration, "
        "and at least 40 rows per fundamental period)",
    )  # fmt: skip
    add(
        "--tolerance", metavar="X",
        help="relative tolerance of the integration (default: solver.tolerance)",
    )  # fmt: skip
    set_argument(parser, "value of a parameter or input")
    input_argument(parser)
    add(
        "--spectrum", nargs="?", const="first", choices=("first", "last"),
        help="compute spectra of the vibration after an impact; first: after the first impact, "
        "simulated without the wall from there; last: after the last impact of the simulation; "
        "without a value: first",
    )  # fmt: skip
    add(
        "--spectrum-time", default="0.2", metavar="T",
        help="duration of the vibration after the first impact [s] (default: %(default)s)",
    )  # fmt: skip
    engine_argument(parser)
    _out(parser)


def _record(parser: argparse.ArgumentParser) -> None:
    """Add the options for files whose head lacks names or units."""
    group = parser.add_argument_group("names and units of columns")
    group.add_argument(
        "--unit", action="append", default=[], metavar="NAME=UNIT",
        help="unit of a column without a unit, or with a wrong one; repeatable",
    )  # fmt: skip
    group.add_argument(
        "--columns", nargs="+", metavar="HEAD",
        help='names and units of all columns of a file without a head: --columns "t [s]" "x [mm]"',
    )  # fmt: skip


def _signal(parser: argparse.ArgumentParser) -> None:
    """Add the options that select the signal and its time span."""
    group = parser.add_argument_group("selection of the signal")
    group.add_argument(
        "--column", metavar="NAME",
        help="column of the signal (default: the only column with a suitable unit)",
    )  # fmt: skip
    group.add_argument("--from", dest="start", metavar="T", help="start of the time span [s]")
    group.add_argument("--to", dest="end", metavar="T", help="end of the time span [s]")
    group.add_argument(
        "--calibration", metavar="FILE.csv",
        help="readings of the sensor beside a reference; the signal is converted accordingly",
    )  # fmt: skip


def _response(parser: argparse.ArgumentParser) -> None:
    """Add the options that relate a recorded signal to a simulation."""
    add = parser.add_argument
    add("--release", metavar="T", help="time of the release in the record [s] (default: 0)")
    add(
        "--output", metavar="NAME",
        help="recorded output of the mechanism, e.g. shuttle.x (default: the displacement of the "
        "released body along the direction of the release)",
    )  # fmt: skip
    add(
        "--uncertainty", metavar="U",
        help="standard uncertainty of a sample (default: estimated from the residuals)",
    )  # fmt: skip
    engine_argument(parser)


def _fit(commands: Commands) -> None:
    parser = _command(
        commands, "fit", "fitting:run_fit",
        "fit parameters of a mechanism to natural frequencies, a response or a force curve",
        _examples(
            'prbm fit PRBDM --free flexure.K_theta --frequency "4.82 Hz +- 0.06"',
            "prbm fit PRBDM2R --free flexure.youngs_modulus=100:250GPa \\\n"
            "      --force-deflection force.csv --out fit",
            "prbm fit PRBDM --free stop.restitution --free record.shift=-5:5ms \\\n"
            "      --response bounce.csv --column x",
        ),
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    add(
        "--free", action="append", required=True, metavar="NAME[=LOW:HIGH]",
        help="parameter to fit, with bounds; repeatable.  record.shift [s] is the time since the "
        "release at time zero of the record, record.zero the reading at zero output",
    )  # fmt: skip
    set_argument(parser)
    targets = parser.add_argument_group("measured data (at least one)")
    targets.add_argument(
        "--frequency", action="append", default=[], metavar="F",
        help='natural frequency with its standard uncertainty: "4.82 Hz +- 0.06" of the first '
        'mode at rest, "130 Hz +- 1 mode 2 at -10 mm" of the second mode held at -10 mm; '
        "repeatable",
    )  # fmt: skip
    targets.add_argument(
        "--response", metavar="FILE.csv", help="motion over time since the release"
    )
    targets.add_argument(
        "--force-deflection", metavar="FILE.csv", help="holding forces over displacements"
    )
    add("--deflection", metavar="NAME", help="column of displacements (default: the only lengths)")
    add("--force", metavar="NAME", help="column of forces (default: the only forces)")
    add(
        "--force-uncertainty", metavar="U",
        help="standard uncertainty of a force [N] (default: estimated from the residuals)",
    )  # fmt: skip
    _response(parser)
    _signal(parser)
    _record(parser)
    _out(parser)


def _impact_map(commands: Commands) -> None:
    parser = _command(
        commands, "impact-map", "maps:print_maps",
        "maps of the modal restitution over positions of the wall and offsets of the hit point",
        _examples(
            "prbm impact-map PRBDM2R --model 2R --axial",
            "prbm impact-map PRBDM2R --method algebraic simulated \\\n"
            "      --wall-positions -10 0 10 mm --offsets -4 0 4 mm --out map",
        ),
        details="The modal restitution is the velocity of the fundamental mode after an impact, "
        "divided by that before, with the sign reversed.",
    )  # fmt: skip
    _mechanism(parser)
    add = parser.add_argument
    add(
        "--wall-positions", nargs="+", metavar="X",
        help="positions of the wall [m] (default: five, up to 5/9 of the release on both sides)",
    )  # fmt: skip
    add(
        "--offsets", nargs="+", metavar="D",
        help="offsets of the hit point [m] (default: five, up to 1/20 of the size on both sides)",
    )  # fmt: skip
    add(
        "--method", nargs="+", default=["algebraic"], metavar="METHOD", choices=METHODS,
        help="algebraic: the arriving motion is the fundamental mode alone; simulated: first "
        "impact after the release; fitted: restitution of a 1R model with the same motion (takes "
        "minutes); elements: finite elements; closed-form: formula for a single body that moves "
        "along a path without turning (default: algebraic)",
    )  # fmt: skip
    add("--heights", nargs="+", dest="wall_positions", help=argparse.SUPPRESS)  # former name
    add("--way", nargs="+", dest="method", choices=METHODS, help=argparse.SUPPRESS)  # former name
    add(
        "--model", nargs="+", default=[], metavar="M", choices=tuple(MODELS),
        help=f"models of the flexures: {', '.join(MODELS)} (default: those of the mechanism)",
    )  # fmt: skip
    add("--axial", action="store_true", help="the flexures of --model stretch")
    add(
        "--links", type=int, default=12, metavar="N",
        help="number of links of an nR flexure (default: %(default)s)",
    )  # fmt: skip
    add(
        "--elements", type=int, default=16, metavar="N",
        help="number of finite elements per flexure (default: %(default)s)",
    )  # fmt: skip
    add("--stop", metavar="NAME", help="stop that is hit (default: the first)")
    engine_argument(parser)
    set_argument(parser)
    _out(parser)


def _sweep(commands: Commands) -> None:
    parser = _command(
        commands, "sweep", "sweeps:run_sweep",
        "simulate an FMU once for each row of a table: parameter studies, Monte Carlo",
        _examples(
            "prbm sweep dist/fmi2/PRBDM2R.fmu table.csv --output stop.impact_count \\\n"
            '      --output "max(shuttle.x)" --stop-time 500ms --out settling.parquet'
        ),
    )  # fmt: skip
    sweep_arguments(parser)


def _study(commands: Commands) -> None:
    parser = _command(
        commands, "study", "study:run_study",
        "simulate over one or two parameters, and find the optimum of an output",
        _examples(
            'prbm study PRBDM2R --vary "stop.position=-4:2 mm:25" --stop-time 0.5 \\\n'
            '      --of settling "max(abs(shuttle.vx))" --minimise settling --out results',
        ),
    )  # fmt: skip
    _mechanism(parser)
    study_arguments(parser)
    set_argument(parser, "value of a parameter or input in all simulations")
    input_argument(parser)
    stop_time_argument(parser)
    _out(parser)


def _picture(commands: Commands) -> None:
    parser = _command(
        commands, "picture", "pictures:write_picture",
        "draw a mechanism with the names of its parts, and its modes, as PNG",
        _examples("prbm picture FoldedSuspension --modes 3 --out folded.png"),
    )  # fmt: skip
    picture_arguments(parser)


def _animate(commands: Commands) -> None:
    parser = _command(
        commands, "animate", "pictures:run_animation",
        "film of a result, or of a new simulation, as GIF or MP4",
        _examples(
            "prbm animate PRBDM2R motion.gif --stop-time 0.3",
            "prbm animate results/PRBDM2R.csv motion.mp4",
        ),
        usage=f"%(prog)s {ANIMATION_USAGE}",
    )  # fmt: skip
    animation_arguments(parser)


def _validate(commands: Commands) -> None:
    parser = _command(
        commands, "validate", "validation:print_validation",
        "compare a mechanism with finite elements and measurements, or reproduce the thesis "
        "behind the models",
        _examples(
            "prbm validate --out validation",
            'prbm validate my_mechanism.toml --measured "frequency 1 at rest=4.82 Hz +- 0.06"',
        ),
        details="The thesis is S. Boersma, Modelling and Validation of the Impact Response in "
        "Compliant Mechanisms, TU Delft, 2015.",
    )  # fmt: skip
    add = parser.add_argument
    add(
        "mechanism", nargs="?", metavar="MECHANISM",
        help=f"{MECHANISM} (default: reproduce the thesis)",
    )  # fmt: skip
    add(
        "--only", nargs="+", default=[], metavar="NAME",
        help="results of the thesis to reproduce (default: all)",
    )  # fmt: skip
    add("--list", action="store_true", help="list the names of the results of the thesis and exit")
    add(
        "--elements", type=int, metavar="N",
        help="number of finite elements per flexure of MECHANISM (default: 32)",
    )  # fmt: skip
    add(
        "--measured", action="append", default=[], metavar="NAME=VALUE+-U",
        help="measured value with its standard uncertainty; repeatable",
    )  # fmt: skip
    set_argument(parser)
    _out(parser)


def _completion(commands: Commands) -> None:
    parser = _command(
        commands, "completion", "completion:print_completion",
        "print a script for tab completion of commands, options and mechanisms",
        _examples("prbm completion bash"),
        details='In bash, eval "$(prbm completion bash)" in ~/.bashrc switches it on.',
    )  # fmt: skip
    parser.add_argument("shell", choices=("bash",), help="the shell")


# --- measure ----------------------------------------------------------------------------------


def _measure(commands: Commands) -> None:
    parser = _command(
        commands, "measure", "", "one quantity from measured data, with its uncertainty",
        _examples("prbm measure frequency free.csv"),
    )  # fmt: skip
    kinds = parser.add_subparsers(
        title="quantities", metavar="QUANTITY", parser_class=_Parser, required=True
    )
    _modulus(kinds)
    _calibration(kinds)
    _frequency(kinds)
    _restitution(kinds)


def _modulus(kinds: Commands) -> None:
    parser = _command(
        kinds, "youngs-modulus", "measure:modulus",
        "Young's modulus from cantilever beams bent by a force, one file per beam",
        _examples(
            'prbm measure youngs-modulus bending.csv --length "40 mm +- 0.05" \\\n'
            '      --width "8 mm +- 0.02" --thickness "0.1 mm +- 0.5 %"'
        ),
    )  # fmt: skip
    add = parser.add_argument
    add("files", nargs="+", metavar="FILE.csv", help="deflections and forces in order of time")
    for size, meaning in (
        ("length", "distance from the clamp to the force"), ("width", "width of the beam"),
        ("thickness", "thickness in the direction of bending"),
    ):  # fmt: skip
        add(
            f"--{size}", action="append", required=True, metavar="X+-U",
            help=f"{meaning} [m] with its standard uncertainty; once for all files, or once per "
            "file",
        )  # fmt: skip
    add("--deflection", metavar="NAME", help="column of deflections (default: the only lengths)")
    add("--force", metavar="NAME", help="column of forces (default: the only forces)")
    add(
        "--fit-range", nargs=2, type=float, default=(0.25, 0.9), metavar=("LOW", "HIGH"),
        help="range of the fitted line, as shares of the largest deflection (default: 0.25 0.9)",
    )  # fmt: skip
    add(
        "--window", type=int, default=1, metavar="N",
        help="number of samples to average (default: %(default)s)",
    )  # fmt: skip
    add(
        "--sensor-angle", default="0", metavar="A+-U",
        help="angle between the sensor and the force [deg] (default: %(default)s)",
    )  # fmt: skip
    add(
        "--force-gain", default="1", metavar="G+-U",
        help="factor on the force, with the uncertainty of its calibration (default: %(default)s)",
    )  # fmt: skip
    _record(parser)
    _out(parser)


def _calibration(kinds: Commands) -> None:
    parser = _command(
        kinds, "calibration", "measure:calibration",
        "sensitivity of a sensor, from its readings beside a reference",
        _examples("prbm measure calibration stage.csv --quantity position --reading laser"),
    )  # fmt: skip
    add = parser.add_argument
    add("file", metavar="FILE.csv", help="reference and readings, in two columns")
    add("--quantity", metavar="NAME", help="column of the reference (default: the only lengths)")
    add("--reading", metavar="NAME", help="column of the readings (default: the other column)")
    _record(parser)
    _out(parser)


def _frequency(kinds: Commands) -> None:
    parser = _command(
        kinds, "frequency", "measure:frequency", "frequency and damping of a free vibration",
        _examples("prbm measure frequency free.csv --column laser --from 0.5 --to 5.5"),
    )  # fmt: skip
    parser.add_argument("file", metavar="FILE.csv", help="signal over time")
    _signal(parser)
    _record(parser)
    _out(parser)


def _restitution(kinds: Commands) -> None:
    parser = _command(
        kinds, "restitution", "measure:restitution",
        "restitution of a stop, fitted to a bouncing response; for a 1R guide it is the modal "
        "restitution of the fundamental mode",
        _examples(
            'prbm measure restitution bounce.csv --set "release.displacement=-10 mm" \\\n'
            "      --free record.shift=-2:2ms --calibration stage.csv"
        ),
    )  # fmt: skip
    add = parser.add_argument
    add("file", metavar="FILE.csv", help="motion over time since the release")
    add(
        "--mechanism", default="PRBDM", metavar="MECHANISM",
        help=f"{MECHANISM} (default: %(default)s)",
    )  # fmt: skip
    add("--stop", metavar="NAME", help="stop that is hit (default: the first)")
    add(
        "--free", action="append", default=[], metavar="NAME[=LOW:HIGH]",
        help="further parameter to fit, e.g. stop.position=-1:1mm; repeatable",
    )  # fmt: skip
    set_argument(parser)
    _response(parser)
    _signal(parser)
    _record(parser)
    _out(parser)


# --- run --------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    try:
        status = _run([*(sys.argv[1:] if arguments is None else arguments)])
        sys.stdout.flush()
    except BrokenPipeError:  # The reader of the output, for instance head, has closed the pipe.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    return status


def _run(words: Sequence[str]) -> int:
    """Parse the words of a command line and run its command; return the exit status."""
    if not words:
        parser().print_help(sys.stderr)
        return MISTAKE
    name = "prbm"
    try:
        options = parser().parse_args(protected(words))
        name = options.prog
        _function(options.run)(options)
        return OK
    except SystemExit:  # argparse has printed the help or the version
        return OK
    except _ArgumentError as error:
        return _reported(str(error), MISTAKE)
    except KeyboardInterrupt as stop:
        return _reported(f"{name}: {str(stop) or 'interrupted'}", INTERRUPTED)
    except Exception as error:
        status = _status(error)
        if status is None:
            raise
        return _reported(f"{name}: {in_options(str(error))}", status)


def protected(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with a space before negative quantities.

    The space keeps argparse from reading them as options.

    Examples
    --------
    >>> protected(["modes", "PRBDM", "--held", "-1e-2"])
    ['modes', 'PRBDM', '--held', ' -1e-2']
    """
    return [f" {word}" if NEGATIVE.match(word) else word for word in words]


def _function(run: str) -> Callable[[argparse.Namespace], None]:
    """Import and return the function named by module:function."""
    module, _, function = run.partition(":")
    found: Callable[[argparse.Namespace], None] = getattr(
        importlib.import_module(f".{module}", __package__), function
    )
    return found


def _status(error: Exception) -> int | None:
    """Return the exit status after an error; None for an error in the program itself."""
    if isinstance(error, EquilibriumError | SimulationError):
        return FAILED
    return MISTAKE if isinstance(error, PrbmError) else None


def _reported(sentence: str, status: int) -> int:
    """Print a sentence on standard error; return the status."""
    if sys.stderr.isatty():
        print(CLEAR, end="", file=sys.stderr)
    print(sentence, file=sys.stderr)
    return status
