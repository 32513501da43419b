"""Quantities of a mechanism: numbers, or affine expressions in parameters."""

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from ..base.errors import MechanismError

Quantity = float | str

EXPRESSIONS_KEPT = 4096  # Number of parsed expressions that are kept.


# --- values -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Affine:
    """An affine expression in parameters: constant + sum(factor * parameter)."""

    constant: float = 0.0
    terms: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, values: Mapping[str, float]) -> float:
        """Return the value of the expression for given parameter values."""
        return self.constant + sum(c * values[name] for name, c in self.terms.items())

    def scaled(self, factor: float) -> "Affine":
        """Return the product of the expression and a number."""
        terms = {name: factor * c for name, c in self.terms.items()}
        return Affine(factor * self.constant, terms)

    def plus(self, other: "Affine") -> "Affine":
        """Return the sum of this and another expression."""
        terms = dict(self.terms)
        for name, c in other.terms.items():
            terms[name] = terms.get(name, 0.0) + c
        return Affine(self.constant + other.constant, terms)


def affine(quantity: Quantity) -> Affine:
    """Read a number, or an expression that is affine in parameters.

    Parameters
    ----------
    quantity : float or str
        A number, or a text of numbers, names of parameters, ``+ - * /`` and parentheses.

    Raises
    ------
    MechanismError
        If the text is not such an expression, or has a number that is not finite.

    Examples
    --------
    >>> affine("flexure.length + shuttle.width/2")({"flexure.length": 2, "shuttle.width": 1})
    2.5
    """
    try:
        result = _parsed(quantity) if isinstance(quantity, str) else Affine(float(quantity))
    except (
        TypeError,
        SyntaxError,
        ValueError,
        ArithmeticError,
        RecursionError,
        MemoryError,
    ) as why:
        reason = why.msg if isinstance(why, SyntaxError) else why
        raise MechanismError(
            f"cannot read the expression {str(quantity)[:80]!r}: write numbers and parameter names "
            f"joined by + - * /, without products of parameters ({reason})"
        ) from None
    if not all(map(math.isfinite, (result.constant, *result.terms.values()))):
        raise MechanismError(f"cannot read the expression {quantity!r}: its numbers are not finite")
    return result


@lru_cache(EXPRESSIONS_KEPT)
def _parsed(text: str) -> Affine:
    """Return the expression in a text."""
    return _affine(ast.parse(text.strip(), mode="eval").body)


def _affine(node: ast.expr) -> Affine:
    """Return the expression of a syntax tree."""
    match node:
        case ast.Constant(value=int() | float() as number):
            return Affine(float(number))
        case ast.Name() | ast.Attribute() | ast.Subscript():
            return Affine(0.0, {ast.unparse(node): 1.0})
        case ast.UnaryOp(op=ast.USub(), operand=a):
            return _affine(a).scaled(-1.0)
        case ast.UnaryOp(op=ast.UAdd(), operand=a):
            return _affine(a)
        case ast.BinOp(left=a, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() as op, right=b):
            return _combined(op, _affine(a), _affine(b))
    raise ValueError(f"{ast.unparse(node)!r} is not allowed")


def _combined(op: ast.operator, x: Affine, y: Affine) -> Affine:
    """Return the sum, difference, product or quotient of two expressions."""
    match op:
        case ast.Add():
            return x.plus(y)
        case ast.Sub():
            return x.plus(y.scaled(-1.0))
        case ast.Mult():
            if x.terms and y.terms:
                raise ValueError("a product of two parameters")
            return y.scaled(x.constant) if y.terms else x.scaled(y.constant)
    if y.terms:
        raise ValueError("a division by a parameter")
    return x.scaled(1.0 / y.constant)
