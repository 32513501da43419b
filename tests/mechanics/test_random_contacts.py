"""Random impacts and contacts at rest: a solution that satisfies all laws, or an error."""

from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog

import random_contacts
from kernel_library import coulomb_laws, kernel
from prbm.base.errors import SimulationError
from prbm.base.tolerances import COMPLEMENTARITY_RTOL
from prbm.mechanics import complementarity

ERRORS = {"newton": 0.0, "stronge": 0.02, "several": 0.02, "rest": 0.02, "guides": 0.01}
"""Largest allowed fractions of rejected problems."""


@pytest.mark.parametrize("engine", ["package", "kernel"])
@pytest.mark.parametrize("kind", random_contacts.SEARCHES)
def test_random_contacts_satisfy_their_laws_or_are_rejected(kind, engine):
    check(random_contacts.search(engine, kind, 300), ERRORS[kind])


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "draws"), [("package", 5_000), ("kernel", 100_000)])
@pytest.mark.parametrize("kind", random_contacts.SEARCHES)
def test_many_random_contacts_satisfy_their_laws_or_are_rejected(kind, engine, draws):
    check(random_contacts.search(engine, kind, draws, seed=1), ERRORS[kind])


@pytest.mark.slow
def test_rejected_problems_have_no_solution_in_any_combination_of_modes():
    """Each combination of modes is checked independently as a linear program."""
    rng, rejected, second_paths = np.random.default_rng(0), 0, 0
    for _ in range(6000):
        k, m = int(rng.integers(1, 4)), 2
        W, u = random_contacts.drawn(rng, k + m, k)
        mu, normal = rng.uniform(0, 2, m), np.array([0, min(1, k - 1)])
        tolerance = COMPLEMENTARITY_RTOL * np.abs(u).max()
        P = complementarity.coulomb(W, u, mu, np.zeros(m), normal, tolerance)
        if P is None and rejected < 20:
            rejected += 1
            assert not any(fits(W, u, mu, normal, *modes) for modes in combinations(k, m))
        elif P is not None:
            wrong = complementarity.violation(W, u, P, mu * P[normal])
            assert wrong < 1e-9 * np.abs(u).max()
            second_paths += not first_path_solves(W, u, mu, normal)
    assert rejected > 10
    assert second_paths > 0


@pytest.mark.slow
def test_rejected_problems_of_guides_have_no_solution_in_any_combination_of_modes():
    """The force of each guide has either side; each combination is a linear program."""
    rng, rejected, further = np.random.default_rng(3), 0, 0
    for _ in range(1500):
        problem = W, u, mu, normal, carried = random_contacts.drawn_guides(rng)
        try:
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(complementarity, "MODES_TRIED_MAX", 0)
                random_contacts.forces_of_guides("package", *problem)
            continue
        except SimulationError:
            pass
        try:
            random_contacts.forces_of_guides("package", *problem)
            further += 1
        except SimulationError:
            rejected += 1
            k, g = len(u) - len(mu), len(mu)
            assert not any(
                fits(W, u, mu, normal, *modes, carried, sides)
                for sides in product((1, -1), repeat=g)
                for modes in combinations(k, g)
            )
    assert rejected > 1
    assert further > 20


@pytest.mark.parametrize("engine", ["package", "kernel"])
def test_contacts_that_separate_without_forces_receive_none(engine):
    """Friction could jam a part of them: these problems have a second solution."""
    rng = np.random.default_rng(0)
    for _ in range(2000):
        k = 2
        W, u = random_contacts.drawn(rng, 2 * k, k)
        u[:k] *= -1.0
        mu, zero, normal = rng.uniform(0, 2, k), np.zeros(k), np.arange(k)
        P, tolerance = np.ones(2 * k), COMPLEMENTARITY_RTOL * np.abs(u).max()
        if engine == "kernel":
            assert kernel().coulomb(k, k, W, u, coulomb_laws(mu, zero, normal), tolerance, P)
        else:
            P = complementarity.coulomb(W, u, mu, zero, normal, tolerance)
        assert np.abs(P * np.diag(W)).max() < 1e-12 * np.abs(u).max()


def first_path_solves(W, u, mu, normal):
    """Return whether Lemke's method succeeds with its first covering vector."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(complementarity, "COVER_FACTOR", 1.0)
        tolerance = COMPLEMENTARITY_RTOL * np.abs(u).max()
        zero = np.zeros(len(mu))
        return complementarity.coulomb(W, u, mu, zero, normal, tolerance) is not None


def combinations(k, m):
    """Return all modes of k normals (1: closed) and m tangents (0: stick, or slip sign)."""
    return product(product((0, 1), repeat=k), product((0, 1, -1), repeat=m))


def fits(W, u, mu, normal, closed, slips, carried=None, sides=()):
    """Return whether forces satisfy the laws in given modes, to 1e-9 of the largest rate.

    ``sides`` are the signs of the normal forces of ``carried``.
    """
    scale = 1 / np.sqrt(np.abs(np.diag(W)))
    S, b = scale[:, None] * W * scale, scale * u / np.abs(scale * u).max()
    n, k, unit = len(u), len(closed), np.eye(len(u))
    top = np.abs(scale * u).max()
    bounds, equal = [], []
    for i in range(k):
        zero, positive = ((S[i], b[i]), (unit[i], 0.0))[:: 1 if closed[i] else -1]
        equal.append(zero)
        bounds.append(positive)
    for j, slip in enumerate(slips):
        share, least = mu[j] / scale[k + j], 0.0
        if carried is None:
            limit = share * scale[normal[j]] * unit[normal[j]]
        else:
            g = normal[j] - k
            limit, least = sides[g] * scale * carried.L[g], sides[g] * carried.b[g] / top
            bounds.append((limit, least))
            limit, least = share * limit, share * least
        if slip:
            equal.append((unit[k + j] + slip * limit, slip * least))
            bounds.append((slip * S[k + j], slip * b[k + j]))
        else:
            equal.append((S[k + j], b[k + j]))
            bounds += [(limit - unit[k + j], least), (limit + unit[k + j], least)]
    # Minimise the violation t of all laws a.P + c >= 0 and a.P + c = 0.
    rows = [*bounds, *equal, *((-a, -c) for a, c in equal)]
    A = np.array([[*-a, -1.0] for a, _ in rows])
    found = linprog([0.0] * n + [1.0], A, [c for _, c in rows],
                    bounds=[(None, None)] * n + [(0.0, None)])  # fmt: skip
    return found.status == 0 and found.fun < 1e-9


def check(found, errors):
    """Assert that the laws hold to 1e-9 and that at most the given share is rejected."""
    assert found.worst < 1e-9, found
    assert sum(found.errors.values()) <= errors * found.draws, found
