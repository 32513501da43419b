"""Arguments of ``prbm build``, which has the former name ``prbm-build-fmu``, too."""

import argparse
from pathlib import Path

from ..base.version import __version__
from ..kernel.compiler import ALL, HOST, PLATFORMS

SUMMARY = "build Functional Mock-up Units (FMUs) of mechanisms"
DETAILS = (
    "Without names, all shipped mechanisms are built.  The folder dist/ then has Python FMUs, and "
    "native FMUs of FMI 2.0 and 3.0 for this machine."
)


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
