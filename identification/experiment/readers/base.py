"""What a reader of one file format provides.

A reader turns a file into named columns of float64 numbers. It converts no unit and knows no channel: names are those of the file.
A format that keeps the time beside its channels, not among them, offers it as a column "time".
It refuses, before it allocates, a file that claims more than `experiment/limits.py` allows. A reader that hands the file to compiled code,
or to a library that was not written for damaged files, is `apart`: it runs in a process of its own, whose crash is an error of the file.

To add one: implement this one method, `read`, and name its `suffixes` and `format`, then import it in `readers/__init__.py`.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float64, Int, Shaped

from identification.experiment.limits import check_numeric, check_shape

_NINES = re.compile(r"9\.99+0*e.*")
"""Three digits or more, nines alone."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Columns:
    """What a file holds.

    Attributes:
        names: every column of the file, in its order, wanted or not.
        values: the wanted columns that the file holds, float64, shape (samples,) each; their lengths may differ.
        units: of the wanted columns, as the file itself states them; a column of which it says nothing is left out.
        notices: sentences on what had to be concluded in reading.
    """

    names: tuple[str, ...]
    values: dict[str, Float64[np.ndarray, " _"]]
    units: dict[str, str] = field(default_factory=dict)
    notices: tuple[str, ...] = ()


class AbstractReader(ABC):
    """Reads one file format."""

    suffixes: ClassVar[tuple[str, ...]]
    format: ClassVar[str]
    apart: ClassVar[bool] = False
    """Whether a file is read in a process of its own, with limits on memory and time."""
    library: ClassVar[str | None] = None
    """Module that is loaded only when such a file is read."""

    @abstractmethod
    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns of a file.

        Args:
            path: an existing plain file.
            wanted: names of the columns to read; those that the file lacks are left out of the result.

        Returns:
            The file's column names and the wanted columns.

        Raises:
            ExperimentError: the content is not as it should be. Any other exception is taken for a damaged file.
        """


def samples_of(places: Int[np.ndarray, " some"]) -> str:
    """How many samples, and between which, in a notice; counted from 1.

    Example:
        >>> samples_of(np.array([4])), samples_of(np.array([4, 5, 9]))
        ('sample 5', '3 samples, from sample 5 to 10')
    """
    if places.size == 1:
        return f"sample {places[0] + 1}"
    return f"{places.size} samples, from sample {places[0] + 1} to {places[-1] + 1}"


def marks_of_nothing(values: Float64[np.ndarray, " samples"]) -> list[float]:
    """Values with which a recorder marks samples that it could not measure, such as -9999.

    One is the least or largest of a column, stands there more than once, is written with nines alone, three at least, in whatever unit, and
    is farther from all other values than these are from one another, which are several.

    Example:
        >>> marks_of_nothing(np.array([0.1, 0.3, -9.999, -9.999, 0.2])), marks_of_nothing(np.array([0.0, 500.0, 999.0, 999.0]))
        ([-9.999], [])
    """
    finite = values[np.isfinite(values)]
    found = []
    for extreme in {float(finite.min()), float(finite.max())} if finite.size else ():
        rest = finite[finite != extreme]
        if not _NINES.fullmatch(f"{abs(extreme):.6e}") or finite.size - rest.size < 2 or rest.size == 0:
            continue
        if 0.0 < np.ptp(rest) < np.abs(rest - extreme).min():
            found.append(extreme)
    return found


def as_column(array: Shaped[np.ndarray, "..."], name: str) -> Float64[np.ndarray, " samples"]:
    """Turn an array of a binary file into a column.

    Args:
        array: one-dimensional, or with one dimension longer than 1, of integers or real numbers.
        name: the column's name, for messages.

    Returns:
        The numbers, float64, shape (samples,), freshly allocated.

    Raises:
        ExperimentError: too many samples, another shape, or no real numbers.
    """
    check_shape(array.shape, name)
    check_numeric(array.dtype, name)
    return np.array(array, dtype=np.float64).reshape(-1)
