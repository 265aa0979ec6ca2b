"""Where the nominal model's misfit acts: in which channel, record and phase of the motion, and along which coordinate."""

from collections.abc import Sequence

import numpy as np

from identification.diagnosis.diagnosis import Location, Profile
from identification.diagnosis.free_forms import Form
from identification.diagnosis.scores import Scored, Scores
from identification.result.result import RecordFit
from identification.trajectory.additions import Reestimated
from identification.wording.names import coordinate_label, spoken
from identification.wording.numbers import joined, percent, significant
from vibrojax.effects import AbstractEffect

_MOST = 0.8
"""Share by which a record, a phase or a part of a range counts as the place."""
_OF_TWO = 0.8
"""Weight of a form over a coordinate and the direction of motion: it has to gain a quarter more than one over a single coordinate."""
_SAID = {
    "displacement": "at displacements of {}",
    "velocity": "at velocities of {}",
    "indentation": "at indentations of {}",
    "time": "from {} on the record's clock",
    "reading": "at readings of {}",
}
_PHASES = {"all": "runs through the whole motion", "free flight": "sits in free flight", "contact": "sits in the contacts"}


Weighed = tuple[Scored, Reestimated, float]


def locate(scores: Scores, records: tuple[RecordFit, ...], free: Sequence[Weighed], named: AbstractEffect | None) -> Location:
    """Location of what the nominal model leaves out.

    Args:
        scores: beside the nominal model.
        records: with the predictions of the nominal model.
        free: free forms with all variances estimated anew, and their gains.
        named: asserted effect, whose record and instant replace those found; None where there is none.
    """
    channels, by_record = _shares(records)
    ranked = sorted(free, key=lambda one: -(_OF_TWO if _by_direction(one[0]) else 1.0) * one[2])
    gains = [max(one[2], 0.0) for one in ranked]
    profiles = tuple(
        _profile(scores, scored, weighed, gain / max(max(gains), 1e-300)) for (scored, weighed, _), gain in zip(ranked, gains, strict=True)
    )
    best = profiles[0]
    record = named.record if named is not None else None
    instant = next((float(getattr(named, p.field)) for p in named.parameters if p.name == "instant"), None) if named is not None else None
    form = ranked[0][0].candidate.form
    assert form is not None
    channel = max(channels, key=lambda name: channels[name])
    if named is not None and named.channel in channels:
        channel = named.channel
    elif form.quantity in channels:
        channel = form.quantity
    coordinate, interval = best.coordinate, _interval(best)
    phase = _phase(scores, ranked[0])
    if instant is not None and record is not None:
        last = next(one.time[-1] for one in records if one.file == record)
        coordinate, interval = "time", (instant, float(last))
    found = {
        "channel": channel,
        "channels": channels,
        "records": by_record,
        "phase": phase,
        "coordinate": coordinate,
        "interval": interval,
        "time": instant,
        "record": record,
        "profiles": profiles,
        "maps": {
            one.file: _map(one, read.excitation_frequency or scores.scales.f_n)
            for one, read in zip(records, scores.fitted.problem.experiment.records, strict=True)
        },
    }
    return Location(sentence=_sentence(best, channel, by_record, phase, coordinate, interval, record, instant), **found)


def _shares(records: tuple[RecordFit, ...]) -> tuple[dict[str, float], dict[str, float]]:
    """Share of the squared misfit beyond the noise by channel and by record."""
    channels: dict[str, float] = {}
    by_record: dict[str, float] = {}
    for one in records:
        for name, chi2 in one.chi2_reduced.items():
            excess = max(chi2 - 1.0, 0.0) * one.samples
            channels[name] = channels.get(name, 0.0) + excess
            by_record[one.file] = by_record.get(one.file, 0.0) + excess
    return _normalised(channels), _normalised(by_record)


def _normalised(sums: dict[str, float]) -> dict[str, float]:
    total = sum(sums.values())
    return {name: value / total if total > 0 else 1.0 / len(sums) for name, value in sums.items()}


def _by_direction(scored: Scored) -> bool:
    """Whether a free form tells both directions of the motion apart."""
    form = scored.candidate.form
    return form is not None and form.quantity == "force" and bool((form.columns[:, 1] != 0).any())


