"""The noise of a channel, estimated from the channel itself."""

from math import comb, sqrt

import numpy as np
from jaxtyping import Float64

ORDER = 8
MIN_DIFFERENCES = 8
LEVELS_FROM = 1_000_000
LEVELS_SHARE = 0.5
MAD_TO_STD = 1.4826022185056018


def estimate_noise(values: Float64[np.ndarray, " samples"]) -> float | None:
    """Estimate the standard deviation of a channel's noise from its 8th differences.

    The noise is taken for white: then an 8th difference has the variance C(16, 8) times that of the noise, while a signal that varies
    slowly against the sampling step cancels in it. The spread is the median absolute deviation, so impacts, which fill few samples, do
    not count. Noise that is correlated over samples (a low-passed channel) is therefore underestimated, and a signal that is poorly
    resolved by the sampling counts as noise. The result is never below the quantisation's own, step / sqrt(12); where the noise is so
    small that most samples just repeat, the step is taken from the smallest changes between neighbours.

    Args:
        values: one channel, any unit, evenly sampled, shape (samples,); NaN where not usable.

    Returns:
        The standard deviation in the same unit, above 0; None where the channel is constant or has too few usable samples.

    Example:
        >>> rng = np.random.default_rng(0)
        >>> round(estimate_noise(rng.normal(0.0, 2.0, 20_000)), 1)
        2.0
    """
    differences = np.diff(values, ORDER) if values.size > ORDER else np.empty(0)
    differences = differences[np.isfinite(differences)]
    if differences.size < MIN_DIFFERENCES:
        return None
    spread = MAD_TO_STD * float(np.median(np.abs(differences))) / sqrt(comb(2 * ORDER, ORDER))
    step = _smallest_change(values) if spread == 0.0 else quantisation_step(values)
    estimate = max(spread, step / sqrt(12.0))
    return estimate if estimate > 0.0 and np.isfinite(estimate) else None


def quantisation_step(values: Float64[np.ndarray, " samples"]) -> float:
    """Distance of the closest two levels of a channel, if its samples repeat so often that there are levels; else 0."""
    usable = values[np.isfinite(values)][:LEVELS_FROM]
    levels = np.unique(usable)
    return float(np.diff(levels).min()) if 1 < levels.size < LEVELS_SHARE * usable.size else 0.0


def _smallest_change(values: Float64[np.ndarray, " samples"]) -> float:
    """Typical smallest change between neighbours of a channel that mostly stands still."""
    changes = np.abs(np.diff(values))
    changes = changes[np.isfinite(changes) & (changes > 0.0)]
    return float(np.quantile(changes, 0.05)) if changes.size else 0.0
