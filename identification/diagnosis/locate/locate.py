"""Where the nominal model goes wrong: in which channel, record and phase of the motion, and along which coordinate."""

import dataclasses

import numpy as np

from identification.diagnosis.diagnosis import Location, Profile
from identification.diagnosis.free_form.missing_force import missing_force, window_weights
from identification.diagnosis.locate.coordinates import Coordinate, Impacts, Missing, coordinates, gathered, impacts, line, profile
from identification.diagnosis.locate.location_words import Line, sentence
from identification.likelihood.linearised import Linearised
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from vibrojax.effects import AbstractEffect

_ALONE = 0.9
"""Share of the excess above which a channel has the misfit to itself."""
_OF_ONE_SENSOR = ("impact_force", "cart_displacement", "cart_acceleration")
"""Channels that may fail without the hammer: a misfit of theirs alone is no force on it."""
_ACCELERATIONS, _DISPLACEMENTS = ("hammer_acceleration",), ("hammer_displacement", "relative_displacement")
_DENSER, _FAIR = 2.0, 0.25
"""A phase has the misfit if it is this many times denser there than in the rest, and holds this share of it."""
_TELLING = 0.15
"""Share of the excess that the mean along a coordinate must explain to be trusted more than where the excess gathers."""
_STEADY_LINE = 0.4
"""Share of the excess that makes a line."""
_TIME_MUST_WIN_BY = 0.05
_MOST, _EVERYWHERE = 0.8, 0.5
"""Share of the excess that the interval holds; share of the samples that is so many that there is no interval."""
_QUIET_RECORD = 0.02
"""Share of the excess below which a record does not say in which phase it is."""
_CELLS = 24
_QUIET, _LOUD = 1.2, 1.5
"""Mean squared residual over the noise variance of a window that is fitted, and of one that is not."""
_SHOWS = 6.0
"""Residual in noise units that is no noise."""


def locate(
    prepared: Prepared,
    estimate: Estimate,
    at: Linearised,
    *,
    named: AbstractEffect | None = None,
) -> Location:
    """Say where the misfit of the nominal model, fitted tolerantly on short windows, sits.

    Excess is the squared residual over the noise variance less 1; windows that the fit has given up on count as little as they did there.
    A phase of the motion has the misfit if what is missing is twice as dense there as elsewhere and a quarter of the whole is in it.
    What is missing is a force on the hammer (`missing_force`); or a channel's residual, where one sensor has the misfit to itself or the
    cart shows it most. The coordinate is that whose bin means foretell most of it in records (time: periods) that they were not taken
    from; where none does, because its sign changes from impact to impact, that along which its size is most uneven.

    Arguments:
        prepared: windows of the nominal model.
        estimate: its fit.
        at: its motion and derivatives there.
        named: effect that the verdict asserts, if any: it says in which record and from which instant on it acts.
    """
    mass = float(prepared.layout.physical(estimate.shared).get("m", prepared.experiment.mass))
    share = window_weights(at)
    residuals = {name: _residual(at, share, index) for index, name in enumerate(at.channels) if (at.weight[..., index] > 0).any()}
    channels = _shares({name: float(one.excess.sum()) for name, one in residuals.items()})
    records = _by_record(prepared, at, residuals)
    files = list(records)
    hits = impacts(prepared, at)
    regions = _regions(prepared, at, hits)
    missing, rough = _missing(prepared, at, mass, residuals, channels, share)
    onset = _onset(prepared, at, records)
    record, time = _of_effect(named) if named is not None else onset
    loud = _loud(at, records, time)
    smoothed = missing.quantity == "force" and "hammer_acceleration" not in residuals
    phase = _phase(missing, {name: part & loud for name, part in regions.items()}, smoothed=smoothed)
    region = ~at.in_contact & regions["all"] if phase == "free flight" else regions[phase]
    near = at.in_contact | regions["separation"]
    among = coordinates(prepared, at, estimate, hits, near, drifting=missing.quantity.startswith("cart_"))
    profiles, best, missing = _ranked(prepared, at, missing, rough, region, among)
    hum = _hum(prepared, at, missing, regions["all"], profiles[0].explained)
    if hum is not None or time is not None:
        best = next(one for one in among if one.name == "time")
        profiles = tuple(sorted(profiles, key=lambda one: one.coordinate != "time"))
    found = Location(
        channel=max(channels, key=lambda name: channels[name]),
        channels=channels,
        records=records,
        phase=phase,
        coordinate=best.name,
        interval=_span(prepared, at, missing, region, best, files.index(record) if record in files else None, time=time, hum=hum),
        time=time,
        record=record,
        sentence="",
        profiles=profiles,
        maps={file: _map(at, estimate, index, prepared) for index, file in enumerate(files)},
    )
    driven = any(record.excitation_frequency for record in prepared.experiment.records)
    words = sentence(found, missing.quantity, hum, driven=driven, before_is_quiet=onset[1] is not None)
    return dataclasses.replace(found, sentence=words)


