"""Beginnings of long records: the part that a diagnosis takes."""

import dataclasses
import math

from identification.experiment import Experiment, Record
from identification.windows.prepare import selected
from identification.windows.release import from_release
from identification.windows.windows import WindowLength


def beginnings(experiment: Experiment, most_samples: float) -> tuple[Experiment, tuple[str, ...]]:
    """The experiment with its long records cut to their first part, so that its fitted records hold about `most_samples` together.

    The part is without gaps and begins where the record does, since what acts with a memory, such as a dent that grows, depends on all that
    went before. All long records are cut to one length, held-back ones to the same; where nothing has to be cut, these are whole, too.
    Of many records some of each kind are taken. Records that their table crops are taken whole.

    Args:
        experiment: as loaded.
        most_samples: of the fitted records, about.

    Returns:
        The experiment, and sentences on what is left out.
    """
    fitted = experiment.fitting.records
    taken = selected(fitted, most_samples, WindowLength())
    free = [len(record.time) for record in taken if record.preparation.crop is None]
    cropped = sum(len(record.time) for record in taken) - sum(free)
    longest = _common_length(free, most_samples - cropped)
    chosen = {id(record) for record in taken}
    whole = [record for record in experiment.records if record.held_back or id(record) in chosen]
    records = tuple(_cut(record, longest) for record in whole)
    said = [] if len(taken) == len(fitted) else [f"{len(taken)} of {len(fitted)} records are diagnosed, spread evenly over each kind"]
    if part := [after.file for before, after in zip(whole, records, strict=True) if len(after.time) < len(before.time)]:
        said.append(f"diagnosed in part, since they are long: {', '.join(part)}; a part that `crop` chooses is taken whole")
    return dataclasses.replace(experiment, records=records), tuple(said)


def _common_length(lengths: list[int], most: float) -> int | None:
    """Length to which each of several is limited so that they come to about `most` together, at least two windows; None if none is."""
    ordered = sorted(lengths)
    left = most
    for place, length in enumerate(ordered):
        share = left / (len(ordered) - place)
        if length > share:
            return max(math.floor(share), 2 * WindowLength().longest)
        left -= length
    return None


def _cut(record: Record, longest: int | None) -> Record:
    """The record, from the release of a held hammer, up to a length."""
    if longest is None or record.preparation.crop is not None or len(record.time) <= longest:
        return record
    record = from_release(record)
    if len(record.time) <= longest:
        return record
    part = slice(longest)
    time = record.time[part]
    used, whole = float(time[-1] - time[0]), float(record.time[-1] - time[0])
    notice = f"The first {used:.4g} of {whole:.4g} s are diagnosed; a part that `crop` chooses is taken whole."
    channels = {name: values[part] for name, values in record.channels.items()}
    return dataclasses.replace(record, time=time, channels=channels, notices=(*record.notices, notice))
