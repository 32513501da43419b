"""Random contacts: each ends in a solution that satisfies its laws, or in an error.

``python tests/support/random_contacts.py 100000`` searches with both engines and prints, for each
kind of contact, the number of draws, of errors, and the largest violation of a law.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from kernel_library import KernelError, coulomb_laws, kernel
from prbm.base.errors import SimulationError
from prbm.base.tolerances import COMPLEMENTARITY_RTOL
from prbm.mechanics import complementarity, contact

MOVING_SHARE = 0.2  # Fraction of the draws in which walls move at random.
SINGULAR_SHARE = 0.5  # Fraction of the draws with fewer degrees of freedom than rows.


@dataclass
class Found:
    """The results of a search: draws, errors by message, and the largest violation of a law."""

    draws: int = 0
    errors: dict[str, int] = field(default_factory=dict)
    worst: float = 0.0

    def __str__(self) -> str:
        errors = sum(self.errors.values())
        share = 100 * errors / max(self.draws, 1)
        return f"{self.draws} draws, {errors} errors ({share:.3g} %), violation {self.worst:.1e}"


def drawn(rng, rows, normals):
    """Return a Delassus matrix W and contact rates; the first ``normals`` rates are closing."""
    rank = int(rng.integers(1, rows + 1)) if rng.uniform() < SINGULAR_SHARE else rows + 2
    A = rng.normal(size=(rows, rank)) * 10 ** rng.uniform(-2, 2)
    moving = rng.uniform() < MOVING_SHARE
    u = A @ rng.normal(size=rank)
    A[:normals] *= -np.sign(u[:normals])[:, None]
    u[:normals] = -np.abs(u[:normals])
    if moving:
        u[:normals] = -np.abs(rng.normal(size=normals)) * np.abs(u).max()
    return A @ A.T, u


def newton(engine, rng):
    """Return the violation of the laws of a frictionless impact of up to eight stops."""
    k = int(rng.integers(2, 9))
    W, u = drawn(rng, k, k)
    u[rng.uniform(size=k) < 0.1] *= 1e-14  # Closed stops: their rate is round-off.
    eps, P = rng.uniform(0, 1, k), np.zeros(k)
    if engine == "kernel":
        kernel().newton(k, W, u, eps, 0.0, P)
    else:
        P = contact.newton(W, u, eps)
    wrong = complementarity.violation(W, (1 + eps) * u, P, np.zeros(0))
    return max(wrong, gain(W, u, P)) / np.abs(u).max()


def stronge(engine, rng):
    """Return the violation of the laws of an impact of one stop with friction."""
    W, u = drawn(rng, 2, 1)
    mu, eps, P = rng.uniform(0, 2), rng.uniform(0, 1), np.zeros(2)
    if engine == "kernel":
        kernel().stronge(W, u, mu, eps, 0.0, P[:1], P[1:])
    else:
        P = np.array(contact.stronge(W, u, mu, eps))
    return friction_violation(W, u, np.array([mu]), P)


def several(engine, rng):
    """Return the violation of the laws of an impact of several stops with friction.

    Without restitution, each stop either opens or receives an impulse, and slides at the limit of
    friction or sticks.
    """
    k = int(rng.integers(2, 5))
    W, u = drawn(rng, 2 * k, k)
    mu, eps, P = rng.uniform(0, 2, k), rng.uniform(0, 1, k), np.zeros(2 * k)
    mu[rng.uniform(size=k) < 0.2] = 0.0
    eps *= rng.uniform() < 0.8
    if engine == "kernel":
        kernel().several(k, W, u, mu, eps, 0.0, P)
    else:
        P = contact.several(W, u, mu, eps)
    plastic = 0.0 if eps.any() else complementarity.violation(W, u, P, mu * P[:k])
    return max(friction_violation(W, u, mu, P), plastic / np.abs(u).max())


def rest(engine, rng):
    """Return the violation of the laws of contacts at rest, with Coulomb friction."""
    k, m = int(rng.integers(1, 5)), int(rng.integers(1, 5))
    W, u = drawn(rng, k + m, k)
    mu, fixed = rng.uniform(0, 1.5, m), np.zeros(m)
    normal = np.array([j if j < k else -1 for j in range(m)])
    fixed[normal < 0] = rng.uniform(0, 1) * np.abs(u).max() / np.diag(W).max()
    P, tolerance = np.zeros(k + m), COMPLEMENTARITY_RTOL * np.abs(u).max()
    if engine == "kernel":
        if not kernel().coulomb(k, m, W, u, coulomb_laws(mu, fixed, normal), tolerance, P):
            raise KernelError("no forces")
    else:
        found = complementarity.coulomb(W, u, mu, fixed, normal, tolerance)
        if found is None:
            raise SimulationError("no forces")
        P = found
    limit = fixed + mu * np.append(P[:k], 0.0)[normal]
    return complementarity.violation(W, u, P, limit) / np.abs(u).max()


def drawn_guides(rng):
    """Return a mechanism at rest on guides with friction: W, u, mu, normal, and the guide forces.

    They follow from M a = f + N^T P_n + T^T P_t + G^T lam and G a = 0.  The rows are G of the
    guides, T along them and N of up to two closed stops, in one to three degrees of freedom.  Some
    guides slide, and push along T in proportion to lam.  Each force moves its contact forwards.
    """
    while True:
        problem = _drawn_guides(rng)
        if np.diag(problem[0]).min() > 0.0:
            return problem


def _drawn_guides(rng):
    g, k = int(rng.integers(1, 4)), int(rng.integers(0, 3))
    n = g + int(rng.integers(1, 4))
    inverse = np.diag(10 ** rng.uniform(-1, 1, n))
    G, rows = rng.normal(size=(g, n)), rng.normal(size=(k + g, n))
    f, mu = rng.normal(size=n), rng.uniform(0, 3, g)
    slides = rng.choice([0.0, 0.0, 1.0, -1.0], g)
    slides[0] = 0.0
    acting = G + (slides * mu)[:, None] * rows[k:]
    carry = np.linalg.solve(G @ inverse @ acting.T, G @ inverse)  # -lam by unit loads.
    moved, rest = inverse @ (np.eye(n) - acting.T @ carry), slides == 0.0
    rows = np.vstack([rows[:k], rows[k:][rest]])
    W, u = rows @ moved @ rows.T, rows @ moved @ f
    carried = complementarity.TwoSided(-carry[rest] @ rows.T, -carry[rest] @ f)
    return W, u, mu[rest], k + np.arange(rest.sum()), carried


def guides(engine, rng):
    """Return the violation of the laws of guides with friction at rest, beside closed stops."""
    W, u, mu, normal, carried = drawn_guides(rng)
    none = np.zeros(len(mu))
    P = forces_of_guides(engine, W, u, mu, normal, carried)
    limit = complementarity.limits(P, mu, none, normal, carried)
    return complementarity.violation(W, u, P, limit) / np.abs(u).max()


def forces_of_guides(engine, W, u, mu, normal, carried):
    """Return the forces of stops and of friction along guides; raise an error if there are none."""
    P, tolerance, none = np.zeros(len(u)), COMPLEMENTARITY_RTOL * np.abs(u).max(), np.zeros(len(mu))
    if engine == "kernel":
        laws, k = coulomb_laws(mu, none, normal, *carried), len(u) - len(mu)
        if not kernel().coulomb(k, len(mu), W, u, laws, tolerance, P):
            raise KernelError("no forces")
        return P
    found = complementarity.coulomb(W, u, mu, none, normal, tolerance, carried)
    if found is None:
        raise SimulationError("no forces")
    return found


def gain(W, u, P):
    """Return the energy that impulses add, divided by the sum of the impulses [m/s]."""
    return max(float(P @ u + P @ W @ P / 2), 0.0) / max(float(np.abs(P).sum()), 1e-300)


def friction_violation(W, u, mu, P):
    """Return the largest violation of contact, cone or energy, divided by the largest rate."""
    k = len(mu)
    after, scale = u + W @ P, np.abs(u).max()
    excess = (np.abs(P[k:]) - mu * P[:k]) * np.diag(W)[k:]
    parts = (-after[:k], -P[:k] * np.diag(W)[:k], excess, [gain(W, u, P)])
    return max(float(np.max(part)) for part in parts) / scale


SEARCHES: dict[str, Callable[..., float]] = {
    "newton": newton, "stronge": stronge, "several": several, "rest": rest, "guides": guides,
}  # fmt: skip


def search(engine: str, kind: str, draws: int, seed: int = 0) -> Found:
    """Search with an engine, "package" or "kernel"."""
    rng, found = np.random.default_rng(seed), Found()
    for _ in range(draws):
        found.draws += 1
        try:
            found.worst = max(found.worst, SEARCHES[kind](engine, rng))
        except (SimulationError, KernelError) as error:
            found.errors[str(error)] = found.errors.get(str(error), 0) + 1
    return found


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    for kind in SEARCHES:
        for engine in ("package", "kernel"):
            print(f"{kind:8} {engine:8} {search(engine, kind, count)}", flush=True)
