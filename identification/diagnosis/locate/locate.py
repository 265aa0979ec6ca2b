"""Location of the nominal model's misfit: channel, record, phase of the motion, and coordinate."""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.diagnosis.diagnosis import Location, Profile
from identification.diagnosis.free_form.missing_force import missing_force, window_weights
from identification.diagnosis.locate.coordinates import Coordinate, Impacts, Missing, coordinates, gathered, impacts, line, profile
from identification.diagnosis.locate.location_words import Line, sentence
from identification.likelihood.linearised import Linearised
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from vibrojax.effects import AbstractEffect

_ALONE = 0.9
"""Share of the excess above which the misfit counts as confined to one channel."""
_OF_ONE_SENSOR = ("impact_force", "cart_displacement", "cart_acceleration")
"""Channels whose sensor may fail by itself: a misfit of one of these alone is no force on the hammer."""
_ACCELERATIONS, _DISPLACEMENTS = ("hammer_acceleration",), ("hammer_displacement", "relative_displacement")
_DENSER, _FAIR = 2.0, 0.25
"""Ratio of the excess density in a phase to that elsewhere, and share of the excess, above which the misfit is in that phase."""
_LEAST_EXPLAINED = 0.15
"""Smallest share of the excess that bin means along a coordinate must explain; below it, coordinates are ranked by unevenness."""
_STEADY_LINE = 0.4
"""Share of the excess in one spectral line above which the misfit counts as a steady tone."""
_TIME_MUST_WIN_BY = 0.05
_MOST, _EVERYWHERE = 0.8, 0.5
"""Share of the excess that the interval holds; share of the samples above which no interval is reported."""
_QUIET_RECORD = 0.02
"""Share of the excess below which a record does not enter the choice of phase."""
_CELLS = 24
_QUIET, _LOUD = 1.2, 1.5
"""Mean squared residual over the noise variance up to which a window counts as fitted, and above which it counts as not fitted."""
_SHOWS = 6.0
"""Residual, in units of the noise, above which the misfit has begun."""


def locate(
    prepared: Prepared,
    estimate: Estimate,
    at: Linearised,
    *,
    named: AbstractEffect | None = None,
    acting: Float[np.ndarray, "windows time"] | None = None,
) -> Location:
    """Locate the misfit of the nominal model, fitted robustly on short windows.

    Excess is the squared residual over the noise variance less 1; windows that the fit down-weights count as little as they did there. The
    misfit belongs to a phase of the motion whose excess is twice as dense as elsewhere and holds a quarter of the whole. The quantity is
    the missing force on the hammer (`missing_force`); or a channel's residual, where the misfit is confined to one sensor or is largest in
    the cart. The coordinate is the one whose bin means predict most of the excess in left-out records (time: periods). Where no coordinate
    does, because the sign changes from impact to impact, it is the one with the most uneven excess.

    Arguments:
        prepared: windows of the nominal model.
        estimate: its fit.
        at: its motion and derivatives there.
        named: asserted effect, if any; its record and onset replace those found in the residuals.
        acting: force of that effect along the motion, N; the coordinate is then the one that predicts most of this force and of the
            missing one.
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
    if acting is not None and acting.any() and missing.quantity == "force":
        cause = Missing(quantity="force", value=acting, stderr=np.where(missing.known, 1.0, np.inf), share=np.zeros(len(share)))
        of_cause = {one.name: profile(prepared, at, cause, region, one).explained for one in among}
        profiles = tuple(sorted(profiles, key=lambda one: (-of_cause[one.coordinate] * one.explained, -of_cause[one.coordinate])))
        best = next(one for one in among if one.name == profiles[0].coordinate)
    hum = _hum(prepared, at, missing, regions["all"], max(one.explained for one in profiles))
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
    """Residual of one channel, in units of its noise."""
    known = (at.weight[..., channel] > 0) & (share > 0)[:, None]
    spread = 1.0 / np.sqrt(np.where(share > 0, share, 1.0))[:, None]
    return Missing(quantity=at.channels[channel], value=at.residual[..., channel], stderr=np.where(known, spread, np.inf), share=share)


def _shares(sums: dict[str, float]) -> dict[str, float]:
    """Shares of the total; negative sums, due to noise, count as zero."""
    clipped = {name: max(value, 0.0) for name, value in sums.items()}
    total = sum(clipped.values())
    return {name: value / total if total > 0 else 1.0 / len(clipped) for name, value in clipped.items()}


def _by_record(prepared: Prepared, at: Linearised, residuals: dict[str, Missing]) -> dict[str, float]:
    """Share of the excess, over all channels, in each record."""
    whole = np.sum([one.excess.sum(axis=1) for one in residuals.values()], axis=0)
    files = [record.file for record in prepared.experiment.records]
    return _shares({file: float(whole[at.record == index].sum()) for index, file in enumerate(files)})


def _loud(at: Linearised, records: dict[str, float], time: float | None) -> np.ndarray:
    """Samples of records with a relevant share of the misfit, from its onset on, if it has one."""
    affected = np.array(list(records.values())) > _QUIET_RECORD
    return affected[at.record, None] & (at.ts >= (-np.inf if time is None else time))


def _hum(prepared: Prepared, at: Linearised, missing: Missing, inside: np.ndarray, explained: float) -> Line | None:
    """Steady tone in the missing quantity, if its share exceeds `_STEADY_LINE` and that of the best coordinate; else None."""
    frequency, share = line(prepared, at, missing, inside)
    return Line(frequency_hz=frequency, share=share) if share > max(_STEADY_LINE, explained) else None


def _missing(
    prepared: Prepared, at: Linearised, mass: float, residuals: dict[str, Missing], channels: dict[str, float], share: np.ndarray
) -> tuple[Missing, Missing]:
    """Missing force, or residual of the channel to which the misfit is confined, with two weightings of the windows.

    First for means: a single channel has full weight where the other channels are fitted. Second: the weights of the fit.
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
    """Whether another motion sensor of the hammer, or a steady line in this one, shows that the residual is not due to a force."""
    others = _DISPLACEMENTS if channel in _ACCELERATIONS else _ACCELERATIONS if channel in _DISPLACEMENTS else ()
    if channel in _DISPLACEMENTS and any(name in residuals for name in others):
        return True
    return line(prepared, at, residuals[channel], residuals[channel].known)[1] > _STEADY_LINE


