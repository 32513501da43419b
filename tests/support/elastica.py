"""A rigid platform on inextensible leaves, solved as a boundary value problem by collocation.

All leaves point along +x when unloaded.  Lengths are in units of the length L of a leaf, forces in
EI/L^2 and moments in EI/L.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_bvp

LOAD_STEPS = 4


@dataclass(frozen=True)
class Leaf:
    """A leaf from the ground at ``start`` to the platform at start + 1.

    ``ends`` are the types of both ends: clamp, or pin; a free end is a clamp to the platform.
    """

    start: complex = 0j
    ends: tuple[str, str] = ("clamp", "clamp")


def platform(
    leaves: tuple[Leaf, ...], centre: complex, force: complex, moment: float = 0.0
) -> tuple[complex, float]:
    """Return displacement and rotation of a platform under a dead force at its centre.

    A leaf with the force F from the platform has theta'' = -Im(conj(e) F) with e = exp(i theta).
    The unknown parameters are F of each leaf, and displacement and rotation of the platform.  The
    load is raised in steps, each of which begins with the solution of the last one.

    Parameters
    ----------
    leaves : tuple of Leaf
        The leaves.
    centre : complex
        Centre of the platform in the unloaded shape [L].
    force, moment : complex, float
        Load on the platform [EI/L^2], [EI/L].
    """
    n = len(leaves)
    s = np.linspace(0.0, 1.0, 21)
    y = np.zeros((4 * n, len(s)))
    for k, leaf in enumerate(leaves):
        y[4 * k + 2], y[4 * k + 3] = leaf.start.real + s, leaf.start.imag
    p = np.zeros(2 * n + 3)
    p[:-3:2], p[1:-3:2] = force.real / n / LOAD_STEPS, force.imag / n / LOAD_STEPS

    def change(_, y, p):
        rates = []
        for k in range(n):
            e = np.exp(1j * y[4 * k])
            bend = -((p[2 * k] + 1j * p[2 * k + 1]) * e.conj()).imag
            rates += [y[4 * k + 1], bend, e.real, e.imag]
        return np.array(rates)

    def ends(a, b, p, load):
        moved, angle = complex(p[-3], p[-2]), p[-1]
        turn = np.exp(1j * angle)
        left, residuals = load * force, []
        couple = load * moment
        for k, leaf in enumerate(leaves):
            at_start, at_end = a[4 * k : 4 * k + 4], b[4 * k : 4 * k + 4]
            F = complex(p[2 * k], p[2 * k + 1])
            lever = (leaf.start + 1.0 - centre) * turn
            off = complex(at_end[2], at_end[3]) - (centre + moved + lever)
            residuals += [at_start[2] - leaf.start.real, at_start[3] - leaf.start.imag]
            residuals += [at_start[int(leaf.ends[0] == "pin")], off.real, off.imag]
            residuals += [at_end[1] if leaf.ends[1] == "pin" else at_end[0] - angle]
            left -= F
            couple -= (lever.conjugate() * F).imag + at_end[1]
        return np.array([*residuals, left.real, left.imag, couple])

    for load in np.linspace(0.0, 1.0, LOAD_STEPS + 1)[1:]:
        found = solve_bvp(
            change, lambda a, b, p, x=load: ends(a, b, p, x), s, y, p, tol=1e-8, max_nodes=20_000
        )
        assert found.success, found.message
        y, p = found.sol(s), found.p
    return complex(p[-3], p[-2]), float(p[-1])
