"""The arm of a rotary inverted pendulum swinging freely, with a magnetic encoder."""

from pathlib import Path

import numpy as np

from identification.recipes.base import Cut

_HEADER = 2
"""Lines before the angles: names, then values of what follows."""
_RATE = 1
"""Place of the sampling rate, Hz, in the second line."""


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Angle from the encoder's zero.

    Args:
        folder: of the data set.
        cut: which file and part, from the file's first sample.

    Returns:
        `time`, s, and `angle`, degrees.
    """
    lines = (folder / cut.source).read_text(encoding="utf-8").splitlines()
    rate = float(lines[_HEADER - 1].split(",")[_RATE])
    angle = np.array([float(line) for line in lines[_HEADER:] if line.strip()])
    time = np.arange(len(angle)) / rate
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - time[kept][0], "angle": angle[kept]}
