"""Plane stress in symmetric notched strips, by quadratic finite elements with nine nodes.

A quarter of the strip is meshed: 0 <= x, from the waist on, and 0 <= y, from the axis to the
surface.  Nodes are an array (2 n + 1, 2 m + 1) of positions x + i y.
"""

import math

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

POISSON = 0.3


def polynomials(s):
    """Return the three quadratic shape functions on a line and their slopes at s, from -1 to 1."""
    return (
        np.array([0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)]),
        np.array([s - 0.5, -2.0 * s, s + 0.5]),
    )


def strains(z, r, s):
    """Return the strains per displacement (3, 18) at a point of an element, and its area."""
    (a, da), (b, db) = polynomials(r), polynomials(s)
    slopes = np.array([np.outer(da, b).ravel(), np.outer(a, db).ravel()])
    jacobian = np.column_stack([slopes @ z.real, slopes @ z.imag])
    d = np.linalg.solve(jacobian, slopes)
    B = np.zeros((3, 18))
    B[0, ::2] = B[2, 1::2] = d[0]
    B[1, 1::2] = B[2, ::2] = d[1]
    return B, np.linalg.det(jacobian)


def elasticity():
    """Return the stress per strain, for Young's modulus 1."""
    shear = 0.5 * (1.0 - POISSON)
    return np.array([[1.0, POISSON, 0.0], [POISSON, 1.0, 0.0], [0.0, 0.0, shear]]) / (
        1 - POISSON**2
    )


def stiffness(z, elements):
    """Return the stiffness of all elements."""
    points, weights = leggauss(3)
    D, rows, columns, values = elasticity(), [], [], []
    for nodes in elements:
        K = np.zeros((18, 18))
        for r, wr in zip(points, weights, strict=True):
            for s, ws in zip(points, weights, strict=True):
                B, area = strains(z[nodes], r, s)
                K += wr * ws * area * B.T @ D @ B
        at = np.column_stack([2 * nodes, 2 * nodes + 1]).ravel()
        rows.append(np.repeat(at, 18))
        columns.append(np.tile(at, 18))
        values.append(K.ravel())
    entries = (np.concatenate(rows), np.concatenate(columns))
    return coo_matrix((np.concatenate(values), entries)).tocsc()


def end_load(z, index, bending):
    """Return nodal forces of a linear stress with the moment 1, or a uniform one with the force 1.

    The stress acts on both halves of the end.
    """
    points, weights = leggauss(3)
    load, half = np.zeros(2 * z.size), z[-1, -1].imag
    for j in range(0, z.shape[1] - 1, 2):
        nodes, y = index[-1, j : j + 3], z[-1, j : j + 3].imag
        for s, w in zip(points, weights, strict=True):
            values, slopes = polynomials(s)
            stress = 1.5 * (values @ y) / half**3 if bending else 0.5 / half
            load[2 * nodes] += w * (slopes @ y) * stress * values
    return load


def concentration(z, bending):
    """Return the largest stress at the surface over that of a beam with the waist's section."""
    N, M = z.shape
    index = np.arange(N * M).reshape(N, M)
    corners = [(i, j) for i in range(0, N - 1, 2) for j in range(0, M - 1, 2)]
    elements = [index[i : i + 3, j : j + 3].ravel() for i, j in corners]
    flat = z.ravel()
    fixed = [*(2 * index[0, :])]
    fixed += [*(2 * index[:, 0]), 2 * index[0, 0] + 1] if bending else [*(2 * index[:, 0] + 1)]
    free = np.setdiff1d(np.arange(2 * z.size), fixed)
    u, K = np.zeros(2 * z.size), stiffness(flat, elements)
    u[free] = spsolve(K[free][:, free], end_load(z, index, bending)[free])
    largest, D = 0.0, elasticity()
    for (_, j), nodes in zip(corners, elements, strict=True):
        if j == M - 3:
            for r in (-1.0, -0.5, 0.0, 0.5):
                B, _ = strains(flat[nodes], r, 1.0)
                x, y, xy = D @ B @ u[np.column_stack([2 * nodes, 2 * nodes + 1]).ravel()]
                largest = max(largest, 0.5 * (x + y) + math.hypot(0.5 * (x - y), xy))
    waist = 2.0 * z[0, -1].imag
    return largest * waist**2 / 6.0 if bending else largest * waist


def notched(axes, waist, length=0.0, n=20, m=7):
    """Return the nodes of a strip with an elliptic notch, or with elliptic fillets.

    Parameters
    ----------
    axes : pair of float
        Half axes along the strip and across it.
    waist, length : float
        Thickness of the waist, and half of its length; without a length: a notch.
    n, m : int
        Elements along the notch and across half of the strip.
    """
    a, b = axes
    width = math.sqrt(waist / (4.0 * b))
    beta = width * np.sinh(math.asinh(0.5 * math.pi / width) * np.linspace(0.0, 1.0, 2 * n + 1))
    x, height = length + a * np.sin(beta), 0.5 * waist + b * (1.0 - np.cos(beta))
    if length:
        x = np.concatenate([length * np.linspace(0.0, 1.0, 2 * n + 1)[:-1], x])
        height = np.concatenate([np.full(2 * n, 0.5 * waist), height])
    beyond = (2.0 * b + waist) * np.linspace(0.0, 1.0, n + n % 2 + 1)[1:] ** 1.5
    x = np.concatenate([x, x[-1] + beyond])
    height = np.concatenate([height, np.full(len(beyond), 0.5 * waist + b)])
    across = 1.0 - (1.0 - np.linspace(0.0, 1.0, 2 * m + 1)) ** 1.5
    return x[:, None] + 1j * height[:, None] * across
