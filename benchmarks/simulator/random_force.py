"""A small random force on the hammer, which makes a rig that does not repeat itself."""

import dataclasses

import numpy as np
from scipy.signal import lfilter


@dataclasses.dataclass(frozen=True, kw_only=True)
class RandomForce:
    """Ornstein-Uhlenbeck force of one record: Gaussian, covariance rms^2 exp(-|t - t'| / memory), memory = 1 / (2 pi corner)."""

    rms: float
    """N"""
    corner: float
    """Where the power falls to half, Hz."""
    seed: int
    """Of this record's force."""

    def values(self, count: int, step: float) -> np.ndarray:
        """The force at `count` times that are `step` (s) apart, N: the exact recursion, begun in the stationary state."""
        white = np.random.default_rng(self.seed).normal(0.0, self.rms, count)
        kept = np.exp(-2.0 * np.pi * self.corner * step)
        return np.append(white[:1], lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], white[1:], zi=kept * white[:1])[0])
