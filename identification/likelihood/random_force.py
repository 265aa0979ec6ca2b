"""Random force on the hammer (process noise): a Gaussian process with exponential autocorrelation, given at knots."""

import dataclasses
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Float

from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import over_noise
from identification.likelihood.noise import Autoregression
from identification.likelihood.response import force_responses

KNOTS_PER_PERIOD = 28
"""Knots per period of the fastest vibration of the rig."""
MOST_KNOTS = 80
"""Largest number of knots in a window."""
_LEAST_SAMPLES = 4
"""Fewest samples from one knot to the next."""
_AT_ONCE = 4
"""Knots processed together: few enough for the processor's cache."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RandomForce:
    """Stationary Gaussian process with covariance std^2 exp(-|t - t'| / memory) (Ornstein-Uhlenbeck, Matern 1/2), linear between knots.

    Attributes:
        std: root mean square, N.
        memory: correlation time, s; the power falls to half at the corner 1 / (2 pi memory), Hz.

    Source: G. E. Uhlenbeck, L. S. Ornstein, Phys. Rev. 36 (1930) 823-841; M. L. Stein, Interpolation of Spatial Data (1999).
    """

    std: float
    memory: float

    def root(self, knots: Float[np.ndarray, " knots"]) -> Float[np.ndarray, "knots knots"]:
        """Lower triangular root of the covariance at the knots, N.

        For an Ornstein-Uhlenbeck process: f_1 = std e_1, f_(k+1) = c_k f_k + std sqrt(1 - c_k^2) e_(k+1), c = exp(-dt / memory).
        """
        steps = np.exp(-np.diff(knots) / self.memory)
        found = np.zeros((len(knots), len(knots)))
        found[0, 0] = self.std
        for k, c in enumerate(steps):
            found[k + 1] = c * found[k]
            found[k + 1, k + 1] = self.std * np.sqrt(1.0 - c**2)
        return found


def knots(at: Linearised, fastest_hz: float) -> Float[np.ndarray, " knots"]:
    """Knots of the random force, s from the start of a window, the same in all windows; at samples where all are sampled alike.

    Args:
        at: all windows.
        fastest_hz: highest of natural and excitation frequencies.
    """
    dt = float(np.median(np.diff(at.ts[:, :2], axis=1)))
    last = np.take_along_axis(at.ts, at.lengths[:, None] - 1, axis=1)[:, 0]
    span = float((last - at.ts[:, 0]).max())
    spacing = 1.0 / (KNOTS_PER_PERIOD * fastest_hz) if fastest_hz > 0 else 0.0
    spacing = max(spacing, _LEAST_SAMPLES * dt, span / (MOST_KNOTS - 1))
    spacing = dt * np.ceil(spacing / dt * (1.0 - 1e-12))
    return spacing * np.arange(int(np.ceil(span / spacing * (1.0 - 1e-12))) + 1)


def hats(at: Linearised, places: Float[np.ndarray, " knots"], chosen: slice = slice(None)) -> Float[np.ndarray, "windows chosen time"]:
    """Forces of 1 N at each of some knots, falling linearly to 0 at the next ones."""
    since, spacing = at.ts - at.ts[:, :1], places[1] - places[0] if len(places) > 1 else 1.0
    return np.clip(1.0 - np.abs(since[:, None] - places[chosen][:, None]) / spacing, 0.0, None)


def force_response(
    at: Linearised, mass: float, places: Float[np.ndarray, " knots"], noise: Mapping[str, Autoregression]
) -> Float[np.ndarray, "windows knots samples"]:
    """First-order response Z of the residuals to each of the `hats`, whitened by the noise; a few knots at a time, on all cores."""
    found = np.empty((len(at.u), len(places), *at.residual.shape[:0:-1]))

    def some(first: int) -> None:
        chosen = slice(first, first + _AT_ONCE)
        forces = hats(at, places, chosen)
        begin = max(int(np.argmax(forces.any(axis=(0, 1)))) - 1, 0)  # nothing responds before
        later = at.since(begin)
        found[:, chosen, :, :begin] = 0.0
        found[:, chosen, :, begin:] = over_noise(force_responses(later, mass, forces[..., begin:]), later, noise)

    some(0)  # computes the cached quadrature before the threads share it
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(some, range(_AT_ONCE, len(places), _AT_ONCE)))
    return found.reshape(*found.shape[:2], -1)
