"""The results of the source, one function each; :mod:`prbm.validation.page` writes the page.

Every function computes what it states, with what it is compared with: printed values as the source
prints them, finite elements, closed forms, the truth of synthetic records.
"""

from . import measurements as measured
from . import models
from .side_by_side import Reproduction

__all__ = ["RESULTS"]

RESULTS: tuple[Reproduction, ...] = (
    Reproduction("table-1", models.table_1),
    Reproduction("table-4-1", models.table_4_1, True, 5),
    Reproduction("k-theta", models.k_theta, True, 6),
    Reproduction("figure-4-4", models.figure_4_4, True, 8),
    Reproduction("figure-4-5", models.figure_4_5),
    Reproduction("figure-5-1", measured.figure_5_1, True, 3),
    Reproduction("figure-5-4", measured.figure_5_4),
    Reproduction("figure-5-5", measured.figure_5_5, False, 4),
    Reproduction("finite-elements", measured.elements_of_steel, True, 3),
    Reproduction("figure-5-6", measured.figure_5_6, False, 12),
    Reproduction("figure-5-7", measured.figure_5_7, True, 90),
    Reproduction("figure-6-2", models.figure_6_2, False, 15),
    Reproduction("figure-6-3", models.figure_6_3, False, 8),
    Reproduction("figure-6-4", models.figure_6_4, True, 6),
    Reproduction("figure-6-5", models.figure_6_5, True, 5),
    Reproduction("chapter-7", measured.chapter_7),
)
"""In the order of the page."""
