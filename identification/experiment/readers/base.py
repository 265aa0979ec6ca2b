"""What a reader of one file format provides.

A reader turns a file into named columns of float64 numbers. It converts no unit and knows no channel: names are those of the file.
A format that keeps the time beside its channels, not among them, offers it as a column "time".
It refuses, before it allocates, a file that claims more than `experiment/limits.py` allows. A reader that hands the file to compiled code,
or to a library that was not written for damaged files, is `apart`: it runs in a process of its own, whose crash is an error of the file.

To add one: implement this one method, `read`, and name its `suffixes` and `format`, then import it in `readers/__init__.py`.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float64, Int, Shaped

from identification.experiment.errors import shown
from identification.experiment.limits import check_numeric, check_shape

_SCPI = (9.9e37, 9.91e37)
"""What instruments write for an overload, with either sign, and for no reading (SCPI-99, volume 1, 7.2.1)."""
_SINGLE_PRECISION = 1e-6
"""Relative: how near a number in single precision is to the same one in double precision, at least."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Lost:
    """Samples of a column that hold no reading, and are NaN therefore.

    Attributes:
        column: its name.
        why: what is there in place of a reading, as the predicate of a sentence: "is infinite, as in an overload".
        places: their numbers, from 0; at least one.
    """

    column: str
    why: str
    places: Int[np.ndarray, " some"]

    def sentence(self, seconds: Float64[np.ndarray, " samples"] | None) -> str:
        """Which samples were left out and why; with their times, s, where these are known.

        Example:
            >>> Lost(column="F", why="is -9999", places=np.array([4, 5])).sentence(np.arange(9) / 10)
            "Column 'F' is -9999 at 2 samples, from sample 5 (0.4 s) to 6 (0.5 s): left out."
        """
        first, last = (f"{place + 1}" + (f" ({seconds[place]:.6g} s)" if seconds is not None else "") for place in self.places[[0, -1]])
        where = f"sample {first}" if self.places.size == 1 else f"{self.places.size} samples, from sample {first} to {last}"
        return f"Column {shown(self.column)} {self.why} at {where}: left out."


@dataclass(frozen=True, kw_only=True, eq=False)
class Columns:
    """What a file holds.

    Attributes:
        names: every column of the file, in its order, wanted or not.
        values: the wanted columns that the file holds, float64, shape (samples,) each; their lengths may differ.
        units: of the wanted columns, as the file itself states them; a column without one is left out.
        notices: sentences on what had to be concluded in reading.
        lost: samples that hold no reading by the file's own marks.
    """

    names: tuple[str, ...]
    values: dict[str, Float64[np.ndarray, " _"]]
    units: dict[str, str] = field(default_factory=dict)
    notices: tuple[str, ...] = ()
    lost: tuple[Lost, ...] = ()


class AbstractReader(ABC):
    """Reads one file format."""

    suffixes: ClassVar[tuple[str, ...]]
    format: ClassVar[str]
    apart: ClassVar[bool] = False
    """Whether a file is read in a process of its own, with limits on memory and time."""
    library: ClassVar[str] = ""
    """Module that is loaded only when such a file is read, if there is one."""

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


def marks_of_nothing(values: Float64[np.ndarray, " samples"]) -> list[float]:
    """Values with which a recorder marks samples that it could not measure, such as -9999 or 9.9e37.

    One is the least or largest of a column, stands there more than once, is written with nines alone, three at least, in whatever unit, and
    is farther from all other values than these are from one another, which are several. Those of `_SCPI` are marks wherever they stand.

    Example:
        >>> marks_of_nothing(np.array([0.1, 0.3, -9.999, -9.999, 0.2])), marks_of_nothing(np.array([0.0, 500.0, 999.0, 999.0]))
        ([-9.999], [])
        >>> marks_of_nothing(np.array([0.1, 9.91e37, 0.2]))
        [9.91e+37]
    """
    found = []
    for mark in _SCPI:
        found += [float(one) for one in np.unique(values[np.isclose(np.abs(values), mark, rtol=_SINGLE_PRECISION, atol=0.0)])]
    finite = values[np.isfinite(values) & ~np.isin(values, found)]
    for extreme in {float(finite.min()), float(finite.max())} if finite.size else ():
        rest = finite[finite != extreme]
        if not re.fullmatch(r"9\.99+0*e.*", f"{abs(extreme):.6e}") or finite.size - rest.size < 2 or rest.size == 0:
            continue
        if 0.0 < np.ptp(rest) < np.abs(rest - extreme).min():
            found.append(extreme)
    return found


def without(columns: Columns, name: str, marks: Iterable[float], why: str) -> tuple[Lost, ...]:
    """Make every sample of a column NaN that is one of the marks, and say where; `why` has "{}" for the mark.

    Numbers compare in single precision, in which many recorders store them.
    """
    values, lost = columns.values[name], []
    for mark in marks:
        places = np.flatnonzero(np.isclose(values, mark, rtol=_SINGLE_PRECISION, atol=0.0))
        if places.size:
            values[places] = np.nan
            lost.append(Lost(column=name, why=why.format(f"{mark:.7g}"), places=places))
    return tuple(lost)


def as_column(array: Shaped[np.ndarray, "..."], name: str) -> Float64[np.ndarray, " samples"]:
    """Turn an array of a binary file into a column of its own, float64; `name` is for messages.

    Raises:
        ExperimentError: too many samples, more than one dimension longer than 1, or no real numbers.
    """
    check_shape(array.shape, name)
    check_numeric(array.dtype, name)
    return np.array(array, dtype=np.float64).reshape(-1)
