"""Instant at which a held hammer is released, where a record begins before it."""

import dataclasses

import numpy as np
from scipy.signal import medfilt

from identification.experiment import MOTION_CHANNELS, Record
from identification.experiment.samples import bridged

_KINDS = ("drop-test", "free-decay")
_LEVEL = 6.0
"""Threshold of motion, in standard deviations of the noise."""
_FARTHER = 4.0
"""Second threshold over the first: from rest at constant acceleration the hammer reaches it in twice the time."""
_FEWEST = 16
"""Fewest samples of a hold."""


def from_release(record: Record) -> Record:
    """The record from the release of the hammer on, where it is held, or rests, for a while before.

    The model does not describe the hold, so that stretch is left out, with a notice. Released from rest, the hammer passes a small distance
    d after sqrt(2 d / a) and 4 d after twice that time, so two thresholds a little above the noise give the instant. A record that begins
    with the motion, or in it, is unchanged.

    Args:
        record: of a drop test or a free decay; others are returned unchanged.
    """
    begin = 0 if record.kind not in _KINDS else _release(record)
    if begin == 0:
        return record
    held = record.time[begin] - record.time[0]
    notice = f"The first {held:.4g} s, before the hammer is let go, are left out."
    channels = {name: values[begin:] for name, values in record.channels.items()}
    return dataclasses.replace(record, time=record.time[begin:], channels=channels, notices=(*record.notices, notice))


def _release(record: Record) -> int:
    """First sample after the release; 0 where the record does not begin with a hold."""
    name = next((name for name in (*MOTION_CHANNELS, "hammer_acceleration") if name in record.channels), None)
    if name is None or name not in record.noise:
        return 0
    values = medfilt(bridged(record.time, record.channels[name]), 5)
    away = np.abs(values - np.median(values[:_FEWEST]))
    first, second = (np.flatnonzero(away > level * record.noise[name]) for level in (_LEVEL, _FARTHER * _LEVEL))
    if len(first) == 0 or len(second) == 0:
        return 0
    rise = int(second[0] - first[0])
    let_go = int(first[0]) - (rise if name in MOTION_CHANNELS else 0)
    return let_go if let_go >= max(_FEWEST, 2 * rise) and len(values) - let_go >= _FEWEST else 0
