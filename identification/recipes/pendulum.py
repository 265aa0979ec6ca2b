"""A pendulum arm on its bearing, with an encoder."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

from identification.recipes.base import Cut

_PARTS = (("Time_id", "Y_id"), ("Time_vad", "Y_vad"))
"""Fields of the file of segments: those meant to be fitted, then those meant for validation; one recording in all."""
_SWING = "Theta1"
"""Field of the file of one free swing."""


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Angle from hanging.

    Args:
        folder: of the data set.
        cut: which file and part, on the file's own clock; option `every` (samples kept: every how many).

    Returns:
        `time`, s, and `angle`, rad.
    """
    archive = loadmat(folder / cut.source)
    time, angle = _swing(archive) if _SWING in archive else _segments(archive)
    kept = np.flatnonzero((time >= cut.start) & (time <= cut.stop))[:: cut.options["every"]]
    return {"time": time[kept] - time[kept[0]], "angle": angle[kept] - np.pi}


def _segments(archive: dict) -> tuple[np.ndarray, np.ndarray]:
    """Time and angle of all segments, which follow each other; the second row, angular rate, is derived and not used."""
    times = [each[0].ravel() for clock, _ in _PARTS for each in archive[clock]]
    angles = [each[0][0] for _, values in _PARTS for each in archive[values]]
    return np.concatenate(times).astype(float), np.concatenate(angles).astype(float)


def _swing(archive: dict) -> tuple[np.ndarray, np.ndarray]:
    """Time and angle as the recorder's structure holds them."""
    record = archive[_SWING][0, 0]
    values = record["signals"][0, 0]["values"]
    return record["time"].ravel().astype(float), values.ravel().astype(float)
