"""Delays between channels, estimated from the records without a model."""

import dataclasses
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.signal import correlate, correlation_lags, fftconvolve

from identification.experiment import Record
from identification.experiment.samples import bridged
from identification.trajectory.segments import Lateness

_DERIVATIVES = {"hammer_displacement": (3, 1.0), "hammer_acceleration": (1, 1.0), "impact_force": (1, -1.0)}
"""Order of differentiation that turns a channel into the hammer's jerk, and sign of the factor; the suspension's part is neglected."""
_NARROWEST, _WIDEST = 4, 32
"""Half widths of the test function, in samples, at least from and to: a wider one reduces noise and smooths the impact more."""
LONGEST = 0.02
"""Longest delay that is detected, and largest half width, s."""
_SHORTEST, _OF_WIDTH = 2.0, 0.1
"""Delay up to which the score test applies instead: in samples, and over the smallest half width that shows it; wider test functions also
contain the suspension's motion.
"""
_CLEARLY = 25.0
"""Decrease of chi-square above which a delay is significant, far above the maximum over all delays of white noise."""
_ALIKE = 0.25
"""Relative tolerance within which delays agree, at least `_SHORTEST` samples."""
_PAUSES = 4
"""Duration of a record over that of its samples above which the record is skipped, for its pauses."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Jerks:
    """Jerk of one record up to a factor, by channel and by width of the test function."""

    dt: float
    """Sampling interval, s."""
    half_widths: tuple[int, ...]
    """Of the test functions, in samples."""
    by_channel: dict[str, list[np.ndarray]]


def lags(records: Sequence[Record]) -> dict[str, float]:
    """Delay of each channel against the others, s, positive where it is late; a channel without a delay, or without agreement, is absent.

    Displacement, acceleration and impact force of the hammer all contain its jerk, x'''. Each is convolved with the derivative of a smooth
    test function that yields the jerk (weak form: it differentiates the function, not the noise). The delay of two channels is where their
    correlation is largest. Two channels alone do not identify the late one, so that both get the delay. A channel is absent where it agrees
    with another without delay, and where most records, or the other channels, do not agree on one delay.
    """
    of_records = [_jerks(record) for record in records if record.kind != "prescribed"]
    against: dict[str, list[float]] = {name: [] for name in _DERIVATIVES}
    for late, early in combinations(_DERIVATIVES, 2):
        found = [_delay(jerks, late, early) for jerks in of_records if late in jerks.by_channel and early in jerks.by_channel]
        if informed := [delay for delay in found if delay is not None]:
            delay = _agreed(informed, of_records)
            against[late].append(delay)
            against[early].append(-delay)
    agreed = {name: _agreed(delays, of_records) for name, delays in against.items() if delays and all(delays)}
    return {name: delay for name, delay in agreed.items() if delay}


def misalignment(records: Sequence[Record], channel: str) -> Callable[[Lateness], float]:
    """Function of a lateness: how little a channel, moved back by it, has in common with the others of the hammer; the lower the better.

    Minus the decrease of chi-square by regression of its jerk on theirs, over all widths of the test functions, as in `lags`; a jerk is as
    smooth as these, and compared at a quarter of their half width. Beyond the ends of a record nothing is known of it.

    Args:
        records: those that hold the channel and another one of the hammer count.
        channel: for which `lags` has a delay.
    """
    found = [(record.time[0], _jerks(record)) for record in records if record.kind != "prescribed" and channel in record.channels]

    def of(lateness: Lateness) -> float:
        total = 0.0
        for begin, jerks in found:
            for place, half in enumerate(jerks.half_widths):
                own, some = jerks.by_channel[channel][place], slice(None, None, max(half // 4, 1))
                t = begin + jerks.dt * (half + np.arange(len(own)))
                moved = np.interp(t[some] + lateness(t[some]), t, own, left=0.0, right=0.0)
                for other in _DERIVATIVES:
                    if other == channel or other not in jerks.by_channel:
                        continue
                    theirs = jerks.by_channel[other][place][some]
                    size = float(np.sqrt(np.sum(moved**2) * np.sum(theirs**2)))
                    common = float(np.clip(moved @ theirs / size, 0.0, 1.0 - 1e-12)) if size else 0.0
                    total += len(own) / half * np.log(1.0 - common**2)
        return total

    return of


def _agreed(delays: list[float], of_records: list[_Jerks]) -> float:
    """Median delay if most delays are near it; else 0."""
    middle = float(np.median(delays))
    near = np.abs(np.array(delays) - middle) <= max(_ALIKE * abs(middle), _SHORTEST * max(jerks.dt for jerks in of_records))
    return middle if near.sum() > 0.5 * len(delays) else 0.0


def _delay(jerks: _Jerks, late: str, early: str) -> float | None:
    """Delay of one channel against another, s; 0 where it is not significant, None where the channels are not correlated."""
    pairs = zip(jerks.by_channel[late], jerks.by_channel[early], jerks.half_widths, strict=True)
    found = [(half, *_best(one, other, half)) for one, other, half in pairs]
    _, common, drop, samples = max(found, key=lambda one: one[1], default=(0, 0.0, 0.0, 0))
    if common < _CLEARLY:
        return None
    alike = max(_ALIKE * abs(samples), _SHORTEST)
    narrowest = min((half for half, _, by_delay, other in found if by_delay > _CLEARLY and abs(other - samples) <= alike), default=0)
    is_long = max(_SHORTEST, _OF_WIDTH * narrowest) < abs(samples) <= LONGEST / jerks.dt
    return samples * jerks.dt if is_long and drop > _CLEARLY else 0.0


def _best(late: Float[np.ndarray, " time"], early: Float[np.ndarray, " time"], half: int) -> tuple[float, float, int]:
    """Decrease of chi-square by regression at the best delay, the part of it due to the delay, and the delay in samples."""
    size = float(np.sqrt(np.sum(late**2) * np.sum(early**2)))
    if size == 0.0:
        return 0.0, 0.0, 0
    common = np.clip(correlate(late, early, method="fft") / size, 0.0, 1.0 - 1e-12)
    shifts, best = correlation_lags(len(late), len(early)), int(np.argmax(common))
    drops = -len(late) / half * np.log(1.0 - common[[best, int(np.flatnonzero(shifts == 0)[0])]] ** 2)
    return float(drops[0]), float(drops[0] - drops[1]), int(shifts[best])


def _jerks(record: Record) -> _Jerks:
    """Resampled, differentiated channels of a record; none where the record pauses for long."""
    dt, span = float(np.median(np.diff(record.time))), float(record.time[-1] - record.time[0])
    if span > _PAUSES * dt * len(record.time):
        return _Jerks(dt=dt, half_widths=(), by_channel={})
    even = record.time[0] + dt * np.arange(int(span / dt) + 1)
    widest = min(max(_WIDEST, int(LONGEST / dt)), (len(even) - 1) // 4)
    half_widths, jerks = tuple(_NARROWEST * 2**octave for octave in range((max(widest, 1) // _NARROWEST).bit_length())), {}
    for name in record.channels.keys() & _DERIVATIVES.keys():
        order, sign = _DERIVATIVES[name]
        values = bridged(record.time, record.channels[name])
        shown = np.interp(even, record.time, values - values.mean())
        jerks[name] = [sign * fftconvolve(shown, _test_function(half, order), mode="valid") for half in half_widths]
    return _Jerks(dt=dt, half_widths=half_widths, by_channel=jerks)


def _test_function(half: int, order: int) -> Float[np.ndarray, " samples"]:
    """First or third differences of a smooth bump, of equal length: orthogonal to all polynomials of lower degree."""
    bump = (1.0 - np.linspace(-1.0, 1.0, 2 * half + 1) ** 2) ** 4
    return np.diff(np.pad(bump, (order + 3) // 2), order)
