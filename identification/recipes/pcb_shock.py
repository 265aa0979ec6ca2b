"""A printed circuit board on a drop table: accelerations of table and board."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut

SAMPLING_HZ = 51_200.0
QUIET = 900
"""First samples, before the table hits, whose mean is what the amplifiers read at rest."""


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Accelerations around one hit, each less its mean before it.

    Args:
        folder: of the data set.
        cut: which file and part; option `test` (name of the test).

    Returns:
        `time`, s; `table` and `board`, m/s^2.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        both = archive[cut.options["test"]].astype(float)
    both -= both[:QUIET].mean(axis=0)
    time = np.arange(len(both)) / SAMPLING_HZ
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - time[kept][0], "table": both[kept, 0], "board": both[kept, 1]}
