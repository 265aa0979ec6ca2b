"""Delimited text cell by cell: slower, but it forgives empty cells and says where a fault is."""

import csv
import io
from array import array
from collections.abc import Set as AbstractSet

import numpy as np
from jaxtyping import Float64

from identification.experiment.errors import ExperimentError, shown


def parse_cells(
    lines: list[str], start: int, delimiter: str, names: tuple[str, ...], wanted: AbstractSet[str]
) -> dict[str, Float64[np.ndarray, " samples"]]:
    """Parse the wanted columns of the lines below the header row.

    Args:
        lines: the whole file.
        start: index of the first line below the header row.
        delimiter: one character.
        names: the columns.
        wanted: the columns to parse; text in another column does no harm.

    Returns:
        The wanted columns, float64, shape (samples,) each; NaN for an empty cell.

    Raises:
        ExperimentError: a row of another length, or text where a number should be; with line and column.
    """
    places = [(place, name, array("d")) for place, name in enumerate(names) if name in wanted]
    for number, line in enumerate(lines[start:], start=start + 1):
        bare = line.partition("#")[0] if "#" in line else line
        if not bare.strip(" "):
            continue
        cells = bare.split(delimiter) if '"' not in bare else next(csv.reader(io.StringIO(bare), delimiter=delimiter))
        if len(cells) != len(names):
            raise ExperimentError(
                f"line {number} has {len(cells)} cells: expected {len(names)}, one for each column of the header row; correct the line"
            )
        for place, name, column in places:
            column.append(_number(cells[place], number, name))
    return {name: np.array(column, dtype=np.float64) for _, name, column in places}


def _number(cell: str, line: int, name: str) -> float:
    """Read one cell; empty is NaN. Underscores, which Python would accept, are no part of a number."""
    bare = cell.strip()
    if not bare:
        return np.nan
    try:
        value = float(bare)
    except ValueError:
        value = None
    if value is None or "_" in bare or not bare.isascii():
        remedy = "write a decimal point" if "," in bare else "leave the cell empty where nothing was recorded"
        raise ExperimentError(f"line {line}, column {shown(name)}: {shown(bare)} is not a number: expected one such as 1.5e-3; {remedy}")
    return value
