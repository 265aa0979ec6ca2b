"""What a channel can do to a true signal before noise and converter; a fault is any object with `channel` and `distort`."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter


class Fault(Protocol):
    """One thing that is wrong with one channel."""

    @property
    def channel(self) -> str:
        """Which channel it is."""
        ...

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        """What the channel makes of `signal` in the record `file`; `time` counts from the record's first sample and begins before it."""
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class Gain:
    """The calibration factor is wrong: factor * signal."""

    channel: str
    factor: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return self.factor * signal


@dataclasses.dataclass(frozen=True, kw_only=True)
class Delay:
    """The channel is late: signal(t - delay), by cubic splines; before the motion began all stood still."""

    channel: str
    delay: float
    """s; negative for a channel that is early."""

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return CubicSpline(time, signal)(np.clip(time - self.delay, time[0], time[-1]))


@dataclasses.dataclass(frozen=True, kw_only=True)
class LowPass:
    """A digital filter of first order in the recorder: r_i = a r_(i-1) + (1 - a) s_i with a = exp(-sampling step / time constant).

    It has settled on the first value when the motion begins.
    """

    channel: str
    time_constant: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        kept = np.exp(-(time[1] - time[0]) / self.time_constant)
        return lfilter([1.0 - kept], [1.0, -kept], signal, zi=[kept * signal[0]])[0]


@dataclasses.dataclass(frozen=True, kw_only=True)
class HighPass:
    """The sensor discharges: r_i = a (r_(i-1) + s_i - s_(i-1)) with a = exp(-sampling step / time constant).

    It has been reset on the first value when the motion begins, and shows that.
    """

    channel: str
    time_constant: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        kept = np.exp(-(time[1] - time[0]) / self.time_constant)
        return lfilter([kept, -kept], [1.0, -kept], signal, zi=[(1.0 - kept) * signal[0]])[0]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Curve:
    """The characteristic is curved: signal + quadratic signal^2 + cubic signal^3."""

    channel: str
    quadratic: float
    cubic: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return np.polyval([self.cubic, self.quadratic, 1.0, 0.0], signal)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ClockRate:
    """The channel's clock runs slow: signal(t (1 - ppm 1e-6)), by cubic splines; it agrees with the others at the record's first sample."""

    channel: str
    ppm: float
    """Parts in a million; negative for a clock that runs fast."""

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return CubicSpline(time, signal)(np.clip(time * (1.0 - 1e-6 * self.ppm), time[0], time[-1]))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Clip:
    """The converter's input saturates: min(signal + noise, level). It comes after the noise, so `ceiling` does it, not `distort`."""

    channel: str
    level: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return signal


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hum:
    """A line of the mains: signal + amplitude sin(2 pi frequency t + phase), its phase another in each record."""

    channel: str
    amplitude: float
    frequency: float
    """Hz"""
    phases: Mapping[str, float]

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return signal + self.amplitude * np.sin(2.0 * np.pi * self.frequency * time + self.phases[file])


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tone:
    """A tone that may die away: signal + amplitude exp(-decay t) sin(2 pi frequency t + phase), its phase another in each record."""

    channel: str
    amplitude: float
    frequency: float
    """Hz"""
    decay: float
    """1/s; 0 for a steady tone."""
    phases: Mapping[str, float]

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        turn = np.exp((2j * np.pi * self.frequency - self.decay) * time + 1j * self.phases[file])
        return signal + self.amplitude * np.imag(turn)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ZeroDrift:
    """The zero creeps while the record lasts: signal + size (1 - exp(-t / time constant))."""

    channel: str
    size: float
    time_constant: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return signal - self.size * np.expm1(-np.maximum(time, 0.0) / self.time_constant)


@dataclasses.dataclass(frozen=True, kw_only=True)
class GainDrift:
    """The calibration factor creeps while the record lasts: signal (1 + rate t)."""

    channel: str
    rate: float
    """1/s"""

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return signal * (1.0 + self.rate * np.maximum(time, 0.0))


def ceiling(channel: str, faults: Sequence[Fault]) -> float:
    """The highest reading that the channel can give; infinite without a `Clip`."""
    return min((fault.level for fault in faults if isinstance(fault, Clip) and fault.channel == channel), default=np.inf)
