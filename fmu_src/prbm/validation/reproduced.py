"""The reproduced results of the thesis, one function each, for :mod:`prbm.validation.page`.

Each function computes numbers and their references: values printed in the thesis, finite elements,
closed forms, and the true parameters of synthetic records.
"""

from . import chapter_4, chapter_5, chapter_6, chapter_7, restitution_map
from .side_by_side import Reproduction

__all__ = ["RESULTS"]

RESULTS: tuple[Reproduction, ...] = (
    Reproduction("table-1", chapter_6.table_1),
    Reproduction("table-4-1", chapter_4.table_4_1, True, 5),
    Reproduction("k-theta", chapter_4.k_theta, True, 6),
    Reproduction("figure-4-4", chapter_4.figure_4_4, True, 8),
    Reproduction("figure-4-5", chapter_4.figure_4_5),
    Reproduction("figure-5-1", chapter_5.figure_5_1, True, 3),
    Reproduction("figure-5-4", chapter_5.figure_5_4),
    Reproduction("figure-5-5", chapter_5.figure_5_5, False, 4),
    Reproduction("finite-elements", chapter_5.elements_of_steel, True, 3),
    Reproduction("figure-5-6", chapter_5.figure_5_6, False, 12),
    Reproduction("figure-5-7", restitution_map.figure_5_7, True, 90),
    Reproduction("figure-6-2", chapter_6.figure_6_2, False, 15),
    Reproduction("figure-6-3", chapter_6.figure_6_3, False, 8),
    Reproduction("figure-6-4", chapter_6.figure_6_4, True, 6),
    Reproduction("figure-6-5", chapter_6.figure_6_5, True, 5),
    Reproduction("chapter-7", chapter_7.chapter_7),
)
"""All results in the order of the page."""
