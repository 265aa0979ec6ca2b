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
    """A digital filter of first order in the recorder: r_i = a r_(i-1) + (1 - a) s_i with a = exp(-sampling step / time constant)."""

    channel: str
    time_constant: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        kept = np.exp(-(time[1] - time[0]) / self.time_constant)
        return np.asarray(lfilter([1.0 - kept], [1.0, -kept], signal))


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
class ZeroDrift:
    """The zero creeps while the record lasts: signal + size (1 - exp(-t / time constant))."""

    channel: str
    size: float
    time_constant: float

    def distort(self, file: str, time: np.ndarray, signal: np.ndarray) -> np.ndarray:
        return signal - self.size * np.expm1(-np.maximum(time, 0.0) / self.time_constant)


def ceiling(channel: str, faults: Sequence[Fault]) -> float:
    """The highest reading that the channel can give; infinite without a `Clip`."""
    return min((fault.level for fault in faults if isinstance(fault, Clip) and fault.channel == channel), default=np.inf)
