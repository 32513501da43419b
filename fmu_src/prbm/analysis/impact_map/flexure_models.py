"""Mechanisms with other models of their flexures."""

from collections.abc import Sequence
from dataclasses import replace

from ...mechanism.description import Mechanism

MODELS = (("1R", 0), ("2R", 0), ("3R", 0), ("nR", 12))


def with_flexures(
    mechanism: Mechanism, model: str, *, axial: bool = False, n: int = 0
) -> Mechanism:
    """Return a mechanism with another model for all of its flexures.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    model : {"1R", "2R", "3R", "nR"}
        Model with its published coefficients.  A flexure that has this model already keeps its own
        coefficients.
    axial : bool
        Whether the flexures stretch.
    n : int
        Number of links; only for nR.
    """
    kinds = tuple(
        replace(
            kind, model=model, axial=axial, n=n,
            coefficients=kind.coefficients if kind.model == model else {},
        )
        for kind in mechanism.flexure_types
    )  # fmt: skip
    return replace(mechanism, flexure_types=kinds)


def variants(
    mechanism: Mechanism, models: Sequence[tuple[str, int]] = MODELS
) -> dict[str, Mechanism]:
    """Return a mechanism with each model of its flexures, inextensible and axial, by label.

    Examples
    --------
    >>> from prbm.files.mechanism_file import load, shipped
    >>> list(variants(load(shipped()["PRBDM"]), (("1R", 0), ("nR", 8))))
    ['1R', '1R axial', '8R', '8R axial']
    """
    return {
        (f"{n}R" if n else model) + (" axial" if axial else ""): with_flexures(
            mechanism, model, axial=axial, n=n
        )
        for model, n in models
        for axial in (False, True)
    }
