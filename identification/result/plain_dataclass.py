"""Conversion of data classes to plain values and back, without loss of a bit; the caller stores arrays separately."""

import dataclasses
import math
import types
import typing
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

NOT_FINITE = ("nan", "inf", "-inf")


def to_plain(value: Any, *, without: Collection[str] = ()) -> Any:
    """Convert a data class to plain JSON data.

    Args:
        value: a data class, or the content of its fields: data classes, mappings, tuples, sets, paths, strings, numbers, None.
        without: names of fields to leave out, at any depth.

    Returns:
        Dictionaries, lists, strings, numbers; a number that is not finite becomes a string.

    Raises:
        TypeError: a field holds something else, such as an array.

    Example:
        >>> to_plain({"a": (1.5, math.inf)})
        {'a': [1.5, 'inf']}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [field.name for field in dataclasses.fields(value) if field.name not in without]
        return {name: to_plain(getattr(value, name), without=without) for name in fields}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item, without=without) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(item, without=without) for item in value]
    if isinstance(value, frozenset | set):
        return sorted(value)
    if isinstance(value, np.generic):
        return to_plain(value.item())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no plain form")


def from_plain(kind: Any, plain: Any, **given: Any) -> Any:
    """Rebuild a value of a declared type.

    Args:
        kind: the type: a data class, or the annotation of one of its fields.
        plain: from `to_plain`.
        given: fields of the outermost data class that were left out.

    Returns:
        The value.

    Raises:
        TypeError, KeyError, ValueError: the plain value is not of that type.

    Example:
        >>> from_plain(tuple[float, ...], [1, "inf"])
        (1.0, inf)
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return None if plain is None else from_plain(next(each for each in arguments if each is not type(None)), plain)
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        return kind(**{name: from_plain(hints[name], item) for name, item in plain.items()}, **given)
    if origin is dict:
        return {str(key): from_plain(arguments[1], item) for key, item in plain.items()}
    if origin is tuple:
        kinds = [arguments[0]] * len(plain) if arguments[-1] is Ellipsis else arguments
        return tuple(from_plain(each, item) for each, item in zip(kinds, plain, strict=True))
    if origin is frozenset:
        return frozenset(plain)
    if kind is float:
        return float(plain) if not isinstance(plain, str) or plain in NOT_FINITE else _refused(kind, plain)
    if kind is Path:
        return Path(plain)
    declared: Any = kind
    return plain if isinstance(declared, type) and isinstance(plain, declared) else _refused(kind, plain)


def _refused(kind: Any, plain: Any) -> Any:
    """Error for a plain value of another type; no implicit conversion."""
    raise TypeError(f"{plain!r} is no {getattr(kind, '__name__', kind)}")
