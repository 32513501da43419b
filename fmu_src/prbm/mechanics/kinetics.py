r"""Mass matrix, quadratic velocities, kinetic energy and momentum.

This is the TMT method (Newton-Euler in generalised coordinates) for absolute angles and stretches.
The positions are z = c + A E (see :mod:`prbm.mechanics.system`), and their Jacobian is
T = dz/dtheta = i A diag(e), with the columns of A repeated for stretches.  Then the mass matrix of
the directions is M = Re(T^H diag(m) T) + J, in which H = A^H diag(m) A is constant.  That of the
coordinates is Phi^T M Phi.

Sources
-------
.. [1] H. Vallery, A. L. Schwab, Advanced Dynamics, Delft (the TMT method).
"""

from .arrays import Complex, Real


def inertia(H: Complex, J: Real, e: Complex) -> tuple[Real, Real]:
    r"""Mass matrix M and quadratic-velocity matrix C of M a + C v^2 = Q.

    With Hq = diag(e)^H H diag(e),

        M = Re Hq + diag(J),    C = -Im Hq,

    so that one Hermitian product gives both.  C multiplies the *squares* v^2: with absolute angles
    there are no cross products v_i v_j.  With stretches the quadratic velocity terms are
    -Im(Hq w^2), with the complex rates w of the arms.

    Parameters
    ----------
    H : (d, d) complex
        A^H diag(m) A [kg m^2]; Hermitian.
    J : (d, d)
        Rotary inertia of each direction about its own mass centres, diagonal [kg m^2].
    e : (d,) complex
        Directions [-].

    Returns
    -------
    M : (d, d)
        Symmetric; positive definite iff no motion is massless [kg m^2].
    C : (d, d)
        Antisymmetric [kg m^2].

    Examples
    --------
    A pendulum of length 2 m and mass 3 kg has m l^2 = 12 kg m^2:

    >>> M, _ = inertia(np.array([[12.0 + 0j]]), np.zeros((1, 1)), np.array([1j]))
    >>> M.item()
    12.0
    """
    Hq = turned_moments(H, e)
    return Hq.real + J, -Hq.imag


def turned_moments(H: Complex, e: Complex) -> Complex:
    """Return Hq = diag(e)^H H diag(e), (d, d) [kg m^2]: see :func:`inertia`."""
    return e.conj()[:, None] * H * e


def kinetic_energy(M: Real, v: Real) -> float:
    """Kinetic energy v^T M v / 2 [J].

    Examples
    --------
    >>> kinetic_energy(np.array([[12.0]]), np.array([2.0]))
    24.0
    """
    return 0.5 * float(v @ M @ v)


def mass_accelerations(A: Complex, e: Complex, w: Real | Complex, change: Complex) -> Complex:
    """Accelerations z'' = A (i p' - e w^2) of the mass points [m/s^2].

    p' are the changes e w' of the arms, as :meth:`prbm.mechanics.system.System.swing` returns them
    for the accelerations.
    """
    result: Complex = A @ (1j * change - e * w * w)
    return result
