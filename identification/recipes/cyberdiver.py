"""A two-mass impactor with a programmed spring between its nose and its body."""

from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from identification.recipes.base import Cut

STEP_S = 2e-5
ACCELERATION_PER_COUNT = 16.0 / 32768.0 * 9.80665
AXIAL = 1
"""Row of the accelerometer that points along the spring."""
HALF_WINDOW = 50
"""Samples on either side of the local quartics that differentiate the displacement twice: 1 ms."""


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Compression of the spring, acceleration of the body as its accelerometer reads it, and that of the nose.

    In free fall, before the nose meets the water, spring and accelerometer read zero; what they do read there, on average over the
    option `rest` (s, s), is taken off. The nose has no accelerometer: its acceleration is the body's less the second derivative of
    the compression. An accelerometer feels no gravity, so neither does a model that it drives.

    Args:
        folder: of the data set.
        cut: which file and part; options `run` (name of the run), `rest` (two instants, s) and `every` (samples kept: every how many).

    Returns:
        `time`, s; `compression`, mm; `body` and `nose`, m/s^2.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        compression = 1e-3 * archive[f"{cut.options['run']}/pos_um"].astype(float)
        body = ACCELERATION_PER_COUNT * archive[f"{cut.options['run']}/acc_counts"][AXIAL].astype(float)
        begin = 1e-6 * float(archive[f"{cut.options['run']}/t0_us"])
    time = begin + STEP_S * np.arange(len(compression))
    first, last = cut.options["rest"]
    rest = (time >= first) & (time <= last)
    compression, body = compression - compression[rest].mean(), body - body[rest].mean()
    curvature = 1e-3 * savgol_filter(compression, 2 * HALF_WINDOW + 1, 4, deriv=2, delta=STEP_S)
    kept = np.flatnonzero((time >= cut.start) & (time <= cut.stop))[:: cut.options["every"]]
    return {
        "time": time[kept] - time[kept[0]],
        "compression": compression[kept],
        "body": body[kept],
        "nose": (body - curvature)[kept],
    }
