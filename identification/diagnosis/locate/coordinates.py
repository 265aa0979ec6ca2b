"""Coordinates of the motion against which a misfit is profiled, and the cross-validated share that each explains."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float

from identification.diagnosis.diagnosis import Profile
from identification.diagnosis.score.periodogram import periodogram
from identification.likelihood.linearised import Linearised
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared

BINS = 24
"""Number of bins of a profile, equally full."""
_TRUST = 20.0
"""Shrinkage of every predicting bin mean towards zero: weight of this many samples of median weight."""
_QUIET = 0.02
"""Share of the excess below which a record does not enter `gathered`."""
_FEWEST_CYCLES, _LINES_APART = 3.0, 0.3
"""Fewest cycles of a spectral line in a record; frequency spacing, in cycles per longest record."""
_OF_WINDOWS = 0.02
"""Relative distance from a harmonic of the window rate within which a line may be an artefact of the windows."""
_SEVERAL, _BESIDE = 3.0, 1.5
"""Periods of f_n per window above which misfit of the vibration appears as lines beside f_n; their distance from f_n, in window rates."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Missing:
    """Unexplained force, or unexplained residual of one channel, sample by sample.

    Attributes:
        quantity: "force" or the name of a channel.
        value, stderr: N, or units of the noise; (windows, time), infinite `stderr` where nothing is known.
        share: (windows,) weight of each window; `stderr` includes it.
    """

    quantity: str
    value: np.ndarray
    stderr: np.ndarray
    share: np.ndarray

    @property
    def known(self) -> Bool[np.ndarray, "windows time"]:
        """Samples with a finite standard error."""
        return np.isfinite(self.stderr)

    @property
    def weight(self) -> Float[np.ndarray, "windows time"]:
        """1 / variance."""
        return np.where(self.known, 1.0 / np.where(self.known, self.stderr, 1.0) ** 2, 0.0)

    @property
    def excess(self) -> Float[np.ndarray, "windows time"]:
        """Squared value over its variance, less the expectation 1 of pure noise."""
        return np.where(self.known, self.value**2 * self.weight - self.share[:, None], 0.0)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Coordinate:
    """One coordinate along the fitted motion; values (windows, time), SI, NaN where it has no meaning."""

    name: str
    unit: str
    value: np.ndarray
    by_record: bool = False
    """Whether each record has a profile of its own, as for time: records share no clock."""
    turn: np.ndarray | None = None
    """Excitation phase, rad, where a drifting drive may cause the misfit: each bin then also holds a sine of that phase."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Impacts:
    """Times since and until contact, and approach speed, along every window; (windows, time), NaN before the first contact."""

    since_touch: np.ndarray
    since_release: np.ndarray
    until_release: np.ndarray
    """Until the end of the present or next contact; NaN after the last."""
    speed: np.ndarray
    """Approach speed of the last contact, m/s."""
    contact_time: float
    """Median duration of a contact, s; 0 without contacts."""


def impacts(prepared: Prepared, at: Linearised) -> Impacts:
    """Contact times and speeds from the modelled contacts of every record."""
    names = ("since_touch", "since_release", "until_release", "speed")
    whole, durations = {name: np.full_like(at.ts, np.nan) for name in names}, []
    for index, record in enumerate(prepared.experiment.records):
        contact = at.of_record(at.in_contact, index, len(record.time))
        v, edge = at.of_record(at.v, index, len(record.time)), np.diff(contact.astype(int), prepend=int(contact[0]))
        touches, releases = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
        samples, time = np.arange(len(contact)), record.time
        last = np.searchsorted(touches, samples, side="right") - 1
        left = np.searchsorted(releases, samples, side="right") - 1
        coming = np.searchsorted(releases, samples, side="left")
        found = dict.fromkeys(names, np.full(len(contact), np.nan))
        if len(touches):
            found["since_touch"] = np.where(last >= 0, time - time[touches[last]], np.nan)
            found["speed"] = np.where(last >= 0, np.abs(v[np.maximum(touches[last] - 1, 0)]), np.nan)
        if len(releases):
            found["since_release"] = np.where(left >= 0, time - time[releases[left]], np.nan)
            found["until_release"] = np.where(coming < len(releases), time[releases[np.minimum(coming, len(releases) - 1)]] - time, np.nan)
        for touch in touches:
            ends = releases[releases > touch]
            durations += [time[ends[0]] - time[touch]] if len(ends) else []
        for name, values in found.items():
            windows, along = at.in_windows(values, index)
            whole[name][windows] = along
    return Impacts(**whole, contact_time=float(np.median(durations)) if durations else 0.0)


def coordinates(
    prepared: Prepared, at: Linearised, estimate: Estimate, hits: Impacts, near_stop: np.ndarray, *, drifting: bool
) -> tuple[Coordinate, ...]:
    """All coordinates; `near_stop` (windows, time) marks where the indentation has a meaning, `drifting` whether the drive may drift."""
    records = prepared.experiment.records
    frequency = np.array([record.excitation_frequency or np.nan for record in records])[at.record, None]
    gap = np.array([record.gap for record in records])[at.record, None] + estimate.nuisances[at.record, 2, None]
    phase = np.mod(2 * np.pi * frequency * at.ts + estimate.nuisances[at.record, 1, None], 2 * np.pi)
    return (
        Coordinate(name="displacement", unit="m", value=at.u),
        Coordinate(name="velocity", unit="m/s", value=at.v),
        Coordinate(name="indentation", unit="m", value=np.where(near_stop, at.u - gap, np.nan)),
        Coordinate(name="impact speed", unit="m/s", value=hits.speed),
        Coordinate(name="time since impact", unit="s", value=hits.since_touch),
        Coordinate(name="excitation phase", unit="rad", value=phase),
        Coordinate(name="time", unit="s", value=at.ts, by_record=True, turn=phase if drifting else None),
    )


def profile(
    prepared: Prepared, at: Linearised, missing: Missing, region: Bool[np.ndarray, "windows time"], coordinate: Coordinate
) -> Profile:
    """Bin means of the missing quantity against a coordinate, with the share of its excess that they predict out of sample.

    Bins are equally full. Standard errors come from the scatter between windows.
    """
    use = region & missing.known & np.isfinite(coordinate.value)
    weight = np.where(use, missing.weight, 0.0)
    bins = _bins(coordinate.value, use)
    shown = use & (at.record == _loudest(at, missing, region))[:, None] if coordinate.by_record else use
    center, mean, stderr = [], [], []
    for one in range(bins.max() + 1):
        chosen = shown & (bins == one)
        if not chosen.any():
            continue
        share = np.where(chosen, weight, 0.0)
        total = share.sum()
        average = float((share * missing.value).sum() / total)
        center.append(float(np.median(coordinate.value[chosen])))
        mean.append(average)
        stderr.append(float(np.sqrt(np.sum((share * (missing.value - average)).sum(axis=1) ** 2)) / total))
    return Profile(
        coordinate=coordinate.name,
        unit=coordinate.unit,
        quantity=missing.quantity,
        center=np.array(center),
        mean=np.array(mean),
        stderr=np.array(stderr),
        explained=_explained(prepared, at, missing, region, coordinate),
    )


def _explained(prepared: Prepared, at: Linearised, missing: Missing, region: np.ndarray, coordinate: Coordinate) -> float:
    """Share of a region's excess that bin means predict in left-out records; or periods, for profiles by record and for few records."""
    use = region & missing.known & np.isfinite(coordinate.value)
    total = float(np.sum(missing.excess[region]))
    if total <= 0 or not use.any():
        return 0.0
    labels, folds = _labels(prepared, at, coordinate, _bins(coordinate.value, use))
    predicted = _left_out(missing, missing.value, labels, folds, use)
    if coordinate.turn is not None:
        for wave in (np.cos(np.nan_to_num(coordinate.turn)), np.sin(np.nan_to_num(coordinate.turn))):
            predicted = predicted + 2.0 * wave * _left_out(missing, wave * missing.value, labels, folds, use)
    gain = float(np.sum(np.where(use, missing.weight, 0.0) * (missing.value**2 - (missing.value - predicted) ** 2)))
    return float(np.clip(gain / total, 0.0, 1.0))


