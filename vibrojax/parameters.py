"""What laws, suspensions and effects declare: their parameters, and which classes of a package are listed."""

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np


@dataclasses.dataclass(frozen=True)
class Parameter:
    """Name, thesis symbol, unit and admissible range of one physical parameter.

    A positive parameter (`lower >= 0`, `logarithmic`) is estimated through its logarithm, so that a step of the fit is relative
    and never leaves the range of positive numbers.

    Example:
        >>> Parameter("zeta", "ζ", "1", field="damping_ratio", start=0.02, upper=2.0).logarithmic
        True
    """

    name: str
    """Name in `fit.json` and `model.json`."""
    symbol: str
    """The thesis's symbol, for printed tables."""
    unit: str
    _: dataclasses.KW_ONLY
    field: str = ""
    """Attribute of the law, suspension or effect that holds the value; that of its name where left out."""
    start: float
    """Order of magnitude, taken where the data suggest nothing better."""
    lower: float = 0.0
    upper: float = np.inf
    most: float = np.inf
    """Largest value that is possible; `upper` is where a fit stops looking."""
    logarithmic: bool = True
    """Never where `lower` is below zero."""
    scale: float = 1.0
    """Size that is usual, for one that is not estimated through its logarithm: a step of the fit is measured by it."""
    per_record: bool = False
    """Whether every record has its own value."""
    searched: bool = False
    """Found by trying values, because the records have no derivative in it nearly anywhere; a fit leaves it alone."""
    resolution: float = 0.0
    """Standard deviation, SI, of what the equation itself leaves open in it, which comes on top of the records' error."""
    meaning: str = ""
    from_gap: str = ""
    """Of one that counts from the gap as set: symbol of the place u that both make, which is reported instead."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "field", self.field or self.name)
        object.__setattr__(self, "logarithmic", self.logarithmic and self.lower >= 0)

    def refusal(self, value: float) -> str:
        """What was to be expected in place of a value that is not possible; empty where it is."""
        if value > self.most:
            return f"a number of at most {self.most:g}"
        positive = self.lower > 0 and not self.logarithmic
        if self.lower >= 0 and (value < 0 or (positive and value == 0)):
            return f"a number {'above' if positive else 'of at least'} 0"
        return ""

    def to_internal(self, value: float) -> float:
        """Value in SI -> the coordinate in which the fit moves."""
        return float(np.log(value)) if self.logarithmic else float(value) / self.scale

    def to_physical(self, internal: float) -> float:
        """Coordinate of the fit -> value in SI."""
        return float(np.exp(internal)) if self.logarithmic else float(internal) * self.scale

    def slope(self, value: float) -> float:
        """Derivative of the value in SI with respect to the coordinate of the fit: turns a standard error of one into that of the other."""
        return abs(value) if self.logarithmic else self.scale

    def as_field(self) -> Any:
        """Field of a class that holds a value of this parameter (see `parameter`)."""
        return dataclasses.field(metadata={_KEY: self})


_KEY = "parameter"


def parameter(symbol: str, unit: str, *, name: str = "", default: Any = dataclasses.MISSING, **more: Any) -> Any:
    """A field of a law, suspension or effect that holds a parameter of its own.

    As in `drag_coefficient: Value = parameter("c_d", "N s^2/m^2", start=1.0, logarithmic=False, meaning="drag coefficient")`.

    Args:
        symbol: of the `Parameter`, as unit and `more` are.
        unit: see there.
        name: of the parameter; that of the field where left out.
        default: of the field; it must be given where left out.
        more: see there.
    """
    return dataclasses.field(default=default, metadata={_KEY: Parameter(name, symbol, unit, **more)})


class DeclaredParameters:
    """Class attribute `parameters`: those that the fields of a class declare, in their order."""

    def __get__(self, one: object, owner: type) -> tuple[Parameter, ...]:
        """Of the class."""
        return _declared(owner)


@functools.cache
def _declared(owner: Any) -> tuple[Parameter, ...]:
    declaring = [one for one in dataclasses.fields(owner) if _KEY in one.metadata]
    return tuple(dataclasses.replace(one.metadata[_KEY], name=one.metadata[_KEY].name or one.name, field=one.name) for one in declaring)


_Kind = TypeVar("_Kind")


def final_classes(names: Mapping[str, object], kind: type[_Kind]) -> tuple[type[_Kind], ...]:
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
