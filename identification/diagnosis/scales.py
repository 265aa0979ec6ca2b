"""Scales of the records and of the estimated motion, from which candidates take their strengths and grids."""

import dataclasses
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
from scipy.signal import find_peaks, zoom_fft

from identification.diagnosis.lags import lags
from identification.experiment import Experiment
from identification.experiment.samples import runs_of
from identification.guesses.motion import driving_channels
from identification.trajectory.chain_equations import whitenings
from identification.trajectory.course import Course
from identification.trajectory.fit import Fitted
from identification.trajectory.variances import vanishes
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import ProbeScales

_LINES = 2
"""Spectral lines taken from each channel's reading error, and from the random force."""
_SPACING, _APART = 0.25, 10.0
"""Of frequencies of the spectrum, and of two lines at least, over that of one period in the longest record."""
_ON_THE_CEILING = 5
"""Fewest samples within a tenth of the noise of the maximum that form a plateau."""


def probe_scales(fitted: Fitted, courses: tuple[Course, ...]) -> ProbeScales:
    """Scales of motion, force, time and frequency."""
    problem = fitted.problem
    experiment, values = problem.experiment, problem.values(fitted.at)
    records = experiment.records
    law = problem.model_at(fitted.at).law
    mass = float(values.get("m", experiment.mass))
    u, v, push, depth = (
        [np.asarray(pick(course))[: len(record.time)] for course, record in zip(courses, records, strict=True)]
        for pick in (lambda c: c.motion.u, lambda c: c.motion.v, lambda c: c.push, lambda c: c.motion.indentation)
    )
    touched = [np.asarray(course.motion.in_contact)[: len(record.time)] for course, record in zip(courses, records, strict=True)]
    speed, force = max(float(np.abs(one).max()) for one in v), max(float(one.max()) for one in push)
    channels = problem.chains.channels
    found = ProbeScales(
        mass=mass,
        f_n=float(values.get("f_n", 0.0)),
        omega_exc=2 * np.pi * max((r.excitation_frequency or 0.0) for r in records),
        drives=tuple(sorted({2 * np.pi * r.excitation_frequency for r in records if r.excitation_frequency})),
        gaps={r.file: r.gap for r in records},
        clock={r.file: (float(r.time[0]), float(r.time[-1])) for r in records},
        contacts={r.file: _contacts(on, r.time) for on, r in zip(touched, records, strict=True)},
        channels=channels,
        noise={name: min(r.noise[name] for r in records if name in r.noise) for name in channels},
        amplitude=max(float(np.abs(one).max()) for one in u),
        lowest=min(float(one.min()) for one in u),
        speed=speed,
        force=force,
        deepest=max((float(one[on].max()) for one, on in zip(depth, touched, strict=True) if on.any()), default=0.0),
        contact_time=_contact_time(law, mass, speed, force),
        ceilings=_ceilings(fitted, channels),
        lines={},
        frequencies_searched=0,
        lags=_unmended(lags(records), fitted),
        sampling=min(float(np.median(np.diff(r.time))) for r in records),
        law=law,
        tied=force > 0 or len(channels) > 1 or _is_known(experiment),
    )
    lines = {name: _lines(fitted, channel, found) for channel, name in enumerate(channels)}
    searched = sum(number for _, number in lines.values())
    return dataclasses.replace(found, lines={name: one for name, (one, _) in lines.items()}, frequencies_searched=searched)


def _is_known(experiment: Experiment) -> bool:
    """Whether the size of the motion is known: from the cart, gravity or a length, or from a force beside a known mass."""
    driven = set().union(*(driving_channels(record) & record.channels.keys() for record in experiment.records))
    moved = driven - {"applied_force"} or any(record.base_amplitude for record in experiment.records)
    forced = driven & {"applied_force"} or experiment.load.constant_force
    return bool(moved or experiment.load.incline or experiment.suspension.length or (forced and experiment.mass_is_known))


def _contact_time(law, mass: float, speed: float, force: float) -> float:
    """Duration of an impact at the largest speed, s; NaN without impacts, or where the contact law gives them no duration."""
    if not isinstance(law, AbstractCompliantLaw) or not force > 0 or speed == 0:
        return np.nan
    found = float(law.contact_time(jnp.asarray(mass), jnp.asarray(speed)))
    return found if np.isfinite(found) else np.nan


def _contacts(touched: np.ndarray, time: np.ndarray) -> tuple[tuple[float, float], ...]:
    """First and last time stamp of each contact, s."""
    return tuple((float(time[touch]), float(time[release - 1])) for touch, release in zip(*runs_of(touched), strict=True))


def _unmended(found: dict[str, float], fitted: Fitted) -> dict[str, float]:
    """Delays that the records show; none if the model already delays, or filters, one of these channels."""
    mended = {effect.channel for effect in fitted.problem.model.effects if effect.does("lateness") or effect.own_states}
    return {} if mended & found.keys() else found