def _labels(prepared: Prepared, at: Linearised, coordinate: Coordinate, bins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bin label of every sample, and its cross-validation fold: its record, or one half of the excitation periods."""
    records = np.broadcast_to(at.record[:, None], bins.shape)
    if coordinate.by_record:
        return bins + BINS * records, _parities(prepared, at)
    return bins, records if len(np.unique(at.record)) > 2 else _parities(prepared, at)


def gathered(
    prepared: Prepared, at: Linearised, missing: Missing, region: Bool[np.ndarray, "windows time"], coordinate: Coordinate
) -> float:
    """Unevenness of a region's excess along a coordinate: 1 - (mean density)^2 / mean (density^2), cross-validated as in `_explained`.

    It detects a misfit that changes sign from impact to impact, whose mean vanishes. Densities are relative to each record's mean, except
    along time.
    """
    use = region & missing.known & np.isfinite(coordinate.value)
    labels, folds = _labels(prepared, at, coordinate, _bins(coordinate.value, use))
    count, excess = (_by_record(at, x) for x in (region & missing.known, np.where(region, missing.excess, 0.0)))
    usual = np.full(len(count), excess.sum() / max(count.sum(), 1)) if coordinate.by_record else excess / np.maximum(count, 1)
    loud = (usual > 0) & (excess > _QUIET * excess.sum())
    use = use & (loud[at.record][:, None] | coordinate.by_record)
    if not use.any() or (usual[at.record] <= 0).all():
        return 0.0
    density = missing.excess / np.where(usual > 0, usual, 1.0)[at.record, None]
    size = int(labels[use].max()) + 1
    joint = (labels + size * folds)[use]
    held = (int(folds[use].max()) + 1) * size
    samples = np.bincount(joint, minlength=held).reshape(-1, size)
    sums = np.bincount(joint, weights=density[use], minlength=held).reshape(-1, size)
    elsewhere, there = sums.sum(axis=0) - sums, samples.sum(axis=0) - samples
    both = (samples > 0) & (there > 0)
    product = np.sum(np.where(both, sums * elsewhere / np.maximum(there, 1), 0.0)) / max(samples[both].sum(), 1)
    return float(1.0 - 1.0 / product) if product > 1.0 else 0.0


def _by_record(at: Linearised, values: np.ndarray) -> np.ndarray:
    """Sum over the samples of every record, (records,)."""
    return np.bincount(at.record, weights=values.sum(axis=1).astype(float))


def _left_out(missing: Missing, values: np.ndarray, labels: np.ndarray, folds: np.ndarray, use: np.ndarray) -> np.ndarray:
    """Mean of each sample's bin over all other folds, shrunk towards zero."""
    weight = np.where(use, missing.weight, 0.0)
    labels, count = np.where(use, labels, 0), int(labels[use].max()) + 1
    joint = labels + count * np.where(use, folds, 0)
    size = count * (int(folds[use].max()) + 1)
    sums = [np.bincount(joint[use], weights=w[use], minlength=size).reshape(-1, count) for w in (weight, weight * values)]
    others = [(s.sum(axis=0) - s) for s in sums]
    trust = _TRUST * float(np.median(weight[use]))
    return (others[1] / (others[0] + trust)).reshape(-1)[joint]


def _bins(values: np.ndarray, use: np.ndarray) -> np.ndarray:
    """Index of every sample's bin; bins are equally full over the samples in use."""
    if not use.any():
        return np.zeros(values.shape, int)
    edges = np.unique(np.quantile(values[use], np.linspace(0.0, 1.0, BINS + 1)[1:-1]))
    return np.digitize(np.nan_to_num(values), edges)


def _loudest(at: Linearised, missing: Missing, region: np.ndarray) -> int:
    """Index of the record with the largest excess."""
    return int(np.argmax(_by_record(at, np.where(region, missing.excess, 0.0))))


def _parities(prepared: Prepared, at: Linearised) -> np.ndarray:
    """Cross-validation fold of every sample: the aperiodic Thue-Morse sequence over excitation periods (windows if undriven)."""
    frequency = np.array([record.excitation_frequency or 0.0 for record in prepared.experiment.records])[at.record, None]
    own = np.broadcast_to(np.arange(len(at.record))[:, None], at.ts.shape)
    period = np.where(frequency > 0, np.floor(frequency * (at.ts - at.ts.min())), own).astype(np.int64)
    return np.bitwise_count(period).astype(np.int64) % 2


def line(prepared: Prepared, at: Linearised, missing: Missing, region: Bool[np.ndarray, "windows time"]) -> tuple[float, float]:
    """Strongest spectral line besides harmonics of the drive, Hz, and its share of the excess; phases are free in each record."""
    total = float(np.sum(missing.excess[region]))
    if total <= 0:
        return 0.0, 0.0
    weight = np.where(region, missing.weight, 0.0)
    frequencies, power = periodogram(
        prepared, at, weight * missing.value, weight, lowest=_FEWEST_CYCLES, apart=_LINES_APART, fewest=_FEWEST_CYCLES
    )
    if not frequencies.size:  # sampled so slowly that no line is distinct from the drive
        return 0.0, 0.0
    cadence = 1.0 / float(np.median(np.take_along_axis(at.ts, at.lengths[:, None] - 1, axis=1)[:, 0] - at.ts[:, 0]))
    power = np.where(np.abs(frequencies / cadence - np.maximum(np.round(frequencies / cadence), 1.0)) < _OF_WINDOWS, 0.0, power)
    f_n = float(prepared.model.values().get("f_n", 0.0))
    if f_n > _SEVERAL * cadence:
        power = np.where(np.abs(frequencies - f_n) < _BESIDE * cadence, 0.0, power)
    best = int(np.argmax(power))
    return float(frequencies[best]), min(float(power[best]) / total, 1.0)
