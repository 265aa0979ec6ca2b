"""Listing of the classes of one kind in a package: an import in its `__init__.py` lists a class."""

from collections.abc import Mapping
from typing import TypeVar

T = TypeVar("T")


def final_classes(names: Mapping[str, object], kind: type[T]) -> tuple[type[T], ...]:
    """Final classes of a kind among the names of a module, in the order in which it imports them.

    Args:
        names: `vars()` of the module.
        kind: their base class; classes named `Abstract…` are not final.

    Example:
        >>> final_classes({"yes": bool, "number": 3, "text": str, "AbstractInt": int}, int)
        (<class 'bool'>,)
    """
    classes = [one for name, one in names.items() if isinstance(one, type) and not name.startswith("Abstract")]
    return tuple(one for one in classes if issubclass(one, kind))
