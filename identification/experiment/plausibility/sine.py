"""The sine that a channel mostly is."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

ITERATIONS = 12


@dataclass(frozen=True, kw_only=True)
class Sine:
    """A sine with an offset, fitted to a channel.

    Attributes:
        frequency: Hz.
        stderr: of the frequency, Hz, taking what is left for white.
        share: of the channel's variance that the sine explains, 0 to 1.
    """

    frequency: float
    stderr: float
    share: float

    @property
    def rounded(self) -> float:
        """The frequency with the fewest decimals that lie within three standard errors of it: what an operator may have set."""
        for decimals in range(7):
            if abs(round(self.frequency, decimals) - self.frequency) <= 3.0 * self.stderr and round(self.frequency, decimals) > 0.0:
                return round(self.frequency, decimals)
        return self.frequency


def fit_sine(time: Float64[np.ndarray, " samples"], values: Float64[np.ndarray, " samples"]) -> Sine | None:
    """Find the strongest line of the periodogram and fit a sine there, its frequency included.

    Args:
        time: s, growing, shape (samples,).
        values: any unit; NaN where not usable, shape (samples,).

    Returns:
        The sine; None where the channel stands still or is too short.

    Example:
        >>> t = np.arange(2000) / 500.0
        >>> fit_sine(t, np.sin(2 * np.pi * 6.25 * t) + np.random.default_rng(0).normal(0.0, 0.01, t.size)).rounded
        6.25
    """
    usable = np.isfinite(values)
    t, v = time[usable], values[usable]
    if t.size < 16 or np.ptp(v) == 0.0:
        return None
    even = np.linspace(t[0], t[-1], t.size)
    window = np.hanning(t.size)
    power = np.abs(np.fft.rfft(window * (np.interp(even, t, v) - v.mean()))) ** 2
    power[0] = 0.0
    frequency = float(np.fft.rfftfreq(t.size, even[1] - even[0])[int(np.argmax(power))])
    width, variance, residual = 1.0 / float(t[-1] - t[0]), float(np.var(v)), v - v.mean()
    t = t - t.mean()
    stderr = width
    for _ in range(ITERATIONS):
        basis = _basis(t, frequency)
        (a, b, _), *_ = np.linalg.lstsq(basis, v, rcond=None)
        slope = 2.0 * np.pi * t * (a * basis[:, 1] - b * basis[:, 0])
        tangent = np.column_stack([basis, slope])
        step, *_ = np.linalg.lstsq(tangent, v, rcond=None)
        residual = v - tangent @ step
        covariance = np.linalg.pinv(tangent.T @ tangent) * (residual @ residual) / (t.size - 4)
        stderr = float(np.sqrt(covariance[3, 3]))
        change = float(np.clip(step[3], -width, width))
        frequency = abs(frequency + change)
        if abs(change) < 1e-3 * stderr:
            break
    return Sine(frequency=frequency, stderr=stderr, share=max(0.0, 1.0 - float(np.var(residual)) / variance))


def share_at(time: Float64[np.ndarray, " samples"], values: Float64[np.ndarray, " samples"], frequency: float) -> float:
    """Share of a channel's variance that a sine of a given frequency explains.

    Args:
        time: s, shape (samples,).
        values: any unit; NaN where not usable, shape (samples,).
        frequency: Hz.

    Returns:
        0 to 1.

    Example:
        >>> t = np.arange(2000) / 500.0
        >>> round(share_at(t, 3.0 + np.sin(2 * np.pi * 6.25 * t), 6.25), 6), round(share_at(t, np.sin(2 * np.pi * 6.25 * t), 6.5), 2)
        (1.0, 0.0)
    """
    _, left, v = _fit_at(time, values, frequency)
    return max(0.0, 1.0 - float(np.var(left) / np.var(v)))


def amplitude_at(time: Float64[np.ndarray, " samples"], values: Float64[np.ndarray, " samples"], frequency: float) -> float:
    """Amplitude of that sine, in the unit of the channel; arguments as for `share_at`.

    Example:
        >>> t = np.arange(2000) / 500.0
        >>> round(amplitude_at(t, 3.0 + 0.7 * np.sin(2 * np.pi * 6.25 * t), 6.25), 6)
        0.7
    """
    (sine, cosine, _), *_ = _fit_at(time, values, frequency)
    return float(np.hypot(sine, cosine))


def _fit_at(time: np.ndarray, values: np.ndarray, frequency: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients of sine, cosine and offset, what they leave, and the usable values."""
    usable = np.isfinite(values)
    v, basis = values[usable], _basis(time[usable] - time.mean(), frequency)
    solution, *_ = np.linalg.lstsq(basis, v, rcond=None)
    return solution, v - basis @ solution, v


def _basis(t: np.ndarray, frequency: float) -> np.ndarray:
    """Sine, cosine and offset."""
    angle = 2.0 * np.pi * frequency * t
    return np.stack([np.sin(angle), np.cos(angle), np.ones_like(t)], axis=1)
