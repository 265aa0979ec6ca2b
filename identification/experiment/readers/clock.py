"""Time stamps that are written as the time of day."""

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

CLOCK = re.compile(r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T])?(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2}(?:[.,]\d+)?)Z?")
DAY = 86400.0


def is_clock(cell: str) -> bool:
    """Say whether a cell is a time of day, with or without a date before it.

    Args:
        cell: text without surrounding blanks.

    Returns:
        Whether it is one.

    Example:
        >>> is_clock("2024-03-01 10:11:12.345"), is_clock("10:11")
        (True, False)
    """
    return CLOCK.fullmatch(cell) is not None


def seconds_of(cells: Sequence[str]) -> Float64[np.ndarray, " samples"]:
    """Seconds since the first stamp; a stamp more than half a day earlier than the one before belongs to the next day.

    Args:
        cells: of one column.

    Returns:
        s; NaN where a cell is no time of day.

    Example:
        >>> seconds_of(["23:59:59,5", "00:00:00,5"]).tolist()
        [0.0, 1.0]
    """
    found = [CLOCK.fullmatch(cell) for cell in cells]
    whole = np.array([np.nan if one is None else 60.0 * (60.0 * int(one["h"]) + int(one["m"])) + int(one["s"][:2]) for one in found])
    part = np.array([0.0 if one is None else float("0" + one["s"][2:].replace(",", ".")) for one in found])
    usable = np.flatnonzero(np.isfinite(whole))
    if usable.size:
        days = np.cumsum(np.diff(whole[usable], prepend=whole[usable[0]]) < -0.5 * DAY)
        whole[usable] = whole[usable] - whole[usable[0]] + DAY * days
        part -= part[usable[0]]
    return whole + part
