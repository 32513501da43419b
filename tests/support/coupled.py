"""FMUs for tests of coupling: an integrator with a closed-form solution, and the guides."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from pythonfmu import FmuBuilder

from c_importer import native

_folder = TemporaryDirectory(prefix="prbm_coupled_")

INTEGRATOR = '''
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class Integrator(Fmi2Slave):
    """value' = gain * rate with the rate at the beginning of each step.

    value(0) = start + feedthrough * rate.  The first ``skipped`` steps do not change the value, and
    no step does if ``off`` is true.  It fails at the time ``end``.
    """

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.value, self.rate = 1.0, 0.0, 0.0
        self.start, self.feedthrough, self.skipped, self.off = 0.0, 0.0, 0, False
        self.end = 1e9
        for kind, name, causality, variability in (
            (Real, "gain", "parameter", "fixed"),
            (Real, "start", "parameter", "fixed"),
            (Real, "feedthrough", "parameter", "fixed"),
            (Real, "end", "parameter", "fixed"),
            (Integer, "skipped", "parameter", "fixed"),
            (Boolean, "off", "parameter", "fixed"),
            (Real, "rate", "input", "continuous"),
            (Real, "value", "output", "continuous"),
        ):
            self.register_variable(
                kind(name, causality=Fmi2Causality[causality],
                     variability=Fmi2Variability[variability])
            )

    def exit_initialization_mode(self):
        self.value = self.start + self.feedthrough * self.rate

    def do_step(self, current_time, step_size):
        if current_time >= self.end:
            return False
        if self.skipped > 0 or self.off:
            self.skipped -= 1
        else:
            self.value += self.gain * self.rate * step_size
        return True
'''


RELAY = '''
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Relay(Fmi2Slave):
    """Each output, ``Real_out`` to ``String_out``, is the input of its type."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for kind, start in ((Real, 0.0), (Integer, 0), (Boolean, False), (String, "")):
            name, discrete = kind.__name__, Fmi2Variability.discrete
            setattr(self, name, start)
            setattr(self, f"{name}_out", start)
            for own, causality in ((name, "input"), (f"{name}_out", "output")):
                self.register_variable(
                    kind(own, causality=Fmi2Causality[causality], variability=discrete)
                )

    def do_step(self, current_time, step_size):
        for name in ("Real", "Integer", "Boolean", "String"):
            setattr(self, f"{name}_out", getattr(self, name))
        return True
'''


@cache
def integrator() -> Path:
    """Return the path of an FMU that integrates its input by explicit Euler steps."""
    return _built("integrator", INTEGRATOR)


@cache
def relay() -> Path:
    """Return the path of an FMU with an input and an equal output of each type of FMI 2.0."""
    return _built("relay", RELAY)


def _built(name: str, text: str) -> Path:
    source = Path(_folder.name) / f"{name}.py"
    source.write_text(text, encoding="utf-8")
    return Path(_folder.name) / FmuBuilder.build_FMU(source, dest=_folder.name)


def guide(fmi: int, model: str = "PRBDM") -> Path:
    """Return the path of the native FMU of a guide."""
    return native(model, fmi).with_suffix(".fmu")
