"""What a model parameter is called, how it is printed, and where its value may lie."""

import dataclasses

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
