"""Published formulas for the bending stiffness of circular notches.

The notch has the radius R and the waist t; the flexure outside it is 2 R + t thick.
"""

import math


def paros_weisbord(radius: float, waist: float, width: float, youngs_modulus: float) -> float:
    """Return the moment over the angle of a circular notch, by the theory of beams [N m/rad].

    This is the exact integral of the flexibility of the sections [1].

    Parameters
    ----------
    radius, waist, width : float
        Dimensions [m].
    youngs_modulus : float
        Young's modulus [Pa].

    References
    ----------
    [1] J. M. Paros, L. Weisbord, How to design flexure hinges, Machine Design 37 (1965) 151.

    Examples
    --------
    >>> round(paros_weisbord(4e-3, 1e-3, 0.01, 2.8e9), 4)
    1.0232
    """
    beta = waist / (2.0 * radius)
    part = beta * (2.0 + beta)
    ends = 1.0 / (1.0 + beta) + (3.0 + part) / ((1.0 + beta) * part)
    middle = 6.0 * (1.0 + beta) / math.sqrt(part) ** 3 * math.atan(math.sqrt((2.0 + beta) / beta))
    flexibility = 3.0 / (2.0 * youngs_modulus * width * radius**2) / part * (ends + middle)
    return 1.0 / flexibility


def paros_weisbord_thin(radius: float, waist: float, width: float, youngs_modulus: float) -> float:
    """Return the limit of :func:`paros_weisbord` for a thin waist [N m/rad].

    Examples
    --------
    >>> thin = (4e-3, 1e-7, 0.01, 2.8e9)
    >>> round(paros_weisbord_thin(*thin) / paros_weisbord(*thin), 4)
    1.0
    """
    return 2.0 * youngs_modulus * width * waist**2 * math.sqrt(waist / radius) / (9.0 * math.pi)


def schotborgh(radius: float, waist: float, width: float, youngs_modulus: float) -> float:
    """Return the moment over the angle of a circular notch, fitted to finite elements [N m/rad].

    The elements are plane and include shear and the stress at the notch [1].

    References
    ----------
    [1] W. O. Schotborgh, F. G. M. Kokkeler, H. Tragter, F. J. A. M. van Houten, Dimensionless
    design graphs for flexure elements and a comparison between three flexure elements, Precision
    Engineering 29 (2005) 41.

    Examples
    --------
    >>> round(schotborgh(4e-3, 1e-3, 0.01, 2.8e9), 4)
    0.9451
    """
    x = math.sqrt(waist / (2.0 * radius))
    factor = -0.0089 + 1.3556 * x - 0.5227 * x**2
    return factor * youngs_modulus * width * waist**2 / 12.0
