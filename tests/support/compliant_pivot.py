"""A wheel on a cross-spring pivot between two compliant stops, with outputs of the stress."""

from dataclasses import replace

from prbm.files.mechanism_file import read_mechanism
from prbm.mechanism.description import Mechanism
from support import SUPPORT


def two_compliant_stops() -> Mechanism:
    """Return the mechanism; the lower stop, with the exponent 1.5, is pressed at release."""
    own = read_mechanism(SUPPORT / "pivot.toml")
    stop = replace(own.stops[0], law="compliant")
    lower = {"direction": -90.0, "position": 1.5e-3, "stiffness": 1e6, "exponent": 1.5}
    return replace(
        own,
        name="TwoCompliant",
        stops=(
            replace(stop, name="upper", stiffness=1e5, exponent=1.0),
            replace(stop, name="lower", **lower),
        ),
        flexure_types=tuple(replace(kind, stress=True) for kind in own.flexure_types),
    )
