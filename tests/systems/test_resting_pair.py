"""A body at rest on a carrier, each in an FMU of its own: force one way, motion the other."""

import numpy as np
import pytest

from prbm.systems.cosimulation import simulate
from support import simulation

PAIR = {
    "body.stop.displacement": "carrier.shuttle.x",
    "body.stop.velocity": "carrier.shuttle.vx",
    "carrier.force.x": "body.stop.force",
}
STIFFER = 4.0
"""Stiffness of the carrier's flexures over that of the body's flexures."""


@pytest.mark.parametrize("step", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("share", [0.1, 0.2])
def test_a_body_stays_on_a_vibrating_carrier_whose_amplitude_grows_slowly(native, share, step):
    """The delay of the force feeds the vibration at the rate of about omega^2 h m/(2 M).

    Both are guides with the stiffness k of the body's flexures: omega^2 = (STIFFER + 1) k/(M + m).
    Without a coupling error the body never leaves: the least contact force is g m (1 + m/M) less
    the force of its own flexures, 2 g m/(STIFFER + 1).
    """
    guide = simulation("PRBDM")
    mass, span = guide.values["shuttle.mass"], 0.5 if step < 1e-3 else 1.0
    start = {
        "carrier.stop.position": 1.0,
        "carrier.gravity.x": 0.0,
        "carrier.release.displacement": 0.0,
        "carrier.flexure.width": STIFFER * guide.values["flexure.width"],
        "carrier.shuttle.mass": mass / share,
        "body.release.displacement": 0.0,
    }
    fmus = {name: native["PRBDM", 3] for name in ("carrier", "body")}
    record = ["body.stop.contact", "body.stop.impact_count", "carrier.shuttle.x"]
    found = simulate(fmus, PAIR, span, step, start, record, scheme="jacobi")
    assert found["body.stop.contact"].all()
    assert not found["body.stop.impact_count"].any()
    period = np.sqrt((1 + 1 / share) / (STIFFER + 1)) / guide.frequency
    rows, x = round(1.1 * period / step), found["carrier.shuttle.x"]
    growth = np.log(np.ptp(x[-rows:]) / np.ptp(x[:rows])) / (span - 1.1 * period)
    feeding = (2 * np.pi / period) ** 2 * step * share
    assert -0.01 < growth < 0.8 * feeding + 0.01
