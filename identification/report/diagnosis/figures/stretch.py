"""Which part of a record shows most: the stretch and the channel in which the augmented model gains most on the nominal one."""

import dataclasses

import numpy as np

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.rows import recorded
from identification.result.result import RecordFit, impacts, residual

_PERIODS = 3.0
_FEWEST = 60
"""Samples"""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Stretch:
    """Part of one record, in one channel, beside both models."""

    number: int
    """Of the record in the experiment, from 1."""
    before: RecordFit
    after: RecordFit
    channel: str
    part: slice


def stretches(diagnosis: Diagnosis) -> list[Stretch]:
    """One a record, in the order of the experiment; records without a fitted channel are left out."""
    after = {record.file: record for record in diagnosis.augmented.records}
    pairs = [(number, record, after.get(record.file, record)) for number, record in enumerate(diagnosis.nominal.records, start=1)]
    return [_stretch(diagnosis, *pair) for pair in pairs if pair[1].chi2_reduced]


def _stretch(diagnosis: Diagnosis, number: int, before: RecordFit, after: RecordFit) -> Stretch:
    gains = {}
    for channel in before.chi2_reduced:
        gain = residual(before, channel) ** 2 - (residual(after, channel) ** 2 if diagnosis.is_augmented else 0.0)
        gains[channel] = np.where(np.isfinite(gain), gain, 0.0)
    where = diagnosis.location
    channel = max(gains, key=lambda name: float(gains[name].sum()))
    if where is not None and gains.get(where.channel, np.zeros(1)).sum() > 0.0:
        channel = where.channel
    length = min(_samples(diagnosis, before), len(before.time))
    sums = np.concatenate([[0.0], np.cumsum(gains[channel])])
    first = int(np.argmax(sums[length:] - sums[:-length]))
    if where is not None and where.time is not None and where.record in (None, before.file):
        first = int(np.clip(np.searchsorted(before.time, where.time) - length // 2, 0, len(before.time) - length))
    part = slice(first, first + length)
    if where is not None and where.phase in ("contact", "separation"):
        part = _impact(before, gains[channel], part)
    return Stretch(number=number, before=before, after=after, channel=channel, part=part)


def _impact(record: RecordFit, gain: np.ndarray, part: slice) -> slice:
    """The impact that gains most instead of a longer part, unless what it does shows more clearly after it."""
    around = [impact.around(len(record.time)) for impact in impacts(record)]
    best = max(around, key=lambda one: float(gain[one].sum()), default=part)
    return best if gain[best].mean() >= 0.5 * gain[part].mean() else part


def _samples(diagnosis: Diagnosis, record: RecordFit) -> int:
    """A few periods of the excitation, or of the hammer's own vibration."""
    read = recorded(record, diagnosis.experiment)
    frequency = (read.excitation_frequency if read is not None else None) or float(diagnosis.nominal_model.values().get("f_n", 0.0))
    interval = float(np.median(np.diff(record.time)))
    return max(int(_PERIODS / (frequency * interval)) if frequency > 0 else len(record.time) // 10, _FEWEST)
