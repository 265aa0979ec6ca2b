"""Plain facts of a file: its time stamps, and every column's range, noise and saturation, in the file's own units."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from identification.experiment.columns.saturation import Saturation, find_saturation
from identification.experiment.columns.timebase import check_time
from identification.experiment.errors import ExperimentError
from identification.experiment.noise import estimate_noise
from identification.inspection.columns import Column, FileColumns

GAP = 1.5
"""Of the median step: a longer one is a gap."""


@dataclass(frozen=True, kw_only=True)
class TimeFacts:
    """What the time stamps say.

    Attributes:
        samples: their number.
        begin: first stamp, s.
        duration: last minus first, s.
        rate: samples a second, by the median step, Hz; NaN where there are fewer than two.
        jitter: standard deviation of the steps that are no gaps, over the median step.
        gaps: steps longer than `GAP` median steps.
        longest_gap: s; 0 without gaps.
        repeated: stamps equal to the one before.
        backwards: stamps before the one before.
        problem: why a record with these stamps would be refused; empty where it would not.
    """

    samples: int
    begin: float
    duration: float
    rate: float
    jitter: float
    gaps: int
    longest_gap: float
    repeated: int
    backwards: int
    problem: str


@dataclass(frozen=True, kw_only=True)
class ColumnFacts:
    """What one column says; numbers in the unit of the file.

    Attributes:
        column: its name.
        unit: as stated, or empty.
        missing: samples that are no finite number.
        low: smallest value; NaN where there is none.
        high: largest value.
        noise: standard deviation, estimated as for a fit; None where it cannot be estimated.
        saturation: levels at which the column is cut off.
    """

    column: str
    unit: str
    missing: int
    low: float
    high: float
    noise: float | None
    saturation: tuple[Saturation, ...]


def time_facts(found: FileColumns) -> TimeFacts:
    """Properties of the time stamps of a file.

    Args:
        found: the file's columns.

    Returns:
        The facts.
    """
    time = found.seconds
    usable = time[np.isfinite(time)]
    steps = np.diff(usable)
    median = float(np.median(steps)) if steps.size else float("nan")
    even = steps[(steps > 0.0) & (steps <= GAP * median)]
    gaps = steps[steps > GAP * median]
    return TimeFacts(
        samples=int(time.size),
        begin=float(usable[0]) if usable.size else float("nan"),
        duration=float(usable[-1] - usable[0]) if usable.size else 0.0,
        rate=1.0 / median if median > 0.0 else float("nan"),
        jitter=float(np.std(even)) / median if even.size and median > 0.0 else float("nan"),
        gaps=int(gaps.size),
        longest_gap=float(gaps.max(initial=0.0)),
        repeated=int(np.sum(steps == 0.0)),
        backwards=int(np.sum(steps < 0.0)),
        problem=_problem(time),
    )


def column_facts(column: Column) -> ColumnFacts:
    """Properties of one column.

    Args:
        column: as read.

    Returns:
        The facts.
    """
    finite = np.isfinite(column.values)
    usable = column.values[finite]
    marked = np.where(finite, column.values, np.nan)
    return ColumnFacts(
        column=column.name,
        unit=column.unit,
        missing=int(np.sum(~finite)),
        low=float(usable.min()) if usable.size else float("nan"),
        high=float(usable.max()) if usable.size else float("nan"),
        noise=estimate_noise(marked),
        saturation=find_saturation(marked),
    )


def _problem(time: Float64[np.ndarray, " samples"]) -> str:
    """What the loader would say."""
    try:
        check_time(time, "the record")
    except ExperimentError as error:
        return str(error)
    return ""
