"""Autocorrelated sensor noise: a Gaussian autoregressive process for each channel."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.fft import dct, idct
from scipy.ndimage import convolve1d
from scipy.signal import detrend

HIGHEST_ORDER = 6
"""Highest order of an autoregression; an anti-alias filter of two poles takes some four to eight."""

_LOUD = 2.0
"""Power of a segment over the median above which its weight is reduced."""
_WRONGLY_DECLARED = 1.5
"""Largest estimated standard deviation of the noise over the declared one; the rest is not noise."""
_COMPLETIONS, _COMPLETE, _NODES, _BINS = 100, 1e-4, 32, 400


@dataclasses.dataclass(frozen=True, kw_only=True)
class Autoregression:
    """Gaussian noise x with x_t = a_1 x_(t-1) + ... + a_p x_(t-p) + v e_t and e_t white of variance 1.

    Attributes:
        coefficients: a of the best prediction from 0, 1, ... p samples before, each padded with zeros; (order + 1, order).
        innovation: standard deviations v of these predictions; (order + 1,), the first that of the noise itself.

    Source: J. Durbin, Rev. Int. Stat. Inst. 28 (1960) 233-244 (the recursion); G. E. P. Box, G. M. Jenkins, Time Series Analysis (1970).

    Example:
        >>> noise = autoregression(np.array([1.0, 0.5]))
        >>> noise.order, round(float(noise.coefficients[1, 0]), 3), round(float(noise.innovation[1]), 3)
        (1, 0.5, 0.866)
    """

    coefficients: np.ndarray
    innovation: np.ndarray

    @property
    def order(self) -> int:
        """Order p of the autoregression."""
        return len(self.innovation) - 1

    @property
    def std(self) -> float:
        """Standard deviation of the noise."""
        return float(self.innovation[0])

    def density(self, frequency: Float[np.ndarray, " frequencies"]) -> Float[np.ndarray, " frequencies"]:
        """Two-sided power spectral density at frequencies in cycles a sample."""
        a = self.coefficients[self.order]
        transfer = 1.0 - np.exp(-2j * np.pi * np.outer(frequency, np.arange(1, self.order + 1))) @ a
        return self.innovation[-1] ** 2 / np.abs(transfer) ** 2

    def autocorrelation(self, lags: int) -> Float[np.ndarray, " lags"]:
        """Autocorrelation of the noise at lags 0, 1, ... lags - 1."""
        found = np.zeros(max(lags, self.order + 1))
        found[0] = 1.0
        for lag in range(1, len(found)):
            a = self.coefficients[min(lag, self.order)]
            found[lag] = sum(a[k - 1] * found[lag - k] for k in range(1, min(lag, self.order) + 1))
        return found[:lags]

    def whitened(
        self, values: Float[np.ndarray, "windows *rows time"], run: Int[np.ndarray, "windows time"]
    ) -> Float[np.ndarray, "windows *rows time"]:
        """Values whitened by the covariance of the noise: white with variance 1 where they are this noise.

        Args:
            values: of windows; values where nothing was recorded do not count.
            run: from `runs`; a sample is predicted from earlier ones of its own segment, so that the first ones count as well.
        """
        wide = run.reshape(len(run), *[1] * (values.ndim - 2), run.shape[1])
        values = np.where(wide > 0, values, 0.0)
        predicted = np.concatenate([np.zeros(self.order), [1.0], -self.coefficients[self.order]]) / self.innovation[self.order]
        found = convolve1d(values, predicted, axis=-1, mode="constant")
        for order in range(self.order):
            window, time = np.nonzero(run == order + 1)
            part = values[window, ..., time]
            for lag in range(1, order + 1):
                before = values[window, ..., np.maximum(time - lag, 0)]
                before[time < lag] = 0.0  # of a part of a window, before which all is zero
                part = part - self.coefficients[order, lag - 1] * before
            found[window, ..., time] = part / self.innovation[order]
        found *= wide > 0
        return found

    def log_scale(self, run: Int[np.ndarray, "... time"]) -> Float[np.ndarray, "..."]:
        """Half the log-determinant of the covariance of each segment: sum of the logarithms of the innovations."""
        scale = np.concatenate([[0.0], np.log(self.innovation)])
        return np.asarray(scale[np.minimum(run, self.order + 1)].sum(axis=-1))


def white(std: float = 1.0) -> Autoregression:
    """White noise: an autoregression of order 0."""
    return Autoregression(coefficients=np.zeros((1, 0)), innovation=np.array([std]))


def runs(valid: Bool[np.ndarray, "*windows time"]) -> Int[np.ndarray, "*windows time"]:
    """Number of consecutive recorded samples that end at each one, itself included; 0 where nothing was recorded.

    Example:
        >>> runs(np.array([True, True, False, True])).tolist()
        [1, 2, 0, 1]
    """
    count = np.cumsum(valid, axis=-1)
    return count - np.maximum.accumulate(np.where(valid, 0, count), axis=-1)


def autoregression(autocovariance: Float[np.ndarray, " lags"]) -> Autoregression:
    """Autoregression with a given autocovariance at lags 0, 1, ... of its order; the first is above zero.

    Source: Yule-Walker equations by Durbin's recursion.
    """
    highest = len(autocovariance) - 1
    a, variance = np.zeros((highest + 1, highest)), np.zeros(highest + 1)
    variance[0] = autocovariance[0]
    for order in range(1, highest + 1):
        last = a[order - 1, : order - 1]
        partial = (autocovariance[order] - last @ autocovariance[order - 1 : 0 : -1]) / variance[order - 1]
        partial = float(np.clip(partial, -0.9999, 0.9999))
        a[order, : order - 1] = last - partial * last[::-1]
        a[order, order - 1] = partial
        variance[order] = variance[order - 1] * (1.0 - partial**2)
    return Autoregression(coefficients=a, innovation=np.sqrt(variance))


def measured(segments: Sequence[Float[np.ndarray, " _"]], *, slow: float, known: float | None = None) -> Autoregression | None:
    """Noise of one channel, estimated from residual segments in which only frequencies above `slow` are noise.

    Slower cosines are projected out, because a random force or a missing effect appears there. The noise's own power at those frequencies
    is that of the autoregression: it completes the autocovariance, and both are estimated in turn (expectation-maximisation).

    Args:
        segments: without gaps; each is weighted by its length, with a power of at most `_LOUD` times the median.
        slow: frequency, cycles a sample.
        known: declared standard deviation; the estimate is limited to `_WRONGLY_DECLARED` times that. None where it is not declared.

    Returns:
        The autoregression; None where the segments are too short.

    Source: A. P. Dempster, N. M. Laird, D. B. Rubin, J. R. Stat. Soc. B 39 (1977) 1-38.
    """
    products, counts, spectra = [], [], []
    for values in segments:
        removed = int(np.ceil(2.0 * slow * len(values))) + 1
        if len(values) < max(4 * removed, 4 * HIGHEST_ORDER):
            continue
        spectrum = np.asarray(dct(detrend(values), norm="ortho"))
        spectrum[:removed] = 0.0
        fast = np.asarray(idct(spectrum, norm="ortho"))
        products.append([fast[lag:] @ fast[: len(fast) - lag] for lag in range(HIGHEST_ORDER + 1)])
        counts.append(len(values))
        spectra.append((0.5 * np.arange(removed, len(values)) / len(values), spectrum[removed:] ** 2))
    if not products:
        return None
    sums, size = np.array(products), np.array(counts, float)
    power = sums[:, 0] / size
    share = np.minimum(1.0, _LOUD * np.median(power) / np.maximum(power, 1e-300))
    seen = share @ sums / np.maximum(share @ (size[:, None] - np.arange(HIGHEST_ORDER + 1)), 1.0)
    if not seen[0] > 0:
        return None
    frequency = np.concatenate([f for f, _ in spectra])
    density = np.concatenate([weight * values for weight, (_, values) in zip(share, spectra, strict=True)])
    bins = np.minimum((frequency * 2 * _BINS).astype(int), _BINS - 1)
    count = np.bincount(bins, minlength=_BINS)
    level, place = (np.bincount(bins, weights, _BINS) / np.maximum(count, 1) for weights in (density, frequency))
    best, lowest = white(float(np.sqrt(seen[0] / (1.0 - 2.0 * slow)))), np.inf
    found = best
    for order in range(HIGHEST_ORDER + 1):
        for _ in range(_COMPLETIONS):
            before, found = found, autoregression((seen + _slow_autocovariance(found, slow))[: order + 1])
            if abs(found.std - before.std) < _COMPLETE * found.std:
                break
        model = found.density(place)
        criterion = float(np.sum(count * (np.log(model) + level / model))) + 2.0 * (order + 1)
        if criterion < lowest:
            best, lowest = found, criterion
    if known is not None and best.std > _WRONGLY_DECLARED * known:
        best = dataclasses.replace(best, innovation=best.innovation * (_WRONGLY_DECLARED * known / best.std))
    return best


def _slow_autocovariance(noise: Autoregression, slow: float) -> Float[np.ndarray, " lags"]:
    """Contribution of frequencies below `slow`, in cycles a sample, to the autocovariance."""
    nodes = (np.arange(_NODES) + 0.5) * slow / _NODES
    waves = np.cos(2.0 * np.pi * np.outer(np.arange(HIGHEST_ORDER + 1), nodes))
    return 2.0 * waves @ noise.density(nodes) * slow / _NODES
