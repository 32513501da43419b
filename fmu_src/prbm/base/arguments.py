"""Checks of the types of the arguments of public functions.

:func:`checked` compares arguments with the annotations of a function before it is called, so that
an argument of a wrong type is reported by name and not by an error inside the package.
"""

import dataclasses
import functools
import inspect
import os
import reprlib
import types
import typing
from collections.abc import Callable, Collection, Mapping, Sequence
from numbers import Complex, Real
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, get_args, get_origin

from .errors import ArgumentError

P = ParamSpec("P")
T = TypeVar("T")
TEXTS = str | bytes | bytearray
MAPPINGS, LISTS = (Mapping, dict), (Sequence, list, tuple)
PHRASES = {
    float: "a number", int: "a whole number", bool: "True or False", str: "a text",
    Path: "a path", Callable: "a function",
}  # fmt: skip
SOURCES = {  # The functions that return objects of these classes.
    "Mechanism": "prbm.load",
    "Result": "prbm.simulate",
    "System": "prbm.mechanics.assembly.assemble",
    "Equilibrium": "prbm.mechanics.statics.equilibrium",
}


def checked(**units: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Return a decorator that checks the types of arguments against the annotations.

    Numbers in mappings are not checked, because the function knows their units.  Elements of
    arrays, and arguments with a text as annotation, are not checked either.

    Parameters
    ----------
    units : str
        Units of numbers by the name of the argument, for messages.

    Examples
    --------
    >>> @checked(step="s")
    ... def points(step: float | str, names: list[str]) -> None:
    ...     pass
    >>> points(None, ["x"])
    Traceback (most recent call last):
    prbm.base.errors.ArgumentError: step = None must be a number in s, or a text, "1 s"
    >>> points(0.1, "x")
    Traceback (most recent call last):
    prbm.base.errors.ArgumentError: names = 'x' must be a list, [a text, ...]
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)
        hints = {
            name: parameter.annotation
            for name, parameter in signature.parameters.items()
            if parameter.annotation is not parameter.empty
        }

        @functools.wraps(function)
        def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
            # The call below reports missing arguments.
            for name, value in signature.bind_partial(*args, **kwargs).arguments.items():
                if name in hints:
                    check(name, value, hints[name], units.get(name, ""))
            return function(*args, **kwargs)

        return wrapped

    return decorate


def check_fields(instance: Any) -> None:
    """Reject fields of a dataclass of another type than their annotations.

    Raises
    ------
    ArgumentError
        As :func:`check`.
    """
    for field in dataclasses.fields(instance):
        check(field.name, getattr(instance, field.name), field.type)


def check(name: str, value: Any, hint: Any, unit: str = "") -> None:
    """Reject an argument of another type than its annotation.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    value : object
        The argument.
    hint : type
        The annotation.
    unit : str
        Unit of a number, for the message.

    Raises
    ------
    ArgumentError
        If the argument, a name in a mapping or an element of a list has another type.
    """
    if isinstance(hint, str) or (value is None and types.NoneType in get_args(hint)):
        return
    fitting = [one for one in _alternatives(hint) if _fits(value, one)]
    if not fitting:
        raise ArgumentError(f"{name} = {reprlib.repr(value)} must be {described(hint, unit)}")
    _check_elements(name, value, fitting[0])


def _alternatives(hint: Any) -> tuple[Any, ...]:
    """Return the types of a union, or the only type."""
    return get_args(hint) if get_origin(hint) in (types.UnionType, typing.Union) else (hint,)


def _fits(value: Any, hint: Any) -> bool:
    """Return whether a value has a type, without its elements."""
    kind = get_origin(hint) or hint
    if kind in SCALARS:
        return SCALARS[kind](value)
    if kind in LISTS:
        listed = isinstance(value, Collection) and not isinstance(value, TEXTS | Mapping)
        return listed and (not _is_tuple(hint) or len(value) == len(get_args(hint)))
    if getattr(kind, "_is_protocol", False):
        members = {*vars(kind), *kind.__annotations__}
        return all(hasattr(value, name) for name in members if not name.startswith("_"))
    if isinstance(kind, type) and issubclass(kind, typing.IO):
        return hasattr(value, "write")
    return not isinstance(kind, type) or isinstance(value, kind)


def _is_tuple(hint: Any) -> bool:
    """Return whether the annotation is that of a tuple of a fixed length."""
    return get_origin(hint) is tuple and ... not in get_args(hint)


def _is_number(value: Any) -> bool:
    """Return whether a value is a real number; an array without dimensions is one."""
    if isinstance(value, bool | TEXTS) or getattr(value, "ndim", 0) != 0:
        return False
    real = isinstance(value, Real) or not isinstance(value, Complex)
    return real and (hasattr(value, "__float__") or hasattr(value, "__index__"))


def _check_elements(name: str, value: Any, hint: Any) -> None:
    """Reject elements of a mapping or list of another type."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if not inner or (hasattr(value, "dtype") and float in _alternatives(inner[0])):
        return
    if kind in MAPPINGS:
        for key, element in value.items():
            if not _fits(key, inner[0]):
                raise ArgumentError(f"{name} has the name {key!r}, which must be a text")
            if float not in _alternatives(inner[1]):
                check(f"{name}[{key!r}]", element, inner[1])
    elif kind in LISTS:
        for k, element in enumerate(value):
            check(f"{name}[{k}]", element, inner[0])


SCALARS: dict[Any, Callable[[Any], bool]] = {
    float: _is_number,
    int: lambda value: hasattr(value, "__index__") and _is_number(value),
    bool: lambda value: type(value).__name__ == "bool",  # NumPy's class has this name, too.
    Path: lambda value: isinstance(value, os.PathLike),
    Callable: callable,
}


# --- descriptions ---------------------------------------------------------------------------------


def described(hint: Any, unit: str = "") -> str:
    """Return a phrase for an annotation.

    Examples
    --------
    >>> described(float | str | None, "s")
    'a number in s, or a text, "1 s"'
    >>> described(Mapping[str, float]), described(tuple[float, ...] | Path)
    ('a mapping, {name: a number}', 'a list, [a number, ...], or a path')
    """
    if unit and str in _alternatives(hint):
        return f'a number in {unit}, or a text, "1 {unit}"'
    kinds = [one for one in _alternatives(hint) if one is not types.NoneType]
    phrases = [_phrase(one) + (f" in {unit}" if unit and one is float else "") for one in kinds]
    return ", or ".join([", ".join(phrases[:-1]), phrases[-1]] if phrases[1:] else phrases)


def _phrase(hint: Any) -> str:
    """Return a phrase for one type."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    if kind in PHRASES:
        return PHRASES[kind]
    if kind in MAPPINGS:
        return f"a mapping, {{name: {_element(inner[1:])}}}"
    if _is_tuple(hint):
        return f"a tuple, ({', '.join(map(described, inner))})"
    if kind in LISTS:
        return f"a list, [{_element(inner)}, ...]"
    name = str(getattr(kind, "__name__", kind))
    if name == "ndarray":
        return "an array, numpy.array([...])"
    article = "an" if name[0] in "AEIOU" else "a"
    return f"{article} {name}" + (f", as {SOURCES[name]} returns" if name in SOURCES else "")


def _element(inner: tuple[Any, ...]) -> str:
    """Return a phrase for the elements of a mapping or list."""
    return described(inner[0]) if inner and inner[0] is not Any else "value"
