"""The arm of a rotary inverted pendulum swinging freely, with a magnetic encoder."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Angle from the encoder's zero.

    The first line of a file names the numbers of the second: angle of the trigger, sampling rate, duration. One angle a line follows.

    Args:
        folder: of the data set.
        cut: which file and part, from the file's first sample.

    Returns:
        `time`, s, and `angle`, degrees.
    """
    _, rate, _ = np.loadtxt(folder / cut.source, delimiter=",", skiprows=1, max_rows=1)
    angle = np.loadtxt(folder / cut.source, skiprows=2)
    time = np.arange(len(angle)) / rate
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - time[kept][0], "angle": angle[kept]}
