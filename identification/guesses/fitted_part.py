"""The part of an experiment that is fitted: from the release of the hammer on, and no more samples than time and memory allow."""

import dataclasses
from typing import Any

import numpy as np
from scipy.signal import medfilt

from identification.experiment import MOTION_CHANNELS, Experiment, Record
from identification.experiment.channels import AT_REST
from identification.experiment.clock import MIN_SAMPLES
from identification.experiment.samples import bridged
from identification.experiment.signals import CONTACT

MOST_SAMPLES = 250e3
"""Samples that a fit takes, about: time and memory grow in proportion, standard errors fall with the square root only."""


def from_release(record: Record) -> Record:
    """The record from the release of the hammer on, where it is held, or rests, for a while before.

    The model does not describe the hold, so that stretch is left out, with a notice. Released from rest, the hammer passes a small distance
    d after sqrt(2 d / a) and 4 d after twice that time, so two thresholds a little above the noise give the instant. A record that begins
    with the motion, or in it, is unchanged, and so is one that is neither a drop test nor a free decay.
    """
    begin = 0 if record.kind not in AT_REST else _release(record)
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
    away = np.abs(values - np.median(values[:MIN_SAMPLES]))
    first, second = (np.flatnonzero(away > level * record.noise[name]) for level in (CONTACT, 4.0 * CONTACT))
    if len(first) == 0 or len(second) == 0:
        return 0
    rise = int(second[0] - first[0])
    let_go = int(first[0]) - (rise if name in MOTION_CHANNELS else 0)
    return let_go if let_go >= max(MIN_SAMPLES, 2 * rise) and len(values) - let_go >= MIN_SAMPLES else 0


def in_part(experiment: Experiment, most_samples: float = MOST_SAMPLES) -> tuple[Experiment, tuple[str, ...]]:
    """The experiment with about so many fitted samples at most, and sentences on what is left out.

    Of very many records an even selection of each kind with the same channels is taken, of long records the first part, without gaps, so
    that the decay counts in full; a record that `crop` chooses is taken whole.
    """
    fitted = experiment.fitting.records
    taken = _selected(fitted, most_samples)
    lengths = sorted(len(record.time) for record in taken)
    rest = [most_samples - sum(lengths[:place]) for place in range(len(lengths))]
    shares = [left / (len(lengths) - place) for place, left in enumerate(rest)]
    longest = next((int(share) for share, length in zip(shares, lengths, strict=True) if length > share), max(lengths))

    def cut(record: Record) -> Record:
        if record.preparation.crop is not None or len(record.time) <= longest:
            return record
        used, whole = record.time[longest - 1] - record.time[0], record.time[-1] - record.time[0]
        notice = f"The first {used:.4g} of {whole:.4g} s are fitted; a part that `crop` chooses is taken whole."
        channels = {name: values[:longest] for name, values in record.channels.items()}
        return dataclasses.replace(record, time=record.time[:longest], channels=channels, notices=(*record.notices, notice))

    chosen = {id(record) for record in taken}
    records = tuple(cut(one) for one in experiment.records if one.held_back or id(one) in chosen)
    said = [] if len(taken) == len(fitted) else [f"{len(taken)} of {len(fitted)} records are fitted, spread evenly over each kind"]
    return dataclasses.replace(experiment, records=records), tuple(said)


def _selected(records: tuple[Record, ...], most_samples: float) -> tuple[Record, ...]:
    """Records that are used: all, or an even selection of each kind with the same channels, so that each has room for 2000 samples."""
    most = most_samples / 2000
    if len(records) <= most or sum(len(record.time) for record in records) <= most_samples:
        return records
    alike: dict[tuple[Any, ...], list[int]] = {}
    for index, record in enumerate(records):
        alike.setdefault((record.kind, record.preparation.crop is not None, *sorted(record.channels)), []).append(index)
    chosen = set[int]()
    for (_, cropped, *_), group in alike.items():
        count = len(group) if cropped else max(1, round(most * len(group) / len(records)))
        chosen |= {group[place] for place in np.linspace(0, len(group) - 1, count).round().astype(int)}
    return tuple(records[index] for index in sorted(chosen))
