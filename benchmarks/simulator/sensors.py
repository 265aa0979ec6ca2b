"""The simulator's sensor chain: noise, white or coloured, then a 16-bit converter that saturates."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter, lfiltic

SAMPLING_STEP = 0.25e-3
"""s"""
_LEVELS = 2**15


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sensor:
    """One channel of the recorder."""

    channel: str
    noise: float
    """Standard deviation before the converter, SI; what the operator declares."""
    full_scale: float
    """The converter reads from minus this to plus this, SI."""
    unit: str
    per_si: float = 1.0
    """How many of `unit` make one SI unit."""
    digits: int = 7
    """Significant digits in the file."""
    colour_hz: float = 0.0
    """Of the two equal real poles that colour the noise; 0 is white."""

    def read(self, signal: np.ndarray, rng: np.random.Generator, *, ceiling: float = np.inf) -> np.ndarray:
        """What the recorder writes for a true signal in SI, in SI; an amplifier that saturates passes nothing above `ceiling`."""
        step = self.full_scale / _LEVELS
        noisy = np.minimum(signal + coloured(rng.normal(0.0, self.noise, signal.shape), self.colour_hz), ceiling)
        return step * np.clip(np.round(noisy / step), -_LEVELS, _LEVELS - 1)


def coloured(white: np.ndarray, colour_hz: float) -> np.ndarray:
    """Autocorrelated noise of the same standard deviation: e_i = 2 a e_(i-1) - a^2 e_(i-2) + b w_i, a = exp(-2 pi colour_hz step).

    b keeps the standard deviation, b^2 (1 + a^2) = (1 - a^2)^3, and the first two samples have the stationary correlation 2 a / (1 + a^2).
    """
    if colour_hz == 0.0:
        return white
    a = np.exp(-2.0 * np.pi * colour_hz * SAMPLING_STEP)
    neighbours = 2.0 * a / (1.0 + a**2)
    first, second = white[0], neighbours * white[0] + np.sqrt(1.0 - neighbours**2) * white[1]
    recursion = [1.0, -2.0 * a, a**2]
    gain = np.sqrt((1.0 - a**2) ** 3 / (1.0 + a**2))
    rest = lfilter([gain], recursion, white[2:], zi=lfiltic([gain], recursion, [second, first]))[0]
    return np.concatenate([[first, second], rest])


def standard_sensors(*, force: bool = True, acceleration: bool = True) -> tuple[Sensor, ...]:
    """Displacements of hammer and cart, and the load cell and the accelerometer if wanted."""
    chosen: Sequence[Sensor] = (
        Sensor(channel="hammer_displacement", noise=1e-5, full_scale=0.1, unit="m"),
        Sensor(channel="cart_displacement", noise=1e-5, full_scale=0.1, unit="m"),
        Sensor(channel="impact_force", noise=0.15, full_scale=2000.0, unit="N", digits=4),
        Sensor(channel="hammer_acceleration", noise=0.05, full_scale=2000.0, unit="m/s^2", digits=4),
    )
    left_out = {"impact_force": not force, "hammer_acceleration": not acceleration}
    return tuple(sensor for sensor in chosen if not left_out.get(sensor.channel, False))
