"""Beginnings of long records: the part that a diagnosis takes."""

import dataclasses

from identification.experiment import Experiment, Record
from identification.windows.prepare import selected
from identification.windows.release import from_release
from identification.windows.windows import WindowLength


def beginnings(experiment: Experiment, most_samples: float) -> Experiment:
    """The experiment with its long records cut to their first part, so that its fitted records hold about `most_samples` together.

    The part is without gaps and begins where the record does, since what acts with a memory, such as a dent that grows, depends on all that
    went before. All long records are cut to one length, held-back ones to the same. Of many records some of each kind are taken. Records
    that their table crops are taken whole.

    Args:
        experiment: as loaded.
        most_samples: of the fitted records, about.
    """
    fitted = experiment.fitting.records
    taken = selected(fitted, most_samples, WindowLength())
    free = [len(record.time) for record in taken if record.preparation.crop is None]
    cropped = sum(len(record.time) for record in taken) - sum(free)
    longest = _common_length(free, most_samples - cropped)
    warnings = experiment.warnings
    if len(taken) < len(fitted):
        warnings = (*warnings, f"{len(taken)} of {len(fitted)} records are diagnosed, spread evenly over each kind.")
    chosen = {id(record) for record in taken}
    records = [_cut(record, longest) for record in experiment.records if record.held_back or id(record) in chosen]
    return dataclasses.replace(experiment, records=tuple(records), warnings=warnings)


def _common_length(lengths: list[int], most: float) -> int:
    """Length to which each of several is limited so that they come to about `most` together, at least two windows."""
    ordered = sorted(lengths)
    left = most
    for place, length in enumerate(ordered):
        share = left / (len(ordered) - place)
        if length > share:
            return max(int(share), 2 * WindowLength().longest)
        left -= length
    return max(ordered, default=0)


def _cut(record: Record, longest: int) -> Record:
    """The record, from the release of a held hammer, up to a length."""
    if record.preparation.crop is not None or len(record.time) <= longest:
        return record
    record = from_release(record)
    if len(record.time) <= longest:
        return record
    used, whole = (float(time - record.time[0]) for time in record.time[[longest - 1, -1]])
    notice = f"The first {used:.4g} of {whole:.4g} s are diagnosed; a part that `crop` chooses is taken whole."
    channels = {name: values[:longest] for name, values in record.channels.items()}
    return dataclasses.replace(record, time=record.time[:longest], channels=channels, notices=(*record.notices, notice))