def _profile(scores: Scores, scored: Scored, weighed: Reestimated, explained: float) -> Profile:
    """What is missing along a coordinate: the free form's values at its knots, those left out that the records say nothing of.

    Of one over both directions the mean, or half the difference where that is larger: a force that turns with the motion. Of paths in
    several records the mean.
    """
    form = scored.candidate.form
    assert form is not None
    if form.coordinate == "frequency":
        return _line(scores, form, weighed, explained)
    variance = np.diag(weighed.covariance)
    known = (variance > 0.0) | ~variance.any()
    knots, precision = np.unique(form.columns[known, 0]), 1.0 / np.where(known, variance, 1.0)
    shares = np.where((form.columns[:, 0] == knots[:, None]) & known, 1.0 if _by_direction(scored) else precision, 0.0)
    shares /= shares.sum(axis=1, keepdims=True)
    found = []
    for sign in [np.ones(len(known))] + ([np.sign(form.columns[:, 1])] if _by_direction(scored) else []):
        of_columns = shares * sign
        stderr = np.sqrt(np.maximum(np.einsum("kc,cd,kd->k", of_columns, weighed.covariance, of_columns), 1e-300))
        mean = of_columns @ weighed.strengths
        found.append((float(np.sum((mean / stderr) ** 2)), mean, stderr))
    which, (_, mean, stderr) = max(enumerate(found), key=lambda one: one[1][0])
    unit = 1.0 if form.coordinate == "reading" else form.size  # errors of readings are over the noise
    return Profile(
        coordinate=form.coordinate,
        unit=form.unit,
        quantity=form.quantity,
        center=form.knots[knots],
        mean=unit * mean,
        stderr=unit * stderr,
        explained=float(explained),
        turns=which == 1,
    )


def _line(scores: Scores, form: Form, weighed: Reestimated, explained: float) -> Profile:
    """A vibration: spectrum of the smoothed random force, rms over all records, in the size that is estimated at the form's frequency."""
    square = float(weighed.strengths @ weighed.strengths)
    size = form.size * np.sqrt(square / len(weighed.strengths))
    slope = form.size * weighed.strengths / np.sqrt(max(square, 1e-300) * len(weighed.strengths))
    chains, force, hz = scores.fitted.problem.chains, scores.fitted.at.force, float(form.knots[0])
    longest = max(record.time[-1] - record.time[0] for record in scores.fitted.problem.experiment.records)
    beside = 20  # frequencies on either side at which the spectrum is shown, half a period of the longest record apart
    frequencies = hz + np.arange(-beside, beside + 1) / (2.0 * longest)
    power = np.zeros(len(frequencies))
    for index, knots in enumerate(chains.knots):
        time = float(chains.duration[chains.of_record(index)][0]) * np.arange(knots.stop - knots.start)
        window = np.hanning(len(time))
        power += np.abs(np.exp(-2j * np.pi * np.outer(frequencies, time)) @ (window * force[knots]) / window.sum()) ** 2
    shape = np.sqrt(power / max(power[beside], 1e-300))
    kept = frequencies > 0.0
    return Profile(
        coordinate=form.coordinate,
        unit=form.unit,
        quantity=form.quantity,
        center=frequencies[kept],
        mean=size * shape[kept],
        stderr=np.full(int(kept.sum()), np.sqrt(slope @ weighed.covariance @ slope)),
        explained=float(explained),
    )


def _interval(best: Profile) -> tuple[float, float] | None:
    """Smallest range of the coordinate that holds most of the squared quantity, to half height of the outer hats.

    None where that is nearly all of it, or where the quantity is the same all along.
    """
    if best.is_even:
        return None
    square = np.maximum(best.mean**2 - best.stderr**2, 0.0)
    total, count = float(square.sum()), len(square)
    if total <= 0:
        return None
    spans = [
        (last - first, first, last)
        for first in range(count)
        for last in range(first, count)
        if square[first : last + 1].sum() >= _MOST * total
    ]
    width, first, last = min(spans)
    edges = np.concatenate([best.center[:1], 0.5 * (best.center[1:] + best.center[:-1]), best.center[-1:]])
    return None if width >= _MOST * (count - 1) else (float(edges[first]), float(edges[last + 1]))


