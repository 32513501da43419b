"""The command ``prbm``: its arguments, and the function that runs each command.

Text goes to standard output, progress and errors to standard error.  Tables and figures go into the
folder given by ``--out``, all at once after the computation.  The exit status is 0, 1 if a
computation fails, 2 for a mistake of the user, 130 after Ctrl-C.
"""

import argparse
import importlib
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..base.errors import EquilibriumError, PrbmError, SimulationError
from ..base.progress import CLEAR
from ..base.version import __version__
from ..fmu.date import date
from ..mechanism.flexure import MODELS
from .arguments import (
    ANIMATION_USAGE,
    MECHANISM,
    ArgumentMistake,
    Commands,
    Parser,
    add_command,
    animation_arguments,
    engine_argument,
    examples,
    input_argument,
    linear_arguments,
    load_argument,
    mechanism_argument,
    out_argument,
    parameters_argument,
    picture_arguments,
    record_arguments,
    response_arguments,
    set_argument,
    shock_arguments,
    signal_arguments,
    stop_time_argument,
    stress_arguments,
    study_arguments,
    sweep_arguments,
)
from .build_arguments import build_commands
from .drawing_arguments import drawing_commands
from .measure_arguments import measure_arguments
from .program import (
    FAILED,
    INTERRUPTED,
    MISTAKE,
    OK,
    discard_output,
    flush_output,
    report_unwritable,
)
from .remedies import in_options

NEGATIVE = re.compile(r"-\.?\d")
KINDS = ("guide", "lever", "gripper", "bistable", "pivot")
METHODS = ("algebraic", "simulated", "fitted", "elements", "closed-form", "compliant")


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    p = Parser(
        prog="prbm",
        description="Analyse a compliant mechanism with stops: natural frequencies, "
        "rest positions,\nmotion through impacts, and parameters from measured data.",
        epilog=examples(
            "prbm list",
            "prbm modes PRBDM2R",
            "prbm simulate PRBDM2R --set stop.restitution=0.5 --out results",
            "prbm simulate my_mechanism.toml",
        )
        + "\n\nResults are printed; --out DIR also writes tables (CSV) and figures (PNG) into a "
        "folder.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    p.add_argument(
        "--version", action="version", version=f"prbm-impact {__version__}",
        help="print the version and exit",
    )  # fmt: skip
    commands = p.add_subparsers(title="commands", metavar="COMMAND", parser_class=Parser)
    _list(commands)
    _new(commands)
    _parameters(commands)
    _modes(commands)
    _equilibrium(commands)
    _linearize(commands)
    _simulate(commands)
    _stress(commands)
    _shock(commands)
    _fit(commands)
    _impact_map(commands)
    _contact(commands)
    _sweep(commands)
    _study(commands)
    measure_arguments(commands)
    drawing_commands(commands)
    _picture(commands)
    _animate(commands)
    _explore(commands)
    build_commands(commands)
    _validate(commands)
    _completion(commands)
    return p


# --- commands ---------------------------------------------------------------------------------


def _list(commands: Commands) -> None:
    add_command(
        commands,
        "list",
        "shipped:print_list",
        "list the shipped mechanisms",
        examples("prbm list"),
        details="Beams are the most accurate model of flexures (GuideBeam). PRBDM, PRBDM2R and "
        "PRBDM3R are the same guide by models with 1, 2 and 3 pivots, for comparison.",
    )


def _new(commands: Commands) -> None:
    parser = add_command(
        commands, "new", "new:write_template",
        "write a commented mechanism file to start from",
        examples(
            "prbm new MyGuide", "prbm new MyPivot --kind pivot", "prbm new MyGuide --from GuideBeam"
        ),
    )  # fmt: skip
    parser.add_argument(
        "name", metavar="NAME", help="name of the mechanism; the file is NAME.toml, a new one"
    )
    start = parser.add_mutually_exclusive_group()
    start.add_argument(
        "--kind", default=KINDS[0], choices=KINDS, help="kind of mechanism (default: %(default)s)"
    )
    start.add_argument(
        "--from", dest="shipped", metavar="SHIPPED", help="copy a shipped mechanism (see prbm list)"
    )


def _parameters(commands: Commands) -> None:
    parser = add_command(
        commands, "parameters", "parameters:print_parameters",
        "parameters of a mechanism, also as a parameter set (SSV) for other tools",
        examples(
            "prbm parameters PRBDM",
            "prbm parameters PRBDM --set flexure.length=50mm --out long.ssv",
        ),
    )  # fmt: skip
    mechanism_argument(parser)
    set_argument(parser, "value of a parameter or input")
    parameters_argument(parser)
    parser.add_argument(
        "--out", type=Path, metavar="FILE.ssv", help="file to write (default: none is written)"
    )


