"""Two riders on an air track, seen by motion-capture cameras."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut
from vibrojax.errors import InputError

SAMPLING_HZ = 500.0
MARKERS = ("a X", "b X")


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Distance of the two riders along the track, negative so that it grows while they approach.

    Args:
        folder: of the data set.
        cut: which file, and which part of it.

    Returns:
        `time`, s, and `closing`, mm; NaN where a marker was lost (the cell is empty, no number, or exactly zero).

    Raises:
        InputError: the file is no table of the two riders' markers.
    """
    lines = (folder / cut.source).read_text(encoding="latin-1").splitlines()
    header = next((row for row, line in enumerate(lines) if set(MARKERS) <= set(_cells(line))), None)
    if header is None:
        raise InputError(f"{cut.source} has no line with the columns {', '.join(MARKERS)}: expected a table of the two riders' markers")
    places = [_cells(lines[header]).index(marker) for marker in MARKERS]
    table = np.array([[_number(cells, place) for place in places] for cells in map(_cells, lines[header + 1 :])])
    time = np.arange(len(table)) / SAMPLING_HZ
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - cut.start, "closing": -np.abs(table[kept, 0] - table[kept, 1])}


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("\t")]


def _number(cells: list[str], place: int) -> float:
    """A coordinate; NaN where the cameras lost the marker."""
    try:
        return float(cells[place]) or np.nan
    except (IndexError, ValueError):
        return np.nan
