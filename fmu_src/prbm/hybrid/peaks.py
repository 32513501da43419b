"""Largest stress of flexures so far.

Samples are taken where the stepper has accelerations: at the start, at the end of each step, and at
both sides of events.  A sample at the front counts once the time has reached it; before, the output
is the present stress where it exceeds the peak and rises to that sample, so that it depends neither
on the steps nor on earlier communication points.  A parabola through three samples refines a
maximum between them, if the motion is smooth there and the stress is largest at the same place.
"""

from dataclasses import dataclass, replace

from ..mechanics.dynamics import Evaluation
from ..mechanics.stress import Stress, stressed, stresses
from .front import Front


@dataclass(frozen=True)
class Sample:
    """The largest stress in a flexure at one time.

    Parameters
    ----------
    time : float
        Time [s].
    stress : float
        Largest magnitude of the stress [Pa].
    place : int
        Number of the section, negative for the right face.
    position : float
        Position of the section along the flexure [m].
    """

    time: float
    stress: float
    place: int
    position: float

    @classmethod
    def of(cls, time: float, found: Stress) -> "Sample":
        """Return the sample of a stress at a time [s]."""
        return cls(time, found.largest, found.place, found.position)


@dataclass(frozen=True)
class Peak:
    """The largest stress in a flexure so far.

    Parameters
    ----------
    stress, time, position : float
        Largest magnitude of the stress [Pa], its time [s] and position along the flexure [m].
    last : tuple of Sample
        The last two samples of the smooth motion up to now, or fewer.

    Examples
    --------
    A parabola through three samples:

    >>> peak = Peak()
    >>> for t in (0.0, 1.0, 3.0):
    ...     peak = peak.after(Sample(t, 5.0 - (t - 1.5) ** 2, 1, 0.02))
    >>> peak.stress, peak.time, peak.position
    (5.0, 1.5, 0.02)
    """

    stress: float = 0.0
    time: float = 0.0
    position: float = 0.0
    last: tuple[Sample, ...] = ()

    def after(self, sample: Sample) -> "Peak":
        """Return the peak after one more sample of a smooth motion."""
        known = (*self.last, sample)[-3:]
        found = max(sample.stress, self.stress)
        best = self if found > sample.stress or found == self.stress else sample
        result = Peak(best.stress, best.time, best.position, known[-2:])
        if len(known) < 3:
            return result
        time, value = vertex(known)
        if value > result.stress:
            return replace(result, stress=value, time=time, position=sample.position)
        return result

    def rising(self, now: Sample, end: Sample) -> "Peak":
        """Return the peak within a step, given the present sample and that at the step's end."""
        if not self.stress < now.stress <= end.stress:
            return self
        return replace(self, stress=now.stress, time=now.time, position=now.position)

    def restarted(self) -> "Peak":
        """Return the peak at an event: no parabola passes it."""
        return replace(self, last=())


def vertex(samples: tuple[Sample, ...]) -> tuple[float, float]:
    """Return time [s] and value [Pa] of the maximum of a parabola through three samples.

    The value is 0 if the middle sample is not the largest, or the places differ.
    """
    first, middle, last = samples
    turns = middle.stress >= first.stress and middle.stress >= last.stress
    if not turns or not first.place == middle.place == last.place:
        return 0.0, 0.0
    rise = (middle.stress - first.stress) / (middle.time - first.time)
    fall = (last.stress - middle.stress) / (last.time - middle.time)
    bend = (fall - rise) / (last.time - first.time)
    if not bend < 0.0:
        return 0.0, 0.0
    since = 0.5 * (middle.time - first.time) - 0.5 * rise / bend
    value = first.stress + since * (rise + bend * (since - (middle.time - first.time)))
    return first.time + since, value


@dataclass(frozen=True)
class PeakRecord:
    """The peaks of all flexures whose stress is an output.

    Parameters
    ----------
    peaks : tuple of Peak
        Peaks up to the last step.
    ahead : tuple of Sample
        Samples at the front; they count once the time reaches it.  Empty if they are in the peaks.
    """

    peaks: tuple[Peak, ...]
    ahead: tuple[Sample, ...] = ()

    @classmethod
    def at(cls, front: Front) -> "PeakRecord":
        """Return the record at the start."""
        empty = cls(tuple(Peak() for _ in stressed(front.equations.system.mechanism)))
        return empty.continued(front, reached=True)

    def passed(self) -> "PeakRecord":
        """Return the record once the time has reached the front."""
        if not self.ahead:
            return self
        pairs = zip(self.peaks, self.ahead, strict=True)
        return PeakRecord(tuple(peak.after(sample) for peak, sample in pairs))

    def between(self, now: tuple[Sample, ...]) -> "PeakRecord":
        """Return the record at a time within the last step, given the samples there.

        It is the record itself if the samples at the front are in the peaks.
        """
        if not self.ahead:
            return self
        triples = zip(self.peaks, now, self.ahead, strict=True)
        return replace(self, peaks=tuple(one.rising(at, end) for one, at, end in triples))

    def continued(self, front: Front, *, reached: bool) -> "PeakRecord":
        """Return the record at a new front, from which another motion starts.

        Parameters
        ----------
        front : Front
            The new front.
        reached : bool
            Whether the time had reached the front before.
        """
        if not self.peaks:
            return self
        known = self.passed().peaks if reached else self.peaks
        samples = _samples(front, front.evaluate())
        pairs = zip(known, samples, strict=True)
        return PeakRecord(tuple(peak.restarted().after(sample) for peak, sample in pairs))

    def stepped(self, front: Front, found: Evaluation | None) -> "PeakRecord":
        """Return the record after a step.

        Parameters
        ----------
        front : Front
            The end of the step.
        found : Evaluation or None
            Evaluation there; None: to be computed.
        """
        if not self.peaks:
            return self
        return replace(self.passed(), ahead=_samples(front, found or front.evaluate()))


def _samples(front: Front, found: Evaluation) -> tuple[Sample, ...]:
    """Return the samples of all flexures at a front."""
    every = stresses(front.equations, front.q, front.v, found)
    return tuple(Sample.of(front.time, one) for one in every.values())