def _regions(prepared: Prepared, at: Linearised, hits: Impacts) -> dict[str, np.ndarray]:
    """Samples of every phase of the motion, (windows, time) bool each.

    Separation: moving away from the stop, from half a contact time before the release to a whole one after it. After impact: from there
    to two contact times or a tenth of the excitation period after the release. Free flight: all other samples out of contact.
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
    """Phase with the densest excess: a short one if it stands out, else free flight if contacts have little excess, else all.

    A smoothed force does not separate a contact from the milliseconds after it.
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
    """Profiles along all coordinates with values in the region, best first; the best coordinate; the missing quantity used to rank them."""
    among = tuple(one for one in among if (region & missing.known & np.isfinite(one.value)).any())
    profiles = {one.name: profile(prepared, at, missing, region, one) for one in among}
    scores = {name: one.explained for name, one in profiles.items()}
    if max(scores.values()) < _LEAST_EXPLAINED:
        missing, scores = rough, {one.name: gathered(prepared, at, rough, region, one) for one in among}
    order = sorted(among, key=lambda one: -(scores[one.name] - (_TIME_MUST_WIN_BY if one.name == "time" else 0.0)))
    return tuple(profiles[one.name] for one in order), order[0], missing


def _onset(prepared: Prepared, at: Linearised, records: dict[str, float]) -> tuple[str | None, float | None]:
    """Record to which the misfit is confined, and the onset of the misfit there, s.

    Its windows must be fitted before the onset, and most later ones (or most later ones with a contact) must not be; else None twice.
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
    """Record, if an effect acts in one alone, and instant at which it begins."""
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
    """Interval of the coordinate: from the onset to the end of the record, if there is one; None for a steady tone; else `_interval`."""
    if time is not None:
        return time, float(prepared.experiment.records[record or 0].time[-1])
    return None if hum is not None else _interval(at, missing, region, along, record)


def _interval(at: Linearised, missing: Missing, region: np.ndarray, along: Coordinate, record: int | None) -> tuple[float, float] | None:
    """Smallest range of the coordinate that holds most of the excess; None where it covers most samples."""
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
    """Mean squared residual in bins of record time (rows) and of excitation phase (columns); without excitation, columns are time again."""
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
