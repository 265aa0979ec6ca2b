"""Periodogram of the missing force or residual, without harmonics of the drive."""

import numpy as np
from jaxtyping import Float

from identification.likelihood.linearised import Linearised
from identification.windows.prepare import Prepared

_HIGHEST_CYCLES, _HIGHEST_HZ, _OVER_F_N = 1200.0, 400.0, 60.0
"""Highest frequency: the largest of cycles per longest record, hertz, and multiples of f_n."""
_OF_SAMPLING = 0.25
"""Highest frequency over the sampling rate."""
_PADDED = 13.0
"""Zero padding before the Fourier transform, in lengths of the longest record, ..."""
_MOST_SAMPLES = 1 << 22
"""... or at most this many samples."""


def periodogram(
    prepared: Prepared,
    at: Linearised,
    values: Float[np.ndarray, "windows time"],
    weight: Float[np.ndarray, "windows time"],
    *,
    lowest: float,
    apart: float,
    fewest: float = 0.0,
) -> tuple[Float[np.ndarray, " frequencies"], Float[np.ndarray, " frequencies"]]:
    """Decrease of chi-square due to a sinusoid of each frequency, Hz, summed over records; each record omits harmonics of its own drive.

    Amplitude and phase are free in every record.

    Args:
        prepared: windows, and the records that they were cut from.
        at: the fitted model along them.
        values: missing quantity times its weight.
        weight: 1 over its variance.
        lowest: lowest frequency, in cycles per longest record.
        apart: frequency spacing, in cycles per longest record.
        fewest: cycles that a record must hold to contribute.

    Returns:
        Frequencies, none where the records are sampled too slowly for any, and the decrease at each.
    """
    records = prepared.experiment.records
    longest = max(_span(record.time) for record in records)
    sampling = min(float(np.median(np.diff(record.time))) for record in records)
    f_n = float(prepared.model.values().get("f_n", 0.0))
    highest = min(max(_HIGHEST_CYCLES / longest, _HIGHEST_HZ, _OVER_F_N * f_n), _OF_SAMPLING / sampling)
    frequencies = np.arange(lowest / longest, highest, apart / longest)
    power = np.zeros_like(frequencies)
    for index, record in enumerate(records):
        whole, total = (at.of_record(x, index, len(record.time)) for x in (values, weight))
        dt, span = float(np.median(np.diff(record.time))), _span(record.time)
        count = 1 << int(np.ceil(np.log2(max(min(_PADDED * longest / dt, _MOST_SAMPLES), len(whole)))))
        own = 2.0 * np.abs(np.fft.rfft(whole, count)) ** 2 / max(float(total.sum()), 1e-300)
        own = np.interp(frequencies, np.fft.rfftfreq(count, dt), own, right=0.0)
        own = np.where(frequencies * span < fewest, 0.0, own)
        if record.excitation_frequency:
            order = frequencies / record.excitation_frequency
            own = np.where(np.abs(order - np.round(order)) * record.excitation_frequency < 1.0 / span, 0.0, own)
        power += own
    return frequencies, power


def _span(time: Float[np.ndarray, " samples"]) -> float:
    """From the first to the last sample, s."""
    return float(time[-1] - time[0])
