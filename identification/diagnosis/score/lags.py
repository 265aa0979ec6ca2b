"""How late each channel comes against the others, as the records show it without a model."""

import dataclasses
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.signal import correlate, correlation_lags, fftconvolve

from identification.experiment import Record
from identification.windows.kinematics import bridged

_DERIVATIVES = {"hammer_displacement": (3, 1.0), "hammer_acceleration": (1, 1.0), "impact_force": (1, -1.0)}
"""How often a channel is to be differentiated to give the hammer's jerk, but for a factor of this sign and what the suspension adds."""
_NARROWEST, _WIDEST = 4, 32
"""Half widths of the test function, in samples, that are tried at least: the wider, the less noise and the less of an impact."""
_LONGEST = 0.02
"""Delay up to which one is sought, and half width up to which more are tried, s."""
_SHORTEST, _OF_WIDTH = 2.0, 0.1
"""Delay up to which the score test tells one as well: samples, and share of the least half width that shows it clearly, as wider test
functions also hold what the suspension does."""
_CLEARLY = 25.0
"""Drop of chi-square from which something is shown: far more than the best of all delays has by chance, of white noise."""
_ALIKE = 0.25
"""Of the middle one, by which delays may differ that agree; or `_SHORTEST`."""
_PAUSES = 4
"""Time that a record spans over that of its samples, from which it is not looked at."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Look:
    """One record: by channel the hammer's jerk, but for a factor, through one test function after the other."""

    dt: float
    """Sampling interval, s."""
    half_widths: tuple[int, ...]
    """Of the test functions, in samples."""
    jerks: dict[str, list[np.ndarray]]


def lags(records: Sequence[Record]) -> dict[str, float]:
    """Delay of a channel against every other, s, above zero where it comes late; absent where it agrees with one of them as it stands.

    Displacement, acceleration and impact force of the hammer all hold its jerk, x''': each is convolved with that derivative of a smooth
    test function which makes it so (the weak form, which differentiates the function and not the noise), and the delay between two is where
    their correlation is largest. Of two channels alone it cannot be told which one is off, so that both are given. Absent too where most
    records, or the other channels, do not agree on one delay.
    """
    looks = [_look(record) for record in records if record.kind != "prescribed"]
    against: dict[str, list[float]] = {name: [] for name in _DERIVATIVES}
    for late, early in combinations(_DERIVATIVES, 2):
        told = [_delay(look, late, early) for look in looks if late in look.jerks and early in look.jerks]
        if informed := [delay for delay in told if delay is not None]:
            delay = _agreed(informed, looks)
            against[late].append(delay)
            against[early].append(-delay)
    agreed = {name: _agreed(delays, looks) for name, delays in against.items() if delays and all(delays)}
    return {name: delay for name, delay in agreed.items() if delay}


def _agreed(delays: list[float], looks: list[_Look]) -> float:
    """The middle one, if most are near it; else 0."""
    middle = float(np.median(delays))
    near = np.abs(np.array(delays) - middle) <= max(_ALIKE * abs(middle), _SHORTEST * max(look.dt for look in looks))
    return middle if near.sum() > 0.5 * len(delays) else 0.0


def _delay(look: _Look, late: str, early: str) -> float | None:
    """Of one channel against another; 0 where they agree as they stand, None where they show nothing in common."""
    tried = zip(look.jerks[late], look.jerks[early], look.half_widths, strict=True)
    found = [(half, *_best(one, other, half)) for one, other, half in tried]
    _, common, drop, samples = max(found, key=lambda one: one[1], default=(0, 0.0, 0.0, 0))
    if common < _CLEARLY:
        return None
    alike = max(_ALIKE * abs(samples), _SHORTEST)
    narrowest = min((half for half, _, by_delay, other in found if by_delay > _CLEARLY and abs(other - samples) <= alike), default=0)
    is_long = max(_SHORTEST, _OF_WIDTH * narrowest) < abs(samples) <= _LONGEST / look.dt
    return samples * look.dt if is_long and drop > _CLEARLY else 0.0


def _best(late: Float[np.ndarray, " time"], early: Float[np.ndarray, " time"], half: int) -> tuple[float, float, int]:
    """Drop of chi-square when one is regressed on the other at the best delay, how much of it the delay makes, and the delay in samples."""
    size = float(np.sqrt(np.sum(late**2) * np.sum(early**2)))
    if size == 0.0:
        return 0.0, 0.0, 0
    common = np.clip(correlate(late, early, method="fft") / size, 0.0, 1.0 - 1e-12)
    shifts, best = correlation_lags(len(late), len(early)), int(np.argmax(common))
    drops = -len(late) / half * np.log(1.0 - common[[best, int(np.flatnonzero(shifts == 0)[0])]] ** 2)
    return float(drops[0]), float(drops[0] - drops[1]), int(shifts[best])


def _look(record: Record) -> _Look:
    """Channels of a record, evenly sampled and differentiated; none where it pauses for long."""
    dt, span = float(np.median(np.diff(record.time))), float(record.time[-1] - record.time[0])
    if span > _PAUSES * dt * len(record.time):
        return _Look(dt=dt, half_widths=(), jerks={})
    even = record.time[0] + dt * np.arange(int(span / dt) + 1)
    widest = min(max(_WIDEST, int(_LONGEST / dt)), (len(even) - 1) // 4)
    half_widths, jerks = tuple(_NARROWEST * 2**octave for octave in range((max(widest, 1) // _NARROWEST).bit_length())), {}
    for name in record.channels.keys() & _DERIVATIVES.keys():
        order, sign = _DERIVATIVES[name]
        values = bridged(record.time, record.channels[name])
        shown = np.interp(even, record.time, values - values.mean())
        jerks[name] = [sign * fftconvolve(shown, _test_function(half, order), mode="valid") for half in half_widths]
    return _Look(dt=dt, half_widths=half_widths, jerks=jerks)


def _test_function(half: int, order: int) -> Float[np.ndarray, " samples"]:
    """First or third differences of a smooth bump, both of one length: blind to all polynomials of a lower degree."""
    bump = (1.0 - np.linspace(-1.0, 1.0, 2 * half + 1) ** 2) ** 4
    return np.diff(np.pad(bump, (order + 3) // 2), order)
