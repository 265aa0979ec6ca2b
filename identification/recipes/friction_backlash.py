"""A friction damper that a testing machine moves to and fro."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut

TIME, STROKE, FORCE = 0, 1, 2
"""Columns of a test."""


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Stroke and force of one test.

    Args:
        folder: of the data set.
        cut: which file and part; options `test` (name of the test) and `every` (samples kept: every how many).

    Returns:
        `time`, s; `stroke`, in; `force`, kip, positive while it resists a motion towards positive stroke.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        table = archive[cut.options["test"]].astype(float)
    kept = np.flatnonzero((table[:, TIME] >= cut.start) & (table[:, TIME] <= cut.stop))[:: cut.options["every"]]
    return {"time": table[kept, TIME] - table[kept[0], TIME], "stroke": table[kept, STROKE], "force": table[kept, FORCE]}
