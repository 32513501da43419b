"""A mechanism to export, and what its FMUs have in common."""

from collections.abc import Mapping
from functools import cached_property

from ..mechanics.independent import independent
from ..mechanics.stress import with_stress
from ..mechanism.description import Mechanism
from ..runs.engine import PYTHON
from ..runs.experiment import Experiment, experiment
from .start import Start, start


class Export:
    """A mechanism with its start values, and what its FMUs have in common, each computed once.

    A property raises :class:`prbm.base.errors.PrbmError` if the mechanism cannot start.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    changes : mapping or None
        Start values of parameters and inputs that replace those of the mechanism.
    """

    def __init__(self, mechanism: Mechanism, changes: Mapping[str, float] | None = None) -> None:
        self.mechanism, self.changes = mechanism, dict(changes or {})

    @cached_property
    def start(self) -> Start:
        """The start, with the variables that every FMU has."""
        return start(self.mechanism, self.changes)

    @cached_property
    def experiment(self) -> Experiment:
        """The default experiment."""
        return experiment(self.mechanism, self.changes, engine=PYTHON)

    @cached_property
    def independent(self) -> tuple[int, ...]:
        """The independent coordinates."""
        return independent(self.mechanism)

    @cached_property
    def icons(self) -> tuple[bytes, bytes]:
        """The icon at the start as PNG and as SVG."""
        from ..drawing.icon import (  # Imported here: Matplotlib takes half a second.
            icon,
            vector_icon,
        )

        sample = self.start.sample
        return icon(self.mechanism, sample), vector_icon(self.mechanism, sample)

    @cached_property
    def with_stress(self) -> "Export":
        """The export with the stress of all flexures as outputs."""
        return Export(with_stress(self.mechanism), self.changes)
