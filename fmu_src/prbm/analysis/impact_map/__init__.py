"""Impact maps: the modal restitution over positions of the wall and offsets of the hit."""

from ..flexure_models import with_flexures
from .compliant import compliant
from .free_body import closed_form
from .impacts import first_impact
from .maps import OFFSETS, WALLS, Hit, ImpactMap, grouped
from .responses import fit_response, response
from .routes import algebraic, by_elements, fitted, shares, simulated

__all__ = [
    "OFFSETS",
    "WALLS",
    "Hit",
    "ImpactMap",
    "algebraic",
    "by_elements",
    "closed_form",
    "compliant",
    "first_impact",
    "fit_response",
    "fitted",
    "grouped",
    "response",
    "shares",
    "simulated",
    "with_flexures",
]
