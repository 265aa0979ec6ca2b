"""Fewer samples where a free motion was recorded far more often than it changes.

An autoregression of a few samples cannot hold an error that lasts for hundreds of them. Where all that a record shows above the floor of
its noise is slow, local parabolas over 2 q + 1 samples, read at every q-th one, keep what it says.

Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70-73 (spectrum); A. Savitzky, M. J. E. Golay, Anal. Chem. 36 (1964)
1627-1639 (local parabolas).
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter, welch

from identification.experiment import Record
from identification.trajectory.segments import at_ceiling


def thinned(records: Sequence[Record]) -> list[Record]:
    """Records of a motion without impacts, averaged and with every q-th sample, where all of them allow it; as they are otherwise.

    A measured input stays as it is: what an average takes from it drives the model no longer.
    """
    q = min((_factor(record) for record in records), default=1)
    return [_every(record, q) if q > 1 else record for record in records]


def _factor(record: Record) -> int:
    """By how much one record can be thinned."""
    steps, measured_input = np.diff(record.time), record.kind in ("forced", "prescribed") or record.base == "measured"
    if measured_input or len(steps) < 64 or np.ptp(steps) > 0.1 * np.median(steps):
        return 1
    rate, needed = 1.0 / float(np.median(steps)), 0.0
    for values in record.channels.values():
        if not np.all(np.isfinite(values)) or at_ceiling(values).any():
            return 1
        hz, power = welch(values - values.mean(), rate, nperseg=min(16384, len(values) // 4))
        floor = float(np.median(power[hz > 0.25 * rate]))
        highest = float(hz[power > 4.0 * floor].max(initial=0.0))  # that holds more than noise
        needed = max(needed, 2.5 * highest, 100.0 * float(hz[np.argmax(power)]))  # Nyquist with a margin; a period's samples
    return int(rate / needed) if 0.0 < needed < rate else 1


def _every(record: Record, q: int) -> Record:
    """The record by local parabolas, read at every q-th sample."""
    window, degree = 2 * q + 1, 2
    scatter = float(np.linalg.norm(savgol_coeffs(window, degree)))
    channels = {name: savgol_filter(values, window, degree, mode="interp")[::q] for name, values in record.channels.items()}
    notice = f"Nothing but noise is faster than 1/{q} of the sampling rate: {window} samples each are averaged by a parabola."
    return dataclasses.replace(
        record,
        time=record.time[::q],
        channels=channels,
        noise={name: scatter * value for name, value in record.noise.items()},
        notices=(*record.notices, notice),
    )
