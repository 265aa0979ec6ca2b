"""How late each channel comes against the others, as the records show it without a model."""

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from jaxtyping import Float
from scipy.signal import correlate, correlation_lags, fftconvolve

from identification.experiment import Record
from identification.kinematics import bridged

_DERIVATIVES = {"hammer_displacement": (3, 1.0), "hammer_acceleration": (1, 1.0), "impact_force": (1, -1.0)}
"""How often a channel is to be differentiated to give the hammer's jerk, but for a factor of this sign and what the suspension adds."""
_HALF_WIDTHS = (4, 8, 16, 32)
"""Of the test function, in samples: the wider, the less noise and the less of an impact."""
_LONGEST = 0.02
"""Delay up to which one is sought, s."""
_SHORTEST = 2.0
"""Delay below which the score test tells one as well, samples."""
_CLEARLY = 25.0
"""Drop of chi-square, when the delay is made good, from which it is shown: far more than the best of all delays has by chance."""


def lags(records: Sequence[Record]) -> dict[str, float]:
    """Delay of a channel against every other, s, above zero where it comes late; absent where it agrees with one of them as it stands.

    Displacement, acceleration and impact force of the hammer all hold its jerk, x''': each is convolved with that derivative of a smooth
    test function which makes it so (the weak form, which differentiates the function and not the noise), and the delay between two is where
    their correlation is largest. Of two channels alone it cannot be told which one is off, so that both are given.
    """
    channels = [name for name in _DERIVATIVES if any(name in record.channels for record in records)]
    between = {pair: _delay(records, *pair) for pair in permutations(channels, 2)}
    found = {}
    for late in channels:
        delays = [delay for (one, _), delay in between.items() if one == late and delay is not None]
        if delays and min(map(abs, delays)) > 0.0:
            found[late] = float(np.median(delays))
    return found


def _delay(records: Sequence[Record], late: str, early: str) -> float | None:
    """Of one channel against another, the middle one of all records; 0 where they agree as they stand, None where no record has both."""
    delays = [_of_record(record, late, early) for record in records if late in record.channels and early in record.channels]
    return float(np.median(delays)) if delays else None


def _of_record(record: Record, late: str, early: str) -> float:
    """The same of one record, by the test function with which it is told best."""
    dt = float(np.median(np.diff(record.time)))
    widths = [half for half in _HALF_WIDTHS if 4 * half < len(record.time)]
    found = [_best(_jerk(record, late, half), _jerk(record, early, half), half) for half in widths]
    drop, samples = max(found, default=(0.0, 0))
    return samples * dt if drop > _CLEARLY and abs(samples) > _SHORTEST and abs(samples) * dt <= _LONGEST else 0.0


def _best(late: Float[np.ndarray, " time"], early: Float[np.ndarray, " time"], half: int) -> tuple[float, int]:
    """Drop of chi-square of a regression of one on the other when the best delay is made good, and that delay in samples."""
    size = float(np.sqrt(np.sum(late**2) * np.sum(early**2)))
    if size == 0.0:
        return 0.0, 0
    common = np.maximum(correlate(late, early, method="fft"), 0.0) / size
    left, best = 1.0 - np.minimum(common, 1.0 - 1e-12) ** 2, int(np.argmax(common))
    shifts = correlation_lags(len(late), len(early))
    independent = len(late) / half
    return independent * float(np.log(left[shifts == 0][0] / left[best])), int(shifts[best])


def _jerk(record: Record, channel: str, half: int) -> Float[np.ndarray, " samples"]:
    """The hammer's jerk through a test function, but for a factor, as one channel shows it."""
    order, sign = _DERIVATIVES[channel]
    values = bridged(record.time, record.channels[channel])
    even = np.linspace(record.time[0], record.time[-1], len(record.time))
    bump = np.polynomial.Polynomial([1.0, 0.0, -1.0]) ** 4
    function = bump.deriv(order)(np.linspace(-1.0, 1.0, 2 * half + 1))
    return sign * fftconvolve(np.interp(even, record.time, values - values.mean()), function, mode="valid")
