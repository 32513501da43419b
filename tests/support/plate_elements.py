"""Natural frequencies of a plate by plane-stress finite elements (scikit-fem, meshes of meshpy)."""

import meshpy.triangle
import numpy as np
import shapely
import skfem
from scipy.sparse.linalg import eigsh
from skfem.helpers import ddot, dot, eye, sym_grad, trace


def mesh(plate: shapely.Polygon, thin: shapely.Geometry, fine: float, coarse: float):
    """Return a triangle mesh with elements of a size in thin parts, and larger ones elsewhere [m].

    The sides of the outline are divided to the same sizes.
    """
    points, facets = [], []
    shapely.prepare(thin)
    for ring in (plate.exterior, *plate.interiors):
        z = np.array(ring.coords)[:-1] @ [1, 1j]
        divided = []
        for a, b in zip(z, np.roll(z, -1), strict=True):
            near = thin.distance(shapely.Point(*_pair(0.5 * (a + b)))) < fine
            count = max(1, int(np.ceil(abs(b - a) / (fine if near else coarse))))
            divided += [a + (b - a) * k / count for k in range(count)]
        first = len(points)
        points += [_pair(p) for p in divided]
        facets += [(first + k, first + (k + 1) % len(divided)) for k in range(len(divided))]
    info = meshpy.triangle.MeshInfo()
    info.set_points(points)
    info.set_facets(facets)
    holes = [shapely.Polygon(ring).representative_point() for ring in plate.interiors]
    info.set_holes([(p.x, p.y) for p in holes])

    def large(corners, area) -> bool:
        x = sum(p[0] for p in corners) / 3
        y = sum(p[1] for p in corners) / 3
        size = fine if thin.distance(shapely.Point(x, y)) < fine else coarse
        return bool(area > 0.43 * size**2)

    built = meshpy.triangle.build(info, refinement_func=large, min_angle=25)
    return skfem.MeshTri(np.array(built.points).T, np.array(built.elements).T)


def _pair(z: complex) -> tuple[float, float]:
    return z.real, z.imag


def frequencies(
    grid, ground: shapely.Geometry, E: float, density: float, poisson: float, count: int = 3
) -> np.ndarray:
    """Return natural frequencies of a plate whose nodes in the ground are fixed [Hz].

    Quadratic triangles in plane stress; the thickness of the plate has no influence.
    """
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementTriP2()))
    mu = E / (2 * (1 + poisson))
    lam = E * poisson / (1 - poisson**2)  # of plane stress

    @skfem.BilinearForm
    def stiffness(u, v, _):
        strain = sym_grad(u)
        return ddot(2 * mu * strain + lam * eye(trace(strain), 2), sym_grad(v))

    @skfem.BilinearForm
    def mass(u, v, _):
        return density * dot(u, v)

    K, M = stiffness.assemble(basis), mass.assemble(basis)
    shapely.prepare(ground)
    inside = shapely.intersects_xy(ground, *basis.doflocs)
    free = np.flatnonzero(~inside)
    K, M = K[free][:, free], M[free][:, free]
    values = eigsh(K, count, M, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(values)) / (2 * np.pi)
