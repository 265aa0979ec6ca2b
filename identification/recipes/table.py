"""A comma-separated table with a header, one column a channel."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut
from vibrojax.errors import InputError


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Columns under the names of the header, in the units of the file.

    Args:
        folder: of the data set.
        cut: which file and part, on the file's own clock.

    Returns:
        `time`, s, and every other column.

    Raises:
        InputError: there is no column `time`, or no sample in that part.
    """
    table = np.genfromtxt(folder / cut.source, delimiter=",", names=True, deletechars="", replace_space=" ")
    names = table.dtype.names or ()
    if "time" not in names:
        raise InputError(f"{cut.source} has the columns {', '.join(names)}: expected one of the name time, in s")
    kept = (table["time"] >= cut.start) & (table["time"] <= cut.stop)
    if not kept.any():
        raise InputError(f"{cut.source} has no sample between {cut.start:g} and {cut.stop:g} s: correct start and stop of the record")
    columns = {name: table[name][kept] for name in names}
    return columns | {"time": columns["time"] - columns["time"][0]}
