r"""Parameters of a mechanism fitted to frequencies, responses and force-deflection curves.

All parameters of a mechanism can be fitted: stiffness coefficients of its flexures, the restitution
and the position of a stop, damping, a mass.  The sum of squares

    S(p) = sum ((model(p) - data)/u)^2

is minimised within bounds.  The covariance is (J^T J)^-1, with J the derivatives of the residuals.
The columns of J are scaled by the sizes of the parameters.  Its singular values s_k then measure
the information in the data: along the k-th singular direction the parameters have the relative
standard uncertainty 1/s_k.  If this is too large, the fit reports the direction as a valley.
"""

from .problem import Free, Problem
from .searches import Minimum
from .solution import Direction, Fit, fit, fitted_restitution
from .targets import DISPLACEMENT, RECORD_UNITS, ForceDeflection, Frequency, Response, Target
from .valleys import Valley, valley

__all__ = [
    "DISPLACEMENT",
    "RECORD_UNITS",
    "Direction",
    "Fit",
    "ForceDeflection",
    "Free",
    "Frequency",
    "Minimum",
    "Problem",
    "Response",
    "Target",
    "Valley",
    "fit",
    "fitted_restitution",
    "valley",
]
