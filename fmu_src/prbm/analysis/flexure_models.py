"""Mechanisms with other models of their flexures."""

from dataclasses import replace

from ..mechanism.description import Mechanism


def with_flexures(
    mechanism: Mechanism, model: str, *, axial: bool = False, n: int = 0
) -> Mechanism:
    """Return a mechanism with another model for all of its flexures.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    model : str
        Model with its published coefficients, a key of :data:`prbm.mechanism.flexure.MODELS`.  A
        flexure that has this model already keeps its own coefficients.
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


def stretching(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with stretching flexures and the same models of bending.

    Raises
    ------
    MechanismError
        If the only link of a flexure is fixed to the body at its free end, so that no link can
        stretch.
    """
    kinds = tuple(replace(kind, axial=True) for kind in mechanism.flexure_types)
    return replace(mechanism, flexure_types=kinds)
