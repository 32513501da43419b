"""The stress in all sections of flexures over time."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..mechanics.arrays import Real
from ..mechanics.stress import section_positions
from ..runs.engine import Engine


@dataclass(frozen=True)
class StressField:
    """The stress of flexures over time.

    Parameters
    ----------
    time : (k,)
        Times [s].
    position : mapping of str to (m,)
        Positions of the sections of each flexure from its start [m].
    faces : mapping of str to (k, 2, m)
        Stress of the left and of the right face, positive in tension [Pa].
    """

    time: Real
    position: Mapping[str, Real]
    faces: Mapping[str, Real]

    @property
    def largest(self) -> float:
        """Largest magnitude [Pa]."""
        return max((float(np.abs(one).max()) for one in self.faces.values()), default=0.0)

    def at(self, t: float) -> dict[str, Real]:
        """Return the stress of both faces in the sections of each flexure, (2, m) [Pa].

        The stress is interpolated linearly between two times.
        """
        k = int(np.clip(np.searchsorted(self.time, t) - 1, 0, len(self.time) - 2))
        before, after = self.time[k : k + 2]
        share = min(max((t - before) / (after - before), 0.0), 1.0)
        return {
            name: (1.0 - share) * one[k] + share * one[k + 1] for name, one in self.faces.items()
        }


@dataclass
class StressRecorder:
    """Records the stress of a simulation, as its observer.

    Examples
    --------
    >>> import prbm
    >>> from prbm.analysis.strength import with_stress
    >>> from prbm.runs.run import simulate
    >>> recorder = StressRecorder()
    >>> guide = with_stress(prbm.load("GuideBeam"))
    >>> result = simulate(guide, stop_time=0.01, observer=recorder)
    >>> found = recorder.field.faces["left_flexure"][:, 0, 0]
    >>> bool(np.all(found == result["left_flexure.stress_start"]))
    True
    """

    _time: list[float] = field(default_factory=list)
    _rows: list[dict[str, Real]] = field(default_factory=list)
    _position: Mapping[str, Real] = field(default_factory=dict)

    def __call__(self, simulation: Engine) -> None:
        """Record the stress at the present time."""
        if not self._rows:
            self._position = section_positions(simulation.system)
        self._time.append(simulation.time)
        found = simulation.section_stresses()
        self._rows.append({name: np.stack(faces) for name, faces in found.items()})

    @property
    def field(self) -> StressField:
        """The stress so far, of at least two times."""
        faces = {name: np.stack([row[name] for row in self._rows]) for name in self._position}
        return StressField(np.array(self._time), self._position, faces)