def _phase(scores: Scores, best: Weighed) -> str:
    """Whether what is missing acts in flight or in contact, by the square of its signal; a place of the stop acts in contact."""
    scored, weighed, _ = best
    form = scored.candidate.form
    assert form is not None
    if form.quantity == "stop":
        return "contact"
    if form.quantity != "force":
        return "contact" if form.quantity == "impact_force" else "all"
    total = np.zeros_like(form.signals[0].force)
    for strength, signal in zip(weighed.strengths, form.signals, strict=True):
        total = total + strength * signal.force
    chains = scores.fitted.problem.chains
    inside = outside = 0.0
    for index, (record, course) in enumerate(zip(scores.fitted.problem.experiment.records, scores.courses, strict=True)):
        values = chains.series(index, total[:, :-1], len(record.time)) ** 2
        touching = np.asarray(course.motion.in_contact)[: len(record.time)]
        inside, outside = inside + float(values[touching].sum()), outside + float(values[~touching].sum())
    share = inside / max(inside + outside, 1e-300)
    return "contact" if share > _MOST else "free flight" if share < 1.0 - _MOST and scores.scales.force > 0 else "all"


def _map(record: RecordFit, hz: float, *, parts: int = 24) -> np.ndarray:
    """Mean squared residual over the noise variance by part of the record (rows) and of the period of drive or suspension (columns)."""
    time = record.time - record.time[0]
    row = np.minimum((time / time[-1] * parts).astype(int), parts - 1)
    column = np.minimum(((time * hz) % 1.0 * parts).astype(int), parts - 1) if hz > 0 else np.zeros(len(time), int)
    total, count = np.zeros((parts, parts)), np.zeros((parts, parts))
    for name in record.chi2_reduced:
        square = ((record.measured[name] - record.predicted[name]) / record.noise[name]) ** 2
        fine = np.isfinite(square)
        np.add.at(total, (row[fine], column[fine]), square[fine])
        np.add.at(count, (row[fine], column[fine]), 1.0)
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)


def _sentence(best: Profile, channel: str, records: dict[str, float], phase: str, coordinate: str, interval, record, instant) -> str:
    """The location in words for a test engineer."""
    if instant is not None and record is not None:
        return f"The misfit starts at {instant:.2f} s of {record}. It {_PHASES[phase]}, seen most in {spoken(channel)}."
    axis = coordinate_label(best.coordinate, best.unit)
    parts = [_PHASES[phase]]
    if best.coordinate == coordinate == "frequency":
        parts.append(f"vibrates at {significant(best.center[np.argmax(best.mean)], 4)} Hz")
    elif interval is not None:
        low, high = (significant(axis.factor * end, 2) for end in interval)
        parts.append("mostly " + _SAID[coordinate].format(f"{low} to {high} {axis.unit}".strip()))
    elif not best.is_even:
        parts.append(f"changes with the {coordinate}")
    if best.quantity == "force":
        way = (" against the motion" if best.average < 0.0 else " along the motion") if best.turns else ""
        rms = best.mean.max() if best.coordinate == "frequency" else best.rms
        size = f"{significant(abs(best.average), 2)} N" if best.is_even else f"{significant(rms, 2)} N rms"
        parts.append(f"with a missing force of {size}{way}")
    elif best.coordinate == "time" and best.quantity != "stop":
        parts.append(f"with a gain that changes by {percent(float(np.ptp(best.mean)), 1.0)}")
    loud = [file for file, share in sorted(records.items(), key=lambda item: -item[1]) if share > 1.0 / len(records)]
    if len(records) > 1:
        even = max(records.values()) < 1.7 / len(records)
        shown = joined([f"{file} ({percent(records[file], 1.0)})" for file in loud[:3]])
        parts.append("in all records" if even else f"most of it in {shown}")
    parts.append(f"seen most in {spoken(channel)}")
    return f"The misfit {', '.join(parts)}."