def _modes(commands: Commands) -> None:
    parser = add_command(
        commands, "modes", "modes:frequencies",
        "natural frequencies and modes, about the equilibrium under gravity and loads, or held",
        examples(
            "prbm modes PRBDM2R",
            "prbm modes PRBDM2R --held -10mm --out modes",
            "prbm modes CurvedBistable --load force.y=-5N",
        ),
    )  # fmt: skip
    mechanism_argument(parser)
    parser.add_argument(
        "--count", type=int, default=6, metavar="N", help="number of modes (default: %(default)s)"
    )
    parser.add_argument(
        "--held", metavar="X",
        help="displacement [m] at which the released body is held, or angle [rad] if it is "
        "released by an angle (default: not held)",
    )  # fmt: skip
    load_argument(parser)
    set_argument(parser)
    out_argument(parser)


def _contact(commands: Commands) -> None:
    parser = add_command(
        commands, "contact", "contact:contact",
        "stiffness of a compliant stop from radii and materials; force and duration of a hit",
        examples(
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
        ("--stiffness", "contact stiffness [N/m^exponent], instead of a radius or a thickness"),
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
    parser = add_command(
        commands, "equilibrium", "rest:rest_positions",
        "rest positions under gravity, the force that holds the released body at other "
        "displacements, and snap-through",
        examples(
            "prbm equilibrium PRBDM2R",
            "prbm equilibrium PRBDM2R --held -10 -5 5 10 mm",
            "prbm equilibrium Bistable --from -2mm --to 26mm --out curve",
            "prbm equilibrium CurvedBistable --load force.y=-5N --stiffness shuttle",
            "prbm equilibrium CurvedBistable --vary force.y=0:-40N --out path",
        ),
    )  # fmt: skip
    mechanism_argument(parser)
    add = parser.add_argument
    text = "displacements [m] or angles [rad] at which the body is held"
    add("--held", action="extend", nargs="+", metavar="X", help=text)
    load_argument(parser)
    text = "follow the shapes while a load varies, such as force.y=0:-20N, through limit points"
    add("--vary", metavar="NAME=A:B", help=text)
    add(
        "--branches", type=int, nargs="?", const=1, default=0, metavar="DEPTH",
        help="follow the branches at bifurcations, too; 2: also their branches",
    )  # fmt: skip
    add("--stiffness", metavar="BODY", help="print the compliance and stiffness matrix of a body")
    add("--at", metavar="BODY.POINT", help="point of --stiffness (default: the centre of mass)")
    add("--from", dest="start", metavar="A", help="first displacement of a force curve [m]")
    add("--to", dest="end", metavar="B", help="last displacement of the force curve [m]")
    add(
        "--points", type=int, default=41, metavar="N",
        help="number of points of the force curve (default: %(default)s)",
    )  # fmt: skip
    set_argument(parser)
    out_argument(parser)


def _linearize(commands: Commands) -> None:
    parser = add_command(
        commands, "linearize", "linear:linear_model",
        "linear model x' = A x + B u, y = C x + D u about a shape at rest, and frequency responses",
        examples(
            "prbm linearize GuideBeam",
            "prbm linearize GuideBeam --inputs force.x --outputs shuttle.x shuttle.vx --out model",
            "prbm linearize GuideBeam --inputs base.acceleration.x --frequencies 1:1000Hz",
        ),
    )  # fmt: skip
    mechanism_argument(parser)
    linear_arguments(parser)
    load_argument(parser)
    set_argument(parser)
    out_argument(parser)


def _simulate(commands: Commands) -> None:
    parser = add_command(
        commands, "simulate", "simulation:run_simulation",
        "simulate the motion after the release, through all impacts",
        examples(
            "prbm simulate PRBDM2R --set stop.restitution=0.5 --out results",
            "prbm simulate PRBDM2R --spectrum first --out results",
            'prbm simulate PRBDM2R --input "base.acceleration.x=half-sine(50 g, 2 ms)"',
        ),
    )  # fmt: skip
    mechanism_argument(parser)
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
    parameters_argument(parser)
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
    out_argument(parser)


def _stress(commands: Commands) -> None:
    parser = add_command(
        commands, "stress", "stress:print_stress",
        "largest stress, safety factor and fatigue of the flexures, in motion or held",
        examples("prbm stress PRBDM2R", "prbm stress PRBDM2R --held 5 10 mm"),
    )  # fmt: skip
    mechanism_argument(parser)
    stress_arguments(parser)
    out_argument(parser)


def _shock(commands: Commands) -> None:
    parser = add_command(
        commands, "shock", "shock:run_shock",
        "effect of a shock of the base: displacement, impacts, stress, level of failure",
        examples(
            'prbm shock NotchGuide --peak "20 g" --duration "2 ms" --set stop.position=1mm',
            'prbm shock my_mechanism.toml --duration "2 ms" --peaks 20 50 100 g',
        ),
        details="The mechanism starts at rest in its equilibrium.",
    )  # fmt: skip
    mechanism_argument(parser)
    shock_arguments(parser)
    out_argument(parser)


def _fit(commands: Commands) -> None:
    parser = add_command(
        commands, "fit", "fitting:run_fit",
        "fit parameters of a mechanism to natural frequencies, a response or a force curve",
        examples(
            'prbm fit PRBDM --free flexure.K_theta --frequency "4.82 Hz +- 0.06"',
            "prbm fit PRBDM2R --free flexure.youngs_modulus=100:250GPa \\\n"
            "      --force-deflection force.csv --out fit",
            "prbm fit PRBDM --free stop.restitution --free record.shift=-5:5ms \\\n"
            "      --response bounce.csv --column x",
        ),
    )  # fmt: skip
    mechanism_argument(parser)
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
    add(
        "--searches", type=int, metavar="N",
        help="number of searches from different starts (default: 4, or 1 for one parameter)",
    )  # fmt: skip
    response_arguments(parser)
    signal_arguments(parser)
    record_arguments(parser)
    out_argument(parser)


def _impact_map(commands: Commands) -> None:
    parser = add_command(
        commands, "impact-map", "maps:print_maps",
        "maps of the modal restitution over positions of the wall and offsets of the hit point",
        examples(
            "prbm impact-map PRBDM2R --model 2R --axial",
            "prbm impact-map PRBDM2R --method algebraic simulated \\\n"
            "      --wall-positions -10 0 10 mm --offsets -4 0 4 mm --out map",
        ),
        details="The modal restitution is the velocity of the fundamental mode after an impact, "
        "divided by that before, with the sign reversed.",
    )  # fmt: skip
    mechanism_argument(parser)
    add = parser.add_argument
    add(
        "--wall-positions", action="extend", nargs="+", metavar="X",
        help="positions of the wall [m] (default: five, up to 5/9 of the release on both sides)",
    )  # fmt: skip
    add(
        "--offsets", action="extend", nargs="+", metavar="D",
        help="offsets of the hit point [m] (default: five, up to 1/20 of the size on both sides)",
    )  # fmt: skip
    add(
        "--method", action="extend", nargs="+", default=[], metavar="METHOD", choices=METHODS,
        help="algebraic: the arriving motion is the fundamental mode alone; simulated: first "
        "impact after the release; fitted: restitution of a 1R model with the same motion (takes "
        "minutes); compliant: the fundamental mode arrives at a compliant stop; elements: finite "
        "elements; closed-form: formula for a single body that moves "
        "along a path without turning (default: algebraic)",
    )  # fmt: skip
    add(
        "--stiffness", action="extend", nargs="+", metavar="K",
        help="contact stiffnesses of the method compliant [N/m^exponent]; one map each (default: "
        "that of the stop)",
    )  # fmt: skip
    add("--speed", metavar="V", help="closing speed, for an exponent other than 1 [m/s]")
    former: dict[str, Any] = {"action": "extend", "nargs": "+", "help": argparse.SUPPRESS}
    add("--heights", dest="wall_positions", **former)
    add("--way", dest="method", choices=METHODS, **former)
    add(
        "--model", action="extend", nargs="+", default=[], metavar="M", choices=tuple(MODELS),
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
    out_argument(parser)


def _sweep(commands: Commands) -> None:
    parser = add_command(
        commands, "sweep", "study:run_sweep",
        "simulate an FMU once for each row of a table: parameter studies, Monte Carlo",
        examples(
            "prbm sweep dist/fmi2/PRBDM2R.fmu table.csv --output stop.impact_count \\\n"
            '      --output "max(shuttle.x)" --stop-time 500ms --out settling.parquet'
        ),
    )  # fmt: skip
    sweep_arguments(parser)


def _study(commands: Commands) -> None:
    parser = add_command(
        commands, "study", "study:run_study",
        "simulate over parameters: optimum under constraints, yield, sensitivities",
        examples(
            'prbm study PRBDM2R --vary "stop.position=-4:2 mm:25" --stop-time 0.5 \\\n'
            '      --of settling "max(abs(shuttle.vx))" --minimise settling --out results',
            'prbm study PRBDM2R --vary "stop.position=0 mm +- 0.3 mm" --runs 256 \\\n'
            '      --of settling --subject-to "settling < 0.3 s" --stop-time 1',
        ),
    )  # fmt: skip
    parser.add_argument("mechanism", metavar="MECHANISM", help=f"{MECHANISM}, or FMU FILE.fmu")
    study_arguments(parser)
    set_argument(parser, "value of a parameter or input in all simulations")
    input_argument(parser)
    stop_time_argument(parser)
    engine_argument(parser)
    out_argument(parser)


def _picture(commands: Commands) -> None:
    parser = add_command(
        commands, "picture", "pictures:write_picture",
        "draw a mechanism with the names of its parts, and its modes, as PNG",
        examples("prbm picture FoldedSuspension --modes 3 --out folded.png"),
    )  # fmt: skip
    picture_arguments(parser)


def _animate(commands: Commands) -> None:
    parser = add_command(
        commands, "animate", "pictures:run_animation",
        "film of a result, or of a new simulation, as GIF or MP4",
        examples(
            "prbm animate PRBDM2R motion.gif --stop-time 0.3",
            "prbm animate results/PRBDM2R.csv motion.mp4",
        ),
        usage=f"%(prog)s {ANIMATION_USAGE}",
    )  # fmt: skip
    animation_arguments(parser)


def _explore(commands: Commands) -> None:
    parser = add_command(
        commands, "explore", "explore:write_page",
        "write a page that simulates a mechanism in the browser, and open it",
        examples("prbm explore PRBDM2R", "prbm explore my_mechanism.toml --out page.html"),
        details="The page is one file and needs no network.",
    )  # fmt: skip
    mechanism_argument(parser)
    parser.add_argument(
        "--out", type=Path, metavar="FILE.html", help="file to write (default: MECHANISM.html)"
    )
    parser.add_argument(
        "--no-open", action="store_false", dest="open", help="do not open the page in the browser"
    )
    set_argument(parser, "value of a parameter or input")
    parameters_argument(parser)


def _validate(commands: Commands) -> None:
    parser = add_command(
        commands, "validate", "validation:print_validation",
        "compare a mechanism with finite elements and measurements, or reproduce the thesis "
        "behind the models",
        examples(
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
        "--only", action="extend", nargs="+", default=[], metavar="NAME",
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
    out_argument(parser)


def _completion(commands: Commands) -> None:
    parser = add_command(
        commands, "completion", "completion:print_completion",
        "print a script for tab completion of commands, options and mechanisms",
        examples("prbm completion bash", "prbm completion fish"),
        details='In bash and zsh, eval "$(prbm completion bash)" in ~/.bashrc switches it on, with '
        "zsh in ~/.zshrc; in fish, prbm completion fish | source in config.fish.",
    )  # fmt: skip
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell")


# --- run --------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    try:
        status = _run([*(sys.argv[1:] if arguments is None else arguments)])
        flush_output()
    except BrokenPipeError:  # The reader of the output, for instance head, has closed the pipe.
        return discard_output()
    except OSError as error:  # Readers name the files that they cannot read.
        return report_unwritable("prbm", error)
    return status


def _run(words: Sequence[str]) -> int:
    """Parse the words of a command line and run its command; return the exit status."""
    if not words:
        parser().print_help(sys.stderr)
        return MISTAKE
    name = "prbm"
    try:
        date()  # SciPy cannot be imported with an invalid date: numpy.f2py reads it, too.
        options = parser().parse_args(protected(words))
        name = options.prog
        return _function(options.run)(options) or OK
    except SystemExit:  # argparse has printed the help or the version
        return OK
    except ArgumentMistake as error:
        return _reported(str(error), MISTAKE)
    except KeyboardInterrupt as stop:
        return _reported(f"{name}: {str(stop) or 'interrupted'}", INTERRUPTED)
    except MemoryError:
        sentence = "there is not enough memory; choose fewer rows or samples, or a shorter time"
        return _reported(f"{name}: {sentence}", FAILED)
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


def _function(run: str) -> Callable[[argparse.Namespace], int | None]:
    """Import and return the function named by module:function, which may return an exit status."""
    module, _, function = run.partition(":")
    found: Callable[[argparse.Namespace], int | None] = getattr(
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