def _residual(at: Linearised, share: np.ndarray, channel: int) -> Missing:
    """Residual of one channel, in its noise."""
    known = (at.weight[..., channel] > 0) & (share > 0)[:, None]
    spread = 1.0 / np.sqrt(np.where(share > 0, share, 1.0))[:, None]
    return Missing(quantity=at.channels[channel], value=at.residual[..., channel], stderr=np.where(known, spread, np.inf), share=share)


def _shares(sums: dict[str, float]) -> dict[str, float]:
    """Parts of the whole; negative ones, which noise makes, count as none."""
    clipped = {name: max(value, 0.0) for name, value in sums.items()}
    total = sum(clipped.values())
    return {name: value / total if total > 0 else 1.0 / len(clipped) for name, value in clipped.items()}


def _by_record(prepared: Prepared, at: Linearised, residuals: dict[str, Missing]) -> dict[str, float]:
    """Share of the excess, over all channels, in each record."""
    whole = np.sum([one.excess.sum(axis=1) for one in residuals.values()], axis=0)
    files = [record.file for record in prepared.experiment.records]
    return _shares({file: float(whole[at.record == index].sum()) for index, file in enumerate(files)})


def _loud(at: Linearised, records: dict[str, float], time: float | None) -> np.ndarray:
    """Samples of records that have enough of the misfit to say in which phase it is; from its onset, if it has one."""
    told = np.array(list(records.values())) > _QUIET_RECORD
    return told[at.record, None] & (at.ts >= (-np.inf if time is None else time))


def _hum(prepared: Prepared, at: Linearised, missing: Missing, inside: np.ndarray, explained: float) -> Line | None:
    """A steady line that makes much of what is missing, and more than the best coordinate explains."""
    frequency, share = line(prepared, at, missing, inside)
    return Line(frequency_hz=frequency, share=share) if share > max(_STEADY_LINE, explained) else None


def _missing(
    prepared: Prepared, at: Linearised, mass: float, residuals: dict[str, Missing], channels: dict[str, float], share: np.ndarray
) -> tuple[Missing, Missing]:
    """The missing force; or the residual of the channel that has the misfit to itself. Twice: first as a mean is to be taken of it.

    For that a lone channel counts in full where the others are fitted; second, as little as the fit has let it.
    """
    loudest = max(channels, key=lambda name: channels[name])
    alone = channels[loudest] >= _ALONE
    found = missing_force(prepared, at, mass)
    if found is None or (alone and (loudest in _OF_ONE_SENSOR or _contradicted(prepared, at, loudest, residuals))):
        index = at.channels.index(loudest)
        others = dataclasses.replace(at, residual=np.where(np.arange(len(at.channels)) == index, 0.0, at.residual))
        return _residual(at, window_weights(others), index), residuals[loudest]
    force = Missing(quantity="force", value=found[0], stderr=found[1], share=share)
    return (residuals[loudest], residuals[loudest]) if loudest.startswith("cart_") else (force, force)