def _ceilings(fitted: Fitted, channels: tuple[str, ...]) -> dict[str, float]:
    """Level at which a channel is cut off: many samples lie at its very maximum, where noise alone would spread them."""
    found = {}
    for name in channels:
        series = [(r.channels[name], r.noise[name]) for r in fitted.problem.experiment.records if name in r.channels]
        top = max(float(np.nanmax(values)) for values, _ in series)
        level = sum(int(np.sum(values > top - 0.5 * noise)) for values, noise in series)
        exactly = sum(int(np.sum(values > top - 0.1 * noise)) for values, noise in series)
        if level >= _ON_THE_CEILING and exactly >= 0.8 * level:
            found[name] = top
    return found


def _lines(fitted: Fitted, channel: int, scales: ProbeScales) -> tuple[tuple[float, ...], int]:
    """Strongest spectral lines of a channel's whitened reading error, Hz, where a tone of any phase scores most, and frequencies searched.

    Those of the whitened random force follow, which takes up a tone in the readings near f_n.
    """
    chains = fitted.problem.chains
    white = whitenings(chains, fitted.linear, fitted.variances.readings)[channel](fitted.linear.residual[..., channel])
    heard = [index for index, record in enumerate(fitted.problem.experiment.records) if chains.channels[channel] in record.channels]
    errors = []
    for index in heard:
        time = fitted.problem.experiment.records[index].time
        errors.append((chains.series(index, white[..., None], len(time))[:, 0], float(np.median(np.diff(time)))))
    found, searched = _strongest(errors, scales.is_foreign)
    apart = _APART / max(len(values) * dt for values, dt in errors)
    others, more = lines_of_force(fitted, scales, heard)
    return found + tuple(line for line in others if all(abs(line - one) > apart for one in found)), searched + more


def lines_of_force(fitted: Fitted, scales: ProbeScales, records: Sequence[int]) -> tuple[tuple[float, ...], int]:
    """Strongest spectral lines of the whitened random force in some records, Hz, and frequencies searched; none without a force."""
    chains, force = fitted.problem.chains, fitted.variances.force
    if vanishes(fitted.problem, force):
        return (), 0
    correlation, variance = force.step(chains.duration)
    jumps = (fitted.at.force[chains.left + 1] - correlation * fitted.at.force[chains.left]) / np.sqrt(variance)
    parts = [chains.of_record(index) for index in records]
    return _strongest([(jumps[part], float(np.median(chains.duration[part]))) for part in parts], scales.is_foreign)


def _strongest(series: list[tuple[np.ndarray, float]], may_be: Callable[[np.ndarray], np.ndarray]) -> tuple[tuple[float, ...], int]:
    """Frequencies, Hz, of the highest peaks in the sum of the periodograms of some series, each with its sampling interval, s, of how many.

    Only those count that `may_be` lines, and the flank of one that may not is no peak; none where the series are too short for any.
    """
    longest, sampling = max(len(values) * dt for values, dt in series), min(dt for _, dt in series)
    frequencies = np.arange(1.0 / longest, 0.5 / sampling, _SPACING / longest)
    power, found, foreign = np.zeros(len(frequencies)), [], may_be(frequencies)
    for values, dt in series:
        count = 1 << int(np.ceil(np.log2(longest / _SPACING / dt)))
        spectrum = np.abs(np.fft.rfft(np.nan_to_num(values), count)) ** 2 / max(np.count_nonzero(values), 1)
        power += np.interp(frequencies, np.fft.rfftfreq(count, dt), spectrum, right=0.0)
    peaks, _ = find_peaks(power)
    peaks = peaks[foreign[peaks]]
    while len(peaks) and len(found) < _LINES:
        best = float(frequencies[peaks[np.argmax(power[peaks])]])
        found.append(_refined(series, best, _SPACING / longest, may_be))
        peaks = peaks[np.abs(frequencies[peaks] - best) >= _APART / longest]
    return tuple(found), int(foreign.sum())


def _refined(series: list[tuple[np.ndarray, float]], hz: float, spacing: float, may_be: Callable[[np.ndarray], np.ndarray]) -> float:
    """The top of a peak beside a frequency of the grid, Hz: a wave that is slightly off leaves much of a strong line unexplained."""
    band = max(hz - spacing, 0.5 * hz), hz + spacing
    near, power = np.linspace(*band, 33), np.zeros(33)  # sixteen steps to either side
    for values, dt in series:
        if band[1] < 0.5 / dt:
            spectrum = zoom_fft(np.nan_to_num(values), [edge * dt for edge in band], len(near), fs=1, endpoint=True)
            power += np.abs(spectrum) ** 2 / max(np.count_nonzero(values), 1)
    return float(near[np.argmax(np.where(may_be(near), power, -1.0))])
