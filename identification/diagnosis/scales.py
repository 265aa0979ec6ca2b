"""Scales of the records and of the estimated motion, from which candidates take their strengths and grids."""

import jax.numpy as jnp
import numpy as np

from identification.diagnosis.lags import lags
from identification.trajectory.course import Course
from identification.trajectory.fit import Fitted
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import ProbeScales

_LINES = 2
"""Spectral lines taken from each channel's reading error."""
_LOWEST_LINE_HZ = 15.0
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
    return ProbeScales(
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
        lines={name: _lines(fitted, channel) for channel, name in enumerate(channels)},
        lags=_unmended(lags(records), fitted),
        sampling=min(float(np.median(np.diff(r.time))) for r in records),
        law=law,
    )


def _contact_time(law, mass: float, speed: float, force: float) -> float:
    """Duration of an impact at the largest speed, s; NaN without impacts, or where the contact law gives them no duration."""
    if not isinstance(law, AbstractCompliantLaw) or not force > 0 or speed == 0:
        return np.nan
    found = float(law.contact_time(jnp.asarray(mass), jnp.asarray(speed)))
    return found if np.isfinite(found) else np.nan


def _contacts(touched: np.ndarray, time: np.ndarray) -> tuple[tuple[float, float], ...]:
    """First and last time stamp of each contact, s."""
    contact = np.pad(touched.astype(int), 1)
    touches, releases = np.flatnonzero(np.diff(contact) == 1), np.flatnonzero(np.diff(contact) == -1)
    return tuple((float(time[touch]), float(time[release - 1])) for touch, release in zip(touches, releases, strict=True))


def _unmended(found: dict[str, float], fitted: Fitted) -> dict[str, float]:
    """Delays that the records show; none if the model already delays one of these channels."""
    delayed = {effect.channel for effect in fitted.problem.model.effects if effect.probe.delay}
    return {} if delayed & found.keys() else found


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


def _lines(fitted: Fitted, channel: int) -> tuple[float, ...]:
    """Strongest spectral lines in the reading error of a channel over all records, Hz."""
    chains = fitted.problem.chains
    frequencies, power = None, 0.0
    for index, record in enumerate(fitted.problem.experiment.records):
        if chains.channels[channel] not in record.channels:
            continue
        residual = chains.series(index, fitted.linear.residual, len(record.time))[:, channel]
        dt = float(np.median(np.diff(record.time)))
        count = max(1 << 17, 1 << (len(residual) - 1).bit_length())
        spectrum = np.abs(np.fft.rfft(residual, count)) ** 2 / max(len(residual), 1)
        frequencies = np.fft.rfftfreq(count, dt) if frequencies is None else frequencies
        power = power + np.interp(frequencies, np.fft.rfftfreq(count, dt), spectrum)
    if frequencies is None:
        return ()
    found = []
    power = np.where(frequencies > _LOWEST_LINE_HZ, power, 0.0)
    for _ in range(_LINES):
        best = float(frequencies[np.argmax(power)])
        found.append(best)
        power = np.where(np.abs(frequencies - best) < 2.0, 0.0, power)
    return tuple(found)
