"""What of an experiment is fitted where it holds more samples than time and memory allow."""

import dataclasses
from typing import Any

import numpy as np

from identification.experiment import Experiment, Record

MOST_SAMPLES = 250e3
"""Samples that a fit takes, about: time and memory grow in proportion, standard errors fall with the square root only."""
_OF_A_RECORD = 2000
"""Samples of a record, for which there has to be room: of more records than that allows, a part is taken."""


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
    """Records that are used: all, or an even selection of each kind with the same channels."""
    most = most_samples / _OF_A_RECORD
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
