"""The mechanisms of the example: wheel, oscillator, and both as one mechanism."""

from dataclasses import replace
from pathlib import Path

from prbm import Mechanism, load

FOLDER = Path(__file__).parent
wheel, oscillator = (load(FOLDER / name) for name in ("Wheel.toml", "Oscillator.toml"))


def both() -> Mechanism:
    """Return wheel and oscillator as one mechanism: the wall of the tooth is on the shuttle."""
    [tooth] = wheel.stops
    return replace(
        oscillator,
        name="Escapement",
        ground={**wheel.ground, **oscillator.ground},
        bodies=wheel.bodies + oscillator.bodies,
        flexure_types=wheel.flexure_types + oscillator.flexure_types,
        flexures=wheel.flexures + oscillator.flexures,
        stops=(replace(tooth, on="shuttle"),),
        forces=wheel.forces,
        geometry=wheel.geometry + oscillator.geometry,
    )
