"""The closing speeds below which impacts end in rest, for stops whose descriptions have none."""

from dataclasses import replace

import numpy as np

from ..base.errors import PrbmError
from ..base.tolerances import REST_AMPLITUDE_RTOL, REST_SPEED_RTOL
from ..mechanics.arrays import Real
from ..mechanics.positions import start_velocity
from ..mechanics.start import start_shape
from ..mechanics.statics import resting
from ..mechanism.description import Mechanism
from ..mechanism.parts import value
from .configuration import Configuration


def with_rest_speeds(mechanism: Mechanism, stops: set[str]) -> Mechanism:
    """Return a mechanism whose stops of the given names have the rest speeds of :func:`of_stops`.

    A mechanism that cannot be released with its default values is returned unchanged.
    """
    if not stops:
        return mechanism
    try:
        speeds = of_stops(mechanism)
    except (PrbmError, np.linalg.LinAlgError):
        return mechanism
    found = zip(mechanism.stops, speeds, strict=True)
    given = tuple(replace(s, rest_speed=x) if s.name in stops else s for s, x in found)
    return replace(mechanism, stops=given)


def of_stops(mechanism: Mechanism) -> list[float]:
    """Return a rest speed for each stop, from the motion with the default values [m/s].

    It is the share ``REST_SPEED_RTOL`` of a typical closing speed, rounded to six digits, which
    round-off does not change.  The typical speed is omega a, with the fundamental angular frequency
    omega and the amplitude a of the hit point along the direction of the stop, or the speed of that
    point at the release, if that is larger.  The amplitude is the larger of the distances of the
    released shape and of the wall from the equilibrium under gravity; a wall farther away than the
    size of the mechanism does not count.  A stop that touches a mechanism at rest has the amplitude
    ``REST_AMPLITUDE_RTOL`` times the size.

    Raises
    ------
    PrbmError
        If the mechanism has no equilibrium, or cannot be released.
    """
    values = mechanism.values()
    configuration = Configuration.of(mechanism, values)
    system, scales = configuration.system, configuration.scales
    released = start_shape(system, values)
    v = start_velocity(system, released, values)

    def gaps(q: Real) -> Real:
        return system.gap_rows.values(system.directions(q))

    walls = np.array([value(stop, "position", values) for stop in mechanism.stops])
    rest = gaps(resting(system)[0].q)
    swing, reach = np.abs(gaps(released) - rest), np.abs(rest + walls)
    amplitude = np.maximum(swing, np.where(reach <= scales.length, reach, 0.0))
    rates = np.abs(system.gap_rows.rates(system.directions(released), v))
    typical = np.maximum(scales.rate * amplitude, rates)
    least = scales.rate * REST_AMPLITUDE_RTOL * scales.length
    typical = np.where(typical > scales.zero_speed, typical, least)
    return [float(f"{REST_SPEED_RTOL * speed:.5e}") for speed in typical]
