"""How far noise that remembers makes a drop of chi-square look like evidence."""

import numpy as np
from scipy.fft import next_fast_len
from scipy.special import chdtri

_LAGS = 60
"""Samples over which noise is followed; further lags count less and less."""
_TOLD_BY = 10
"""Lags that tell whether noise is white."""
_FALSE_ALARM = 1e-3


def overstatement(before: np.ndarray, after: np.ndarray) -> float:
    """Factor c by which coloured noise inflates the drop of chi-square from one model to the next; 1 where the noise is white.

    With x = before - after, what the new model predicts otherwise, the drop is |x|^2. In noise of autocovariance R it is c times as
    large as in white noise of variance 1, c = x' R x / x' x, for one added number; of several, those that colour favours weigh most, so
    that c is rather too large. Channels count as independent. R is that of the residuals of the
    new model, so that what it explains does not count, from all windows together, and tapered (Bartlett). White noise, which a
    portmanteau test of the first lags tells once in a thousand times to be coloured, gives exactly 1.

    Args:
        before: residuals over the noise without what the new model has, 0 where nothing counts; (windows, time, channels).
        after: the same with it.

    Source: J. T. Kent, Robust properties of likelihood ratio tests, Biometrika 69 (1982) 19-27; G. E. P. Box, D. A. Pierce, J. Am. Stat.
    Assoc. 65 (1970) 1509-1526; W. K. Newey, K. D. West, Econometrica 55 (1987) 703-708.
    """
    changed = before - after
    power = float(np.sum(changed**2))
    lags = min(_LAGS, before.shape[1] - 1)
    if power == 0.0 or lags <= _TOLD_BY:
        return 1.0
    taper = 1.0 - np.arange(lags + 1) / (lags + 1)
    pairs = np.maximum(_products((after != 0).astype(float), lags), 1.0)
    noise = _products(after, lags) / pairs
    white = np.maximum(noise[0], 1e-300)
    told = float(np.sum(pairs[1 : _TOLD_BY + 1] * (noise[1 : _TOLD_BY + 1] / white) ** 2))
    if told <= float(chdtri(_TOLD_BY * np.count_nonzero(noise[0]), _FALSE_ALARM)):
        return 1.0
    shape = _products(changed, lags)
    inflated = shape[0] * noise[0] + 2.0 * np.sum(taper[1:, None] * shape[1:] * noise[1:], axis=0)
    return max(float(np.sum(inflated)) / power, 1.0)


def _products(values: np.ndarray, lags: int) -> np.ndarray:
    """(lags + 1, channels): sum of products of samples so far apart in one window."""
    size = next_fast_len(values.shape[1] + lags + 1)
    spectrum = np.abs(np.fft.rfft(values, size, axis=1)) ** 2
    return np.fft.irfft(spectrum.sum(axis=0), size, axis=0)[: lags + 1]