def _contradicted(prepared: Prepared, at: Linearised, channel: str, residuals: dict[str, Missing]) -> bool:
    """Whether another sensor of the hammer's motion, or a steady line in this one, tells that no force is behind its residual."""
    others = _DISPLACEMENTS if channel in _ACCELERATIONS else _ACCELERATIONS if channel in _DISPLACEMENTS else ()
    if channel in _DISPLACEMENTS and any(name in residuals for name in others):
        return True
    return line(prepared, at, residuals[channel], residuals[channel].known)[1] > _STEADY_LINE


def _regions(prepared: Prepared, at: Linearised, hits: Impacts) -> dict[str, np.ndarray]:
    """Samples of every phase of the motion, (windows, time) bool each.

    Separation: moving away from the stop, from half a contact time before the release to a whole one after it. After impact: from there
    to two contact times or a tenth of the excitation period after the release. Free flight: neither that nor contact.
    """
    inside = at.inside
    usual = hits.contact_time
    period = np.array([1.0 / record.excitation_frequency if record.excitation_frequency else 0.0 for record in prepared.experiment.records])
    leaving = (hits.until_release <= 0.5 * usual) & at.in_contact | (hits.since_release <= usual) & ~at.in_contact
    separation = inside & (at.v < 0) & leaving
    after = inside & ~at.in_contact & ~separation & (hits.since_release <= np.maximum(2.0 * usual, 0.1 * period[at.record, None]))
    contact = inside & at.in_contact
    flight = inside & ~contact & ~separation & ~after
    return {"contact": contact, "separation": separation, "after impact": after, "free flight": flight, "all": inside}


def _phase(missing: Missing, regions: dict[str, np.ndarray], *, smoothed: bool) -> str:
    """The narrow phase with the densest excess if it stands out; else free flight if contacts are free of it; else all.

    A smoothed force does not tell a contact from what follows within milliseconds.
    """
    narrow = ("contact",) if smoothed else ("contact", "separation", "after impact")
    excess, everywhere = missing.excess, regions["all"] & missing.known
    total = float(excess[everywhere].sum())
    if total <= 0:
        return "all"
    densities = {}
    for name in narrow:
        inside = regions[name] & everywhere
        if inside.any() and (everywhere & ~inside).any():
            density, rest = float(excess[inside].mean()), max(float(excess[everywhere & ~inside].mean()), 0.0)
            if density > _DENSER * rest and excess[inside].sum() > _FAIR * total:
                densities[name] = density
    if densities:
        return max(densities, key=lambda name: densities[name])
    if missing.quantity.startswith("cart_"):
        return "all"
    contact = regions["contact"] & everywhere
    if not contact.any() or not (everywhere & ~contact).any():
        return "all"
    return "free flight" if excess[everywhere & ~contact].mean() > _DENSER * max(excess[contact].mean(), 0.0) else "all"


def _ranked(
    prepared: Prepared, at: Linearised, missing: Missing, rough: Missing, region: np.ndarray, among: tuple[Coordinate, ...]
) -> tuple[tuple[Profile, ...], Coordinate, Missing]:
    """Profiles along all coordinates that have a meaning here, the best first, the best coordinate, and the measure that told."""
    among = tuple(one for one in among if (region & missing.known & np.isfinite(one.value)).any())
    profiles = {one.name: profile(prepared, at, missing, region, one) for one in among}
    scores = {name: one.explained for name, one in profiles.items()}
    if max(scores.values()) < _TELLING:
        missing, scores = rough, {one.name: gathered(prepared, at, rough, region, one) for one in among}
    order = sorted(among, key=lambda one: -(scores[one.name] - (_TIME_MUST_WIN_BY if one.name == "time" else 0.0)))
    return tuple(profiles[one.name] for one in order), order[0], missing


