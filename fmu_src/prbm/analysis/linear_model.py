"""Linear models of small motions, and their frequency responses."""

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from scipy.io import savemat
from scipy.optimize import brentq, minimize_scalar

from ..base.errors import ParameterError, PrbmError
from ..files.settings import in_si
from ..mechanics.arrays import Complex, Real
from ..mechanics.assembly import assemble
from ..mechanics.linear import StateSpace, input_units, output_units, state_space
from ..mechanics.resting import RestingShape, resting_shape
from ..mechanics.statics import equilibrium, load_row
from ..mechanics.system import System
from ..mechanism.description import Mechanism
from ..mechanism.supported import FREE_BODIES, check_supported
from .touching import stop_index

PEAK_RTOL = 1e-9  # Tolerance of the frequency of a peak.
PER_DECADE = 100  # Frequencies of a response per decade.
AROUND = (-10.0, -3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0, 10.0)  # Half widths of a resonance.
BATCH = 64  # Frequencies that are solved at once.
HALF_POWER = math.sqrt(0.5)  # -3 dB.


class Response(NamedTuple):
    """The response of an output to an input.

    Parameters
    ----------
    static : float
        Output over a constant input, signed; infinite or large without stiffness.
    peak : float
        Largest amplitude of the output over that of the input, in the range of frequencies.
    peak_frequency : float
        Its frequency [Hz].
    bandwidth : float or None
        Lowest frequency at which the amplitude falls below 1/sqrt(2) of the static value [Hz];
        None: it does not in the range.
    """

    static: float
    peak: float
    peak_frequency: float
    bandwidth: float | None


