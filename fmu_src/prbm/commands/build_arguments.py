"""Arguments of ``prbm build``, ``modelica`` and ``ssp``: the commands of FMUs."""

import argparse
from pathlib import Path

from ..base.version import __version__
from ..kernel.compiler import ALL, HOST, PLATFORMS
from .arguments import (
    Commands,
    add_command,
    examples,
    mechanism_argument,
    out_argument,
    parameters_argument,
    set_argument,
)

SUMMARY = "build Functional Mock-up Units (FMUs) of mechanisms"
DETAILS = (
    "Without names, all shipped mechanisms are built.  The folder dist/ then has Python FMUs, and "
    "native FMUs of FMI 2.0 and 3.0 for this machine."
)


def build_commands(commands: Commands) -> None:
    """Add the commands that build FMUs, wrap them and simulate packages of them."""
    _build(commands)
    _modelica(commands)
    _ssp(commands)


def _build(commands: Commands) -> None:
    parser = add_command(
        commands, "build", "building:run_build", SUMMARY,
        examples(
            "prbm build PRBDM2R",
            "prbm build my_mechanism.toml --flavour native --platform all",
        ),
        details=DETAILS,
    )  # fmt: skip
    build_arguments(parser)


def _modelica(commands: Commands) -> None:
    parser = add_command(
        commands, "modelica", "modelica:write_wrapper",
        "write a Modelica package around the FMU of a mechanism: signals, and forces as flanges",
        examples("prbm modelica PRBDM", "prbm modelica PRBDM --names underscore --out Guide.mo"),
        details="Import the FMU in the Modelica tool first: the package contains that block.",
    )  # fmt: skip
    mechanism_argument(parser)
    add = parser.add_argument
    add(
        "--names", default="structured", choices=("structured", "underscore"),
        help="names of variables in the imported block: force.x, or force_x as in OpenModelica "
        "(default: %(default)s)",
    )  # fmt: skip
    add(
        "--fmu", metavar="CLASS",
        help="name of the imported block (default: MECHANISM_fmu, with --names underscore "
        "MECHANISM_me_FMU)",
    )  # fmt: skip
    add("--out", type=Path, metavar="FILE.mo", help="file to write (default: MECHANISMWrapper.mo)")
    set_argument(parser, "start value of a parameter or input")
    parameters_argument(parser)


def _ssp(commands: Commands) -> None:
    parser = add_command(
        commands, "ssp", "packages:run_package",
        "simulate the coupled FMUs of a package (SSP 1.0)",
        examples("prbm ssp system.ssp", "prbm ssp system.ssp --stop-time 1s --out results"),
        details="The start values are those of the package. What the package contains and is not "
        "supported ends the command with a message.",
    )  # fmt: skip
    add = parser.add_argument
    add("package", type=Path, metavar="FILE.ssp", help="the package")
    add(
        "--stop-time", metavar="T",
        help="duration of the simulation [s] (default: that of the package)",
    )  # fmt: skip
    add(
        "--step", metavar="T",
        help="communication step [s] (default: a thousandth of the duration)",
    )  # fmt: skip
    out_argument(parser)


def build_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    add = parser.add_argument
    add(
        "mechanisms", nargs="*", metavar="MECHANISM",
        help="names of shipped mechanisms or mechanism files FILE.toml (default: all shipped ones)",
    )  # fmt: skip
    mechanism = parser.add_mutually_exclusive_group()
    mechanism.add_argument(
        "--model", action="append", metavar="NAME",
        help="the same as MECHANISM for a shipped mechanism; repeatable",
    )  # fmt: skip
    mechanism.add_argument(
        "--mechanism", type=Path, metavar="FILE.toml", help="the same as MECHANISM for a file"
    )
    add(
        "--flavour", choices=("python", "native"),
        help="python: readable source, needs Python with NumPy and SciPy where it runs; native: "
        "compiled, needs no other software (default: both)",
    )  # fmt: skip
    add("--fmi", choices=("2", "3"), help="version of FMI (default: both)")
    add(
        "--platform", action="append", metavar="NAME",
        help=f"platform of native FMUs: {HOST} (this machine), {ALL}, or some of "
        f"{', '.join(PLATFORMS)}; repeatable; platforms other than {HOST} need a package with "
        f"libraries or the Python package ziglang (default: {HOST})",
    )  # fmt: skip
    add(
        "--clock", action="store_true",
        help="build only the variant of FMI 3.0 whose stops have an output clock",
    )  # fmt: skip
    add(
        "--out", type=Path, default=Path("dist"), metavar="DIR",
        help="output folder (default: dist)",
    )  # fmt: skip
    add(
        "--set", action="append", default=[], dest="changes", metavar="NAME=VALUE",
        help='start value of a parameter or input, in SI or with a unit: "stop.position=1 mm"; '
        "repeatable",
    )  # fmt: skip
    add(
        "--parameters", type=Path, metavar="FILE.ssv",
        help="start values from a parameter set (SSV), as prbm parameters --out writes; --set has "
        "priority",
    )  # fmt: skip
    add(
        "--simulate", action="store_true",
        help="simulate each FMU with FMPy, print a summary and write a plot beside the FMU",
    )  # fmt: skip
    add(
        "--schema", action="store_true",
        help="print the JSON schema of mechanism files, for editors, and exit",
    )  # fmt: skip
    add("--list", action="store_true", help="list the shipped mechanisms and exit")
    add(
        "--version", action="version", version=f"prbm-impact {__version__}",
        help="print the version and exit",
    )  # fmt: skip
