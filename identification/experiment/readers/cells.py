"""Delimited text cell by cell: slower, but it forgives empty cells and says where a fault is."""

from array import array
from collections.abc import Set as AbstractSet

import numpy as np
from jaxtyping import Float64

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.readers.clock import is_clock, seconds_of
from identification.experiment.readers.layout import BLANKS, EMPTY, Layout, split
from identification.experiment.readers.numerals import to_number


def parse_cells(lines: list[str], layout: Layout, wanted: AbstractSet[str]) -> dict[str, Float64[np.ndarray, " samples"]]:
    """Parse the wanted columns of the rows of samples.

    Args:
        lines: the whole file.
        layout: of the file.
        wanted: the columns to parse; text in another column does no harm.

    Returns:
        The wanted columns, float64, shape (samples,) each; NaN for an empty cell. Times of day become seconds since the first of them.

    Raises:
        ExperimentError: a row of another length, or text where a number should be; with line and column.
    """
    first = layout.first or 0
    places = [(place, name, array("d")) for place, name in layout.columns if name in wanted]
    clocks: dict[str, list[str]] = {}
    for number, line in enumerate(lines[first:], start=first + 1):
        bare = line.partition("#")[0] if "#" in line else line
        if not bare.strip(EMPTY):
            continue
        cells = split(bare, layout.delimiter)
        if len(cells) != layout.width:
            raise ExperimentError(
                f"line {number} has {len(cells)} cells: expected {layout.width}, one for each column of the header row; correct the line"
            )
        for place, name, column in places:
            if is_clock(cells[place]):
                clocks.setdefault(name, []).append(cells[place])
                column.append(np.nan)
            else:
                column.append(_number(cells[place], layout, number, name))
    found = {name: np.array(column, dtype=np.float64) for _, name, column in places}
    for name, stamps in clocks.items():
        if len(stamps) != found[name].size:
            raise ExperimentError(f"column {shown(name)} holds times of day and numbers: expected one of the two; export it again")
        found[name] = seconds_of(stamps)
    return found


def _number(cell: str, layout: Layout, line: int, name: str) -> float:
    """Read one cell; empty is NaN. Underscores, which Python would accept, are no part of a number."""
    if not cell:
        return np.nan
    value = to_number(cell, layout.decimal)
    if value is None:
        remedy = "leave the cell empty where nothing was recorded"
        if layout.delimiter == BLANKS:
            remedy = "write nan where nothing was recorded"
        elif "," in cell or "." in cell:
            mark = "point" if layout.decimal == "." else "comma"
            remedy = f"write a decimal {mark} as in the other rows, and no mark between thousands"
        example = "1.5e-3".replace(".", layout.decimal)
        raise ExperimentError(f"line {line}, column {shown(name)}: {shown(cell)} is not a number: expected one such as {example}; {remedy}")
    return value