def _onset(prepared: Prepared, at: Linearised, records: dict[str, float]) -> tuple[str | None, float | None]:
    """Record that has the misfit to itself, and when it starts there, s.

    If its windows are fitted before, and most of those after (or of those with a contact) are not; else None twice.
    """
    files = [record.file for record in prepared.experiment.records]
    file = max(files, key=lambda name: records[name])
    count = np.maximum((at.weight > 0).sum(axis=(1, 2)), 1)
    mean = np.where(at.finite, np.sum(at.residual**2, axis=(1, 2)) / count, np.inf)
    here = np.flatnonzero((at.record == files.index(file)) & at.finite)
    loud = here[mean[here] > _LOUD]
    if records[file] < _MOST or len(loud) < 3 or np.sum(here < loud[0]) < 3 or mean[here[here < loud[0]]].mean() > _QUIET:
        return None, None
    window = loud[0]
    later = here[here >= window]
    touching = later[(at.in_contact & at.inside)[later].any(axis=1)]
    if max(np.isin(part, loud).mean() for part in (later, touching) if len(part)) < 0.5:
        return None, None
    shows = (np.abs(at.residual[window]) > _SHOWS).any(axis=1)
    return file, float(at.ts[window, int(np.argmax(shows))])


def _of_effect(named: AbstractEffect) -> tuple[str | None, float | None]:
    """Record in which an effect acts alone, and when it begins."""
    instants = [float(getattr(named, p.field)) for p in named.parameters if p.name == "instant"]
    return named.record, instants[0] if instants else None


def _span(
    prepared: Prepared,
    at: Linearised,
    missing: Missing,
    region: np.ndarray,
    along: Coordinate,
    record: int | None,
    *,
    time: float | None,
    hum: Line | None,
) -> tuple[float, float] | None:
    """Where along the coordinate: from its instant to the end of the record for what begins, everywhere for a hum, else `_interval`."""
    if time is not None:
        return time, float(prepared.experiment.records[record or 0].time[-1])
    return None if hum is not None else _interval(at, missing, region, along, record)


def _interval(at: Linearised, missing: Missing, region: np.ndarray, along: Coordinate, record: int | None) -> tuple[float, float] | None:
    """Smallest range of the coordinate that holds most of the excess; None where it takes nearly everything."""
    use = region & missing.known & np.isfinite(along.value)
    if record is not None:
        use = use & (at.record == record)[:, None]
    values, excess = along.value[use], missing.excess[use]
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, 4 * _CELLS + 1)))
    if len(edges) < 3 or excess.sum() <= 0:
        return None
    bins = np.digitize(values, edges[1:-1])
    held = np.concatenate([[0.0], np.cumsum(np.maximum(np.bincount(bins, weights=excess), 0.0))])
    last = np.searchsorted(held, held[:-1] + _MOST * held[-1])
    ranges = [(edges[b] - edges[a], a, b) for a, b in enumerate(last) if b < len(held)]
    _, a, b = min(ranges)
    if np.mean((values >= edges[a]) & (values <= edges[b])) > _EVERYWHERE:
        return None
    return float(edges[a]), float(edges[b])


def _map(at: Linearised, estimate: Estimate, record: int, prepared: Prepared) -> np.ndarray:
    """Mean squared residual in equal parts of a record (rows) and of its excitation period, or of the row where there is none (columns)."""
    about = prepared.experiment.records[record]
    windows = at.record == record
    used = at.weight[windows] > 0
    squares, counts = np.sum(np.where(used, at.residual[windows] ** 2, 0.0), axis=-1), used.sum(axis=-1)
    part = np.clip((at.ts[windows] - about.time[0]) / (about.time[-1] - about.time[0]), 0.0, 1.0 - 1e-9) * _CELLS
    turn = part
    if about.excitation_frequency:
        turn = about.excitation_frequency * at.ts[windows] + estimate.nuisances[record, 1] / (2.0 * np.pi)
    cell = part.astype(int) * _CELLS + (np.mod(turn, 1.0) * _CELLS).astype(int)
    total, samples = (np.bincount(cell.ravel(), weights=x.ravel(), minlength=_CELLS**2) for x in (squares, counts.astype(float)))
    return np.where(samples > 0, total / np.maximum(samples, 1.0), np.nan).reshape(_CELLS, _CELLS)