@dataclass(frozen=True, eq=False, repr=False)
class LinearModel:
    """x' = A x + B u, y = C x + D u of small motions about a shape at rest, in SI units.

    Inputs and outputs are changes from their values at rest.  The states are the coordinates of
    the modes (undamped, of unit modal mass), in rising order of frequency, and their rates.

    Parameters
    ----------
    system : System
        The assembled mechanism.
    shape : RestingShape
        The shape.
    space : StateSpace
        The matrices and modes.
    inputs, outputs : tuple of str
        Names in the order of the columns of B and the rows of C.
    """

    system: System
    shape: RestingShape
    space: StateSpace
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __repr__(self) -> str:
        name, given, seen = self.system.mechanism.name, ", ".join(self.inputs), self.outputs
        return f"<LinearModel of {name}: {len(self.A)} states, {', '.join(seen)} by {given}>"

    @property
    def A(self) -> Real:
        """Matrix of the states, (2 k, 2 k)."""
        return self.space.A

    @property
    def B(self) -> Real:
        """Matrix of the inputs, (2 k, m)."""
        return self.space.B

    @property
    def C(self) -> Real:
        """Matrix of the outputs, (p, 2 k)."""
        return self.space.C

    @property
    def D(self) -> Real:
        """Direct feedthrough, (p, m)."""
        return self.space.D

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        numbers = range(1, len(self.A) // 2 + 1)
        return tuple(f"mode[{k}].{what}" for what in ("amplitude", "rate") for k in numbers)

    @property
    def contacts(self) -> tuple[tuple[str, str], ...]:
        """Contacts that hold, with ``"held"`` (without friction) or ``"sticking"``."""
        return self.space.contacts

    @cached_property
    def poles(self) -> Complex:
        """Eigenvalues of A, by rising magnitude [1/s]."""
        poles: Complex = np.linalg.eigvals(self.A).astype(complex)
        result: Complex = poles[np.lexsort((poles.imag, np.abs(poles)))]
        return result

    def response(self, frequencies: Sequence[float] | Real) -> Complex:
        """Return the frequency response C (i omega - A)^-1 B + D, (f, p, m) complex.

        Parameters
        ----------
        frequencies : (f,)
            Frequencies [Hz].
        """
        omega = 2j * math.pi * np.atleast_1d(np.asarray(frequencies, float))
        unit = np.eye(len(self.A))
        parts = [
            self.C @ np.linalg.solve(some[:, None, None] * unit - self.A, self.B) + self.D
            for some in np.array_split(omega, -(-len(omega) // BATCH))
        ]
        result: Complex = np.concatenate(parts)
        return result

    def frequencies(self, low: float, high: float) -> Real:
        """Return frequencies that resolve all resonances of a range, ascending [Hz]."""
        count = max(2, math.ceil(PER_DECADE * math.log10(high / low)) + 1)
        grid = [*np.geomspace(low, high, count)]
        for pole in self.poles[self.poles.imag > 0.0]:
            grid += [(pole.imag + part * abs(pole.real)) / (2 * math.pi) for part in AROUND]
        return np.unique([x for x in grid if low <= x <= high])

    def default_range(self) -> tuple[float, float]:
        """Return a range of frequencies about the lowest modes [Hz]."""
        found = self.space.modes
        acting = found.frequency[found.frequency > found.rounding]
        if not len(acting):
            sticking = [name for name, how in self.contacts if how == "sticking"]
            held = (
                f", because friction holds the bodies at {', '.join(sticking)}" if sticking else ""
            )
            raise ParameterError(
                f"no mode vibrates{held}: give the range of frequencies of the response"
            )
        return 0.1 * float(acting[0]), 3.0 * float(acting[:6][-1])

    def measures(self, frequencies: Real, response: Complex) -> dict[tuple[str, str], Response]:
        """Return the static value, peak and bandwidth of each output (first) by each input.

        Parameters
        ----------
        frequencies, response : (f,), (f, p, m) complex
            The response at ascending frequencies [Hz].
        """
        static = self.static()
        return {
            (output, given): self._measured(
                frequencies, np.abs(response[:, i, j]), (i, j), float(static[i, j])
            )
            for i, output in enumerate(self.outputs)
            for j, given in enumerate(self.inputs)
        }

    def static(self) -> Real:
        """Return the outputs by constant inputs, (p, m); infinite if a motion has no stiffness."""
        found = self.space.modes
        if np.any(np.abs(found.frequency) <= found.rounding):
            return np.full(self.D.shape, math.inf)
        result: Real = self.D - self.C @ np.linalg.solve(self.A, self.B)
        return result

    def _measured(
        self, frequencies: Real, amplitudes: Real, at: tuple[int, int], static: float
    ) -> Response:
        def amplitude(frequency: float) -> float:
            return float(np.abs(self.response([frequency])[0][at]))

        k = int(amplitudes.argmax())
        low, high = frequencies[max(0, k - 1)], frequencies[min(len(frequencies) - 1, k + 1)]
        peak, place = float(amplitudes[k]), float(frequencies[k])
        found = minimize_scalar(
            lambda f: -amplitude(f), bounds=(low, high), method="bounded",
            options={"xatol": PEAK_RTOL * high},
        )  # fmt: skip
        if -float(found.fun) > peak:
            peak, place = -float(found.fun), float(found.x)
        limit = HALF_POWER * abs(static)
        below = np.flatnonzero(amplitudes < limit)
        if not math.isfinite(static) or not len(below) or below[0] == 0:
            return Response(static, peak, place, None)
        ends = frequencies[below[0] - 1], frequencies[below[0]]
        bandwidth = float(brentq(lambda f: amplitude(f) - limit, *ends))
        return Response(static, peak, place, bandwidth)

    def arrays(self) -> dict[str, Any]:
        """Return the matrices and the names, as in the ``.npz`` and ``.mat`` files."""
        names = {
            "states": self.states, "inputs": self.inputs, "outputs": self.outputs,
            "input_units": [input_units(self.system)[x] for x in self.inputs],
            "output_units": [output_units(self.system)[x] for x in self.outputs],
        }  # fmt: skip
        matrices = {name: getattr(self, name) for name in "ABCD"}
        return matrices | {name: np.array(list(x)) for name, x in names.items()}

    def npz(self) -> bytes:
        """Return the arrays as the content of an ``.npz`` file of NumPy."""
        out = io.BytesIO()
        np.savez(out, **self.arrays())
        return out.getvalue()

    def mat(self) -> bytes:
        """Return the arrays as the content of a ``.mat`` file of MATLAB; names are cells."""
        out: Any = io.BytesIO()
        arrays = {
            name: x if name in "ABCD" else x.astype(object) for name, x in self.arrays().items()
        }
        savemat(out, arrays)
        content: bytes = out.getvalue()
        return content

    def control(self) -> Any:
        """Return the model as a ``control.StateSpace`` of python-control.

        Names have underscores instead of dots, and no brackets: ``shuttle_x``,
        ``mode1_amplitude``.

        Raises
        ------
        PrbmError
            If python-control is not installed.
        """
        try:
            control: Any = import_module("control")
        except ImportError:
            raise PrbmError(
                'python-control is not installed: pip install "prbm-impact[control]"'
            ) from None
        plain = str.maketrans({".": "_", "[": None, "]": None})
        states, inputs, outputs = (
            [name.translate(plain) for name in names]
            for names in (self.states, self.inputs, self.outputs)
        )
        return control.ss(
            self.A, self.B, self.C, self.D,
            states=states, inputs=inputs, outputs=outputs,
        )  # fmt: skip


def linearize(
    mechanism: Mechanism,
    values: Mapping[str, float | str] | None = None,
    *,
    inputs: Sequence[str],
    outputs: Sequence[str],
    loads: Mapping[str, float | str] | None = None,
    resting: Sequence[str] = (),
) -> LinearModel:
    """Return the linear model of small motions about the shape at rest under gravity and loads.

    Contacts with friction stick: the amplitudes must be so small that they do not slip.  Stops
    that are not in ``resting`` are ignored.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism, as :func:`prbm.load` returns it.
    values : mapping or None
        Values of parameters by name: numbers in SI units, or texts with a unit, ``"0.2 mm"``; None:
        the defaults.
    inputs : sequence of str
        Forces and moments, such as ``force.x``, or ``base.acceleration.x``.
    outputs : sequence of str
        Motions of bodies and probes, such as ``shuttle.x`` and ``shuttle.vx``, gaps and forces of
        stops, reactions of the base, such as ``base.force.x``; relative to the base.
    loads : mapping or None
        Dead loads by the names of the inputs [N], [N m].
    resting : sequence of str
        Names of the stops that the mechanism rests on.

    Raises
    ------
    ParameterError
        If a name is unknown, or a value out of its bounds.
    UserMistake
        If a text is not a quantity of the right dimension.
    EquilibriumError
        If no such shape is found.
    MechanismError
        If no flexures or joints connect a body to the ground.

    Examples
    --------
    >>> import prbm
    >>> guide = prbm.load("PRBDM2R")
    >>> model = prbm.linearize(guide, inputs=["force.x"], outputs=["shuttle.x"])
    >>> model
    <LinearModel of PRBDM2R: 10 states, shuttle.x by force.x>
    >>> model.A.shape, model.states[0]
    ((10, 10), 'mode[1].amplitude')
    """
    check_supported(mechanism, "a linear model", FREE_BODIES)
    system = assemble(mechanism, mechanism.values(in_si(mechanism, values, "values")))
    given = in_si(mechanism, loads, "loads")
    free = equilibrium(system, None, given)
    stops = [stop_index(mechanism, name) for name in resting]
    shape = RestingShape(free.q, system.loop_rows, free.lam, free.load)
    if stops:
        shape = resting_shape(system, free, load_row(system, given)[1], stops)
    space = state_space(system, shape, given, stops, inputs, outputs)
    return LinearModel(system, shape, space, tuple(inputs), tuple(outputs))
