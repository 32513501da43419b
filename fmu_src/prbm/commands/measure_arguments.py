"""The command ``prbm measure``: its quantities and their arguments."""

from .arguments import (
    MECHANISM,
    Commands,
    Parser,
    add_command,
    examples,
    out_argument,
    record_arguments,
    response_arguments,
    set_argument,
    signal_arguments,
)


def measure_arguments(commands: Commands) -> None:
    """Add the command, with one subcommand for each quantity."""
    parser = add_command(
        commands, "measure", "", "one quantity from measured data, with its uncertainty",
        examples("prbm measure frequency free.csv"),
    )  # fmt: skip
    kinds = parser.add_subparsers(
        title="quantities", metavar="QUANTITY", parser_class=Parser, required=True
    )
    _modulus(kinds)
    _calibration(kinds)
    _frequency(kinds)
    _restitution(kinds)


def _modulus(kinds: Commands) -> None:
    parser = add_command(
        kinds, "youngs-modulus", "measure:modulus",
        "Young's modulus from cantilever beams bent by a force, one file per beam",
        examples(
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
    record_arguments(parser)
    out_argument(parser)


def _calibration(kinds: Commands) -> None:
    parser = add_command(
        kinds, "calibration", "measure:calibration",
        "sensitivity of a sensor, from its readings beside a reference",
        examples("prbm measure calibration stage.csv --quantity position --reading laser"),
    )  # fmt: skip
    add = parser.add_argument
    add("file", metavar="FILE.csv", help="reference and readings, in two columns")
    add("--quantity", metavar="NAME", help="column of the reference (default: the only lengths)")
    add("--reading", metavar="NAME", help="column of the readings (default: the other column)")
    record_arguments(parser)
    out_argument(parser)


def _frequency(kinds: Commands) -> None:
    parser = add_command(
        kinds, "frequency", "measure:frequency", "frequency and damping of a free vibration",
        examples("prbm measure frequency free.csv --column laser --from 0.5 --to 5.5"),
    )  # fmt: skip
    parser.add_argument("file", metavar="FILE.csv", help="signal over time")
    signal_arguments(parser)
    record_arguments(parser)
    out_argument(parser)


def _restitution(kinds: Commands) -> None:
    parser = add_command(
        kinds, "restitution", "measure:restitution",
        "restitution of a stop, fitted to a bouncing response; for a 1R guide it is the modal "
        "restitution of the fundamental mode",
        examples(
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
    response_arguments(parser)
    signal_arguments(parser)
    record_arguments(parser)
    out_argument(parser)
