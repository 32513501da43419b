"""Arguments of ``prbm import`` and ``prbm export``."""

from argparse import ArgumentParser
from pathlib import Path

from .arguments import Commands, add_command, examples, mechanism_argument, set_argument


def drawing_commands(commands: Commands) -> None:
    """Add the commands that read and write drawings."""
    _import(commands)
    _export(commands)


def _import(commands: Commands) -> None:
    parser = add_command(
        commands, "import", "drawings:import_file",
        "mechanism file from the outline of a plate in a drawing (DXF or SVG)",
        examples(
            "prbm import stage.dxf --thickness 8mm --material steel --ground 5,5 --out stage.toml",
            "prbm import stage.dxf --thickness 8mm --check stage.png",
        ),
        details="Check the picture of --check: what was not understood is red.",
    )  # fmt: skip
    import_arguments(parser)


def _export(commands: Commands) -> None:
    parser = add_command(
        commands, "export", "drawings:export_file",
        "outline of a mechanism as a drawing (DXF), for CAD or a laser cutter",
        examples("prbm export NotchGuide", "prbm export my_mechanism.toml --out plate.dxf"),
        details="Slots beside the flexures let them end where they are clamped. prbm import reads "
        "the drawing again.",
    )  # fmt: skip
    mechanism_argument(parser)
    parser.add_argument(
        "--out", type=Path, metavar="FILE.dxf", help="file to write (default: MECHANISM.dxf)"
    )
    _overwrite(parser)
    set_argument(parser)


def _overwrite(parser: ArgumentParser) -> None:
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")


def import_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``prbm import``."""
    add = parser.add_argument
    add("drawing", type=Path, metavar="FILE", help="drawing, .dxf or .svg")
    add("--thickness", required=True, metavar="H", help="thickness of the plate [m]")
    add(
        "--material", default="steel", metavar="NAME",
        help="material of the plate (default: %(default)s)",
    )  # fmt: skip
    add("--youngs-modulus", metavar="E", help="Young's modulus, with a unit (default: typical)")
    add("--density", metavar="RHO", help="density, with a unit (default: typical)")
    add(
        "--ground", action="append", default=[], metavar="X,Y",
        help="point of a fixed body in units of the drawing, or with units; repeatable (default: "
        "marks on the layer ground, or the largest body)",
    )  # fmt: skip
    add(
        "--unit", metavar="U",
        help="unit of the drawing, for example mm or in (default: that of the file)",
    )  # fmt: skip
    add(
        "--gap", metavar="D",
        help="largest gap of the outline that is closed [m] (default: 1e-4 of the diagonal)",
    )  # fmt: skip
    add(
        "--tolerance", metavar="D",
        help="accuracy of coordinates, within which numbers are rounded [m] (default: 5e-6 of the "
        "diagonal)",
    )  # fmt: skip
    add(
        "--flexures-below", metavar="D",
        help="largest thickness of a flexure [m] (default: what is thin beside the bodies)",
    )  # fmt: skip
    add("--name", metavar="NAME", help="name of the mechanism (default: that of the drawing)")
    add(
        "--out", type=Path, metavar="FILE.toml",
        help="file to write (default: the drawing's name with .toml)",
    )  # fmt: skip
    _overwrite(parser)
    add(
        "--check", type=Path, metavar="FILE.png",
        help="picture of the drawing with the recognised parts (default: none)",
    )  # fmt: skip
