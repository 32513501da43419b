"""Linear models from the command line."""

import numpy as np
import pytest

import prbm
from prbm.commands import command_line as cli


def run(options, *more):
    return cli.main(["linearize", "PRBDM2R", *options.split(), *more])


def test_the_files_have_the_model_and_its_responses(tmp_path, capsys):
    options = "--inputs force.x base.acceleration.y --outputs shuttle.x base.force.x"
    options += " --frequencies 1:100Hz --load force.x=0.1N"
    assert run(options, "--out", str(tmp_path)) == cli.OK
    assert "shuttle.x by force.x" in capsys.readouterr().out
    model = prbm.linearize(
        prbm.load("PRBDM2R"), inputs=["force.x", "base.acceleration.y"],
        outputs=["shuttle.x", "base.force.x"], loads={"force.x": 0.1},
    )  # fmt: skip
    with np.load(tmp_path / "PRBDM2R-linear.npz") as written:
        assert all(np.array_equal(written[name], getattr(model, name)) for name in "ABCD")
    assert (tmp_path / "PRBDM2R-linear.mat").read_bytes()[:6] == b"MATLAB"
    table = np.genfromtxt(
        tmp_path / "PRBDM2R-response.csv", delimiter=",", names=True, deletechars=""
    )
    frequencies = table["frequency_[Hz]"]
    assert (frequencies[0], frequencies[-1]) == pytest.approx((1.0, 100.0))
    G = model.response(frequencies)[:, 1, 0]
    head = "base.force.x_by_force.x"
    amplitude, phase = table[f"amplitude_of_{head}_[N/(N)]"], table[f"phase_of_{head}_[deg]"]
    assert amplitude * np.exp(1j * np.radians(phase)) == pytest.approx(G)
    assert (tmp_path / "PRBDM2R-response.png").stat().st_size > 10_000


@pytest.mark.parametrize("outputs", ["shuttle.x shuttle.y shuttle.angle", "shuttle.angle"])
def test_round_off_of_a_symmetric_guide_is_printed_as_0(outputs, capsys):
    """The straight guide moves along x only; the scale does not depend on the chosen outputs."""
    line = f"linearize PRBDM --set gravity.x=0 --inputs force.x force.y --outputs {outputs}"
    assert cli.main(line.split()) == cli.OK
    printed = capsys.readouterr().out
    rows = {row[: row.index("force.") + 7]: row.split()[3:] for row in printed.splitlines()
            if " by force." in row}  # fmt: skip
    moving = {name for name, cells in rows.items() if cells != ["0", "0", "-", "-"]}
    assert {name.split()[0] for name in moving} <= {"shuttle.x"}
    assert ("shuttle.x by force.x" in " ".join(moving)) == ("shuttle.x" in outputs)
    assert "0: less than 1e-09 of the largest response of its kind" in printed
    assert "nan" not in printed
    assert "e-1" not in printed.replace("1e-09", "")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--frequencies 10Hz", "give both ends of the range"),
        ("--frequencies 10:1Hz", "the first must be positive and below the last"),
        ("--inputs force.z", "did you mean"),
        ("--resting wall", "has no stop wall"),
        ("--load force.q=1N", "the loads are force.x"),
    ],
)
def test_mistakes_are_named(options, message, capsys):
    assert run(options) == 2
    assert message in capsys.readouterr().err
