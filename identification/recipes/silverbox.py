"""An electronic circuit that behaves as a mass on a spring."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

from identification.recipes.base import Cut

SAMPLING_HZ = 1e7 / 2**14


def read(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Input and output voltage, each less its mean over the whole file, as the authors advise.

    Args:
        folder: of the data set.
        cut: which file, and which part of it.

    Returns:
        `time`, s; `input` and `output`, V.
    """
    archive = loadmat(folder / cut.source, variable_names=["V1", "V2"])
    drive, response = (archive[name].ravel().astype(float) for name in ("V1", "V2"))
    time = np.arange(len(drive)) / SAMPLING_HZ
    kept = (time >= cut.start) & (time <= cut.stop)
    return {
        "time": time[kept] - time[kept][0],
        "input": (drive - drive.mean())[kept],
        "output": (response - response.mean())[kept],
    }
