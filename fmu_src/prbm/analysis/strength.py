r"""Safety factors and fatigue of flexures, from the stress in a result.

Cycles of the signed stress at both ends, and in the section of the largest stress, are counted by
the rainflow method [1].  Goodman's line converts the amplitude of a cycle with a tensile mean to
that of a fully reversed one,

    reversed = amplitude / (1 - mean / tensile_strength),

and Basquin's law gives the number of such cycles to failure.  It passes 0.9 of the tensile
strength at 1,000 cycles and the fatigue strength at its number of cycles [2], and continues on both
sides: there is no endurance limit.  By Miner's rule, the damage is the sum of all cycles over their
numbers to failure.  This is an estimate: surface, size, notches and scatter are not known.

Sources
-------
.. [1] ASTM E1049-85, Standard Practices for Cycle Counting in Fatigue Analysis.
.. [2] R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, chapter 6.
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from ..mechanics.arrays import Real
from ..mechanics.stress import stressed
from ..mechanism.description import Mechanism
from ..mechanism.parts import KNEE_SHARE, FlexureType
from ..runs.result import Columns, column
from .stress_field import StressField

KNEE_CYCLES = 1e3
LOG_MAX = math.log(sys.float_info.max)


@dataclass(frozen=True)
class Cycle:
    """A cycle of the stress.

    Parameters
    ----------
    amplitude, mean : float
        Half of its range, and its mean [Pa].
    count : float
        1, or 0.5 for a half cycle.
    """

    amplitude: float
    mean: float
    count: float


@dataclass(frozen=True)
class Loading:
    """Largest stress and fatigue of a flexure in a run.

    Parameters
    ----------
    flexure : str
        Name of the flexure.
    peak, time, position : float
        Largest magnitude of the stress [Pa], its time [s] and its position along the flexure [m].
    safety : float or None
        Yield strength over the peak; None without a yield strength.
    damage : float or None
        Damage of the run in the worst section and face; None without a fatigue strength.
    """

    flexure: str
    peak: float
    time: float
    position: float
    safety: float | None
    damage: float | None


def counts_cycles() -> bool:
    """Return whether the package that counts cycles is installed (extra ``fatigue``)."""
    return find_spec("rainflow") is not None


def cycles(series: Sequence[float] | Real) -> list[Cycle]:
    """Return the cycles of a history of the stress [Pa], by the rainflow method.

    The package rainflow is in the extra ``fatigue``.

    Examples
    --------
    A fully reversed history:

    >>> cycles([3.0, -3.0, 3.0, -3.0])[0]
    Cycle(amplitude=3.0, mean=0.0, count=0.5)
    """
    import rainflow  # type: ignore[import-untyped]  # imported here: an extra

    found = rainflow.extract_cycles([float(x) for x in series])
    return [Cycle(size / 2, mean, count) for size, mean, count, _, _ in found]


def reversed_amplitude(amplitude: float, mean: float, tensile: float) -> float:
    """Return the amplitude of a fully reversed cycle with the same damage (Goodman) [Pa].

    A compressive mean has no effect.  The result is infinite if the mean reaches the tensile
    strength.

    Examples
    --------
    >>> reversed_amplitude(100.0, 250.0, 500.0), reversed_amplitude(100.0, -50.0, 500.0)
    (200.0, 100.0)
    """
    if mean <= 0.0:
        return amplitude
    return amplitude / (1.0 - mean / tensile) if mean < tensile else math.inf


def cycles_to_failure(
    amplitude: float, tensile: float, fatigue: float, fatigue_cycles: float,
    knee: float = KNEE_SHARE,
) -> float:  # fmt: skip
    """Return the number of fully reversed cycles to failure (Basquin).

    Parameters
    ----------
    amplitude : float
        Amplitude of the stress [Pa].
    tensile, fatigue, fatigue_cycles : float
        Tensile strength [Pa], fatigue strength [Pa] and its number of cycles [-].
    knee : float
        Share of the tensile strength that is survived for 1,000 cycles.
    """
    if amplitude <= 0.0:
        return math.inf
    if not math.isfinite(amplitude):
        return 0.0
    exponent = math.log(fatigue / (knee * tensile)) / math.log(fatigue_cycles / KNEE_CYCLES)
    size = math.log(KNEE_CYCLES) + math.log(amplitude / (knee * tensile)) / exponent
    return math.exp(size) if size < LOG_MAX else math.inf


def damage(series: Sequence[float] | Real, kind: FlexureType) -> float | None:
    """Return the damage of a history of the stress [Pa]: 1 is failure.

    None without a fatigue strength.
    """
    tensile, fatigue, lives = kind.tensile_strength, kind.fatigue_strength, kind.fatigue_cycles
    if tensile is None or fatigue is None or lives is None:
        return None
    total = 0.0
    for cycle in cycles(series):
        amplitude = reversed_amplitude(cycle.amplitude, cycle.mean, tensile)
        life = cycles_to_failure(amplitude, tensile, fatigue, lives)
        total += cycle.count / life if life > 0.0 else math.inf
    return total


def loadings(
    columns: Columns,
    mechanism: Mechanism,
    *,
    fatigue: bool = True,
    stress: StressField | None = None,
) -> list[Loading]:
    """Return the largest stress and the fatigue of all flexures whose stress is an output.

    Parameters
    ----------
    columns : structured array
        Result of :func:`prbm.runs.run.simulate`, with all outputs.
    mechanism : Mechanism
        The mechanism that was simulated.
    fatigue : bool
        Whether to count cycles.
    stress : StressField or None
        The stress in all sections.  With it, the cycles are also those of the section with the
        largest stress, for example of the waist of a notch; None: those of the ends only.
    """
    result = []
    for i in stressed(mechanism):
        flexure = mechanism.flexures[i]
        name, kind = flexure.name, mechanism.type_of(flexure)
        peak, time, position = (
            float(column(columns, f"{name}.{output}")[-1])
            for output in ("peak_stress", "peak_stress_time", "peak_stress_position")
        )
        safety = kind.yield_strength / peak if kind.yield_strength and peak > 0.0 else None
        worst = None
        if fatigue and kind.fatigue_strength is not None:
            worst = max(damage(face, kind) or 0.0 for face in _histories(columns, name, stress))
        result.append(Loading(name, peak, time, position, safety, worst))
    return result


def _histories(columns: Columns, flexure: str, stress: StressField | None) -> list[Real]:
    """Return the stress of both faces over time, at the ends and where it is largest [Pa]."""
    if stress is None:
        ends = [np.asarray(column(columns, f"{flexure}.stress_{e}")) for e in ("start", "end")]
        return [face for one in ends for face in (one, -one)]
    faces = stress.faces[flexure]
    largest = int(np.abs(faces).max(axis=(0, 1)).argmax())
    places = sorted({0, largest, faces.shape[2] - 1})
    return [faces[:, face, place] for place in places for face in (0, 1)]
