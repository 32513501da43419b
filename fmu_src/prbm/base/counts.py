"""Numbers that count something."""

import operator
from typing import Any, SupportsIndex

from .errors import ParameterError


def check_count(name: str, value: Any, least: int, largest: int | None = None) -> int:
    """Return a number of points, rows, workers and the like.

    Raises
    ------
    ParameterError
        If it is no integer, or out of its bounds.

    Examples
    --------
    >>> check_count("workers", 2, 1)
    2
    """
    if isinstance(value, bool) or not isinstance(value, SupportsIndex):
        raise ParameterError(f"{name} = {value!r} must be an integer")
    count = operator.index(value)
    if largest is None and count < least:
        raise ParameterError(f"{name} = {count} must be {least} or more")
    if largest is not None and not least <= count <= largest:
        raise ParameterError(f"{name} = {count} must lie between {least} and {largest}")
    return count
