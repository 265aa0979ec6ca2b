"""A comma-separated table with a header, one column a channel."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Columns under the names of the header, in the units of the file.

    Args:
        folder: of the data set.
        cut: which file and part, on the file's own clock.

    Returns:
        `time`, s, and every other column.
    """
    table = np.genfromtxt(folder / cut.source, delimiter=",", names=True)
    names = table.dtype.names or ()
    kept = (table["time"] >= cut.start) & (table["time"] <= cut.stop)
    columns = {name: table[name][kept] for name in names}
    return columns | {"time": columns["time"] - columns["time"][0]}
