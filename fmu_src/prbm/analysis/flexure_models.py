"""Mechanisms with other models of their flexures."""

from dataclasses import replace

from ..mechanism.description import Mechanism
from ..mechanism.parts import FlexureType


def with_flexures(
    mechanism: Mechanism,
    model: str,
    *,
    axial: bool = False,
    n: int = 0,
    order: int | None = None,
    nodes: int | None = None,
) -> Mechanism:
    """Return a mechanism with another model for all of its flexures.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    model : str
        Model with its published coefficients, a key of :data:`prbm.mechanism.flexure.MODELS`.  A
        flexure that has this model already keeps its own coefficients, order and nodes.
    axial : bool
        Whether the flexures stretch.
    n : int
        Number of links; only for nR.
    order, nodes : int or None
        Order and number of nodes; only for beam (default: 3, and three more than the order).
    """

    def changed(kind: FlexureType) -> FlexureType:
        keeps = kind.model == model and order is None and nodes is None
        return replace(
            kind, model=model, axial=axial, n=n,
            initial_strain=kind.initial_strain if axial else None,
            order=kind.order if keeps else order, nodes=kind.nodes if keeps else nodes,
            coefficients=kind.coefficients if kind.model == model else {},
        )  # fmt: skip

    return replace(mechanism, flexure_types=tuple(map(changed, mechanism.flexure_types)))


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
