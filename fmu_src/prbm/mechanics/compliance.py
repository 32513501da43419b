r"""The law of compliant stops: elastic force and damping that give a coefficient of restitution.

With the indentation d, its rate d' and the reference speed v0, the force on the body is

    F = k d^n (1 + a d'/v0)    pressed,      F = k d^n (1 + a)    rising,      F = 0    free.

The factor a follows from the restitution e of a point mass that arrives with the speed v0,

    (1 + a) / (1 - a e) = exp(a (1 + e)),

for any stiffness, exponent and speed [1, 2].

Sources
-------
.. [1] K. H. Hunt, F. R. E. Crossley, Journal of Applied Mechanics 42 (1975) 440.
.. [2] Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedboeuf, Multibody System Dynamics 11 (2004) 209.
"""

import math
from typing import NamedTuple

from ..base.tolerances import (
    DAMPING_BISECTIONS,
    DAMPING_ELASTIC_MIN,
    DAMPING_PLASTIC_MAX,
)
from .contact_state import ContactPhase, Phase


class ComplianceLaw(NamedTuple):
    """The law of a compliant stop.

    Parameters
    ----------
    stiffness : float
        Stiffness k [N/m^n].
    exponent : float
        Exponent n [-].
    damping : float
        Factor a of the damping [-].
    """

    stiffness: float
    exponent: float
    damping: float

    def elastic_force(self, d: float) -> float:
        """Return sign(d) k |d|^n [N]; the sign keeps the force smooth at the end of a contact.

        Examples
        --------
        >>> ComplianceLaw(8.0, 1.5, 0.0).elastic_force(-0.25)
        -1.0
        """
        size = d if self.exponent == 1.0 else math.copysign(abs(d) ** self.exponent, d)
        return self.stiffness * size

    def force(self, touching: ContactPhase, d: float, rate: float) -> float:
        """Return the force of a contact with the indentation d [m] and its rate [m/s].

        Examples
        --------
        >>> law, contact = ComplianceLaw(100.0, 1.0, 0.5), ContactPhase(Phase.PRESSED, 2.0)
        >>> law.force(contact, 0.25, 1.0)
        31.25
        """
        if touching.phase is Phase.FREE:
            return 0.0
        return self.elastic_force(d) * self.damping_ratio(touching, rate)

    def damping_ratio(self, touching: ContactPhase, rate: float) -> float:
        """Return the force over the elastic force [-]; a free contact begins where it is zero."""
        if touching.phase is Phase.RISING:
            return 1.0 + self.damping
        return 1.0 + self.damping * rate / touching.reference_speed

    def energy(self, d: float) -> float:
        """Return the elastic energy k |d|^(n + 1) / (n + 1) [J].

        Examples
        --------
        >>> ComplianceLaw(100.0, 1.0, 0.5).energy(0.25)
        3.125
        """
        return self.elastic_force(abs(d)) * abs(d) / (self.exponent + 1.0)

    def depth(self, force: float) -> float:
        """Return the indentation d at which an elastic force >= 0 [N] acts [m].

        Examples
        --------
        >>> ComplianceLaw(8.0, 1.5, 0.0).depth(1.0)
        0.25
        """
        return math.pow(force / self.stiffness, 1.0 / self.exponent)

    def tangent(self, d: float) -> float:
        """Return the stiffness of small motions about an indentation d > 0 [N/m]."""
        return self.exponent * self.elastic_force(d) / d


def damping_factor(restitution: float) -> float:
    """Return the factor a for a coefficient of restitution e, 0.01 <= e <= 1.

    Below ``DAMPING_PLASTIC_MAX`` it is 1/e, above ``DAMPING_ELASTIC_MIN`` the first term of its
    series; both are exact to 1e-7.

    Examples
    --------
    >>> [round(damping_factor(e), 4) for e in (1.0, 0.95, 0.6, 0.3, 0.05)]
    [0.0, 0.0789, 0.9749, 3.0871, 20.0]
    """
    e = restitution
    if e > DAMPING_ELASTIC_MIN:
        return 3.0 * (1.0 - e * e) / (2.0 * (1.0 + e**3))
    if e < DAMPING_PLASTIC_MAX:
        return 1.0 / e
    low, high = 0.5 * (1.0 - e), 1.0 / e
    for _ in range(DAMPING_BISECTIONS):
        a = 0.5 * (low + high)
        if math.log1p(a) - math.log1p(-a * e) < a * (1.0 + e):
            low = a
        else:
            high = a
    return 0.5 * (low + high)
