"""Probe scales: amplitudes, frequencies and times of the experiment and the nominal fit that set the candidates' strengths and grids."""

import numpy as np

from identification.diagnosis.score.lags import lags
from identification.diagnosis.score.time_scales import contact_time
from identification.likelihood.linearised import Linearised
from identification.windows.layout import GAP_ERROR, Estimate
from identification.windows.prepare import Prepared
from vibrojax.effects import ProbeScales

_LINES = 2
"""Spectral lines taken from each channel's residual."""
_ON_THE_CEILING = 5
"""Fewest samples within the converter's step of the maximum that form a plateau."""


def probe_scales(prepared: Prepared, at: Linearised, estimate: Estimate) -> ProbeScales:
    """Scales of motion, force, time and frequency from which candidates derive their strengths and grids."""
    experiment = prepared.experiment
    used = np.asarray(at.weight.any(axis=(0, 1)))
    channels = tuple(name for name, counts in zip(at.channels, used, strict=True) if counts)
    inside = at.inside
    noise = {name: min(r.noise[name] for r in experiment.records if name in r.noise) for name in channels}
    values = prepared.layout.physical(estimate.shared)
    mass, law = float(values.get("m", experiment.mass)), prepared.model.replace(values).law
    return ProbeScales(
        mass=mass,
        f_n=float(values.get("f_n", 0.0)),
        omega_exc=2 * np.pi * max((r.excitation_frequency or 0.0) for r in experiment.records),
        drives=tuple(sorted({2 * np.pi * r.excitation_frequency for r in experiment.records if r.excitation_frequency})),
        gaps={r.file: r.gap for r in experiment.records},
        clock={r.file: (float(r.time[0]), float(r.time[-1])) for r in experiment.records},
        contacts={r.file: _contacts(at, index, r.time) for index, r in enumerate(experiment.records)},
        channels=channels,
        noise=noise,
        amplitude=float(np.abs(at.u[inside]).max()),
        lowest=_lowest(prepared, at),
        speed=float(np.abs(at.v[inside]).max()),
        force=float(at.push[inside].max()),
        deepest=_deepest(prepared, at, estimate, inside),
        contact_time=contact_time(law, at, mass),
        ceilings=_ceilings(prepared, channels),
        lines={name: _lines(prepared, at, channel) for channel, name in enumerate(at.channels) if used[channel]},
        lags=_unmended(lags(experiment.records), prepared),
        sampling=min(float(np.median(np.diff(r.time))) for r in experiment.records),
        law=law,
    )


def _unmended(found: dict[str, float], prepared: Prepared) -> dict[str, float]:
    """Delays found in the records; none if the model already delays one of these channels."""
    delayed = {effect.channel for effect in prepared.model.effects if effect.probe.delay}
    return {} if delayed & found.keys() else found


def _lowest(prepared: Prepared, at: Linearised) -> float:
    """Smallest recorded u, or fitted where u was not recorded, m."""
    recorded = [float(motion.u.min()) for motion in prepared.motions if motion is not None]
    return min(recorded) if recorded else float(at.u.min())


def _deepest(prepared: Prepared, at: Linearised, estimate: Estimate, inside: np.ndarray) -> float:
    """Largest indentation of the stop at the fitted gap, m; 0 without impacts.

    From the recorded motion, because a model that lacks a stop indents too far; from the fitted motion where none was recorded.
    """
    gaps = np.array([record.gap for record in prepared.experiment.records]) + estimate.nuisances[:, GAP_ERROR]
    contact = inside & at.in_contact
    depths = [0.0]
    for record in np.unique(at.record[contact.any(axis=1)]):
        motion, own = prepared.motions[record], contact & (at.record == record)[:, None]
        depths.append(float((at.u[own] if motion is None else motion.u).max() - gaps[record]))
    return max(depths)


def _contacts(at: Linearised, record: int, time: np.ndarray) -> tuple[tuple[float, float], ...]:
    """First and last time stamp of each fitted contact, s."""
    contact = np.pad(at.of_record(at.in_contact, record, len(time)).astype(int), 1)
    touches, releases = np.flatnonzero(np.diff(contact) == 1), np.flatnonzero(np.diff(contact) == -1)
    return tuple((float(time[touch]), float(time[release - 1])) for touch, release in zip(touches, releases, strict=True))


def _ceilings(prepared: Prepared, channels: tuple[str, ...]) -> dict[str, float]:
    """Saturation level of each channel that clips: many samples lie at its very maximum, where noise alone would spread them."""
    found = {}
    for name in channels:
        series = [(r.channels[name], r.noise[name]) for r in prepared.experiment.records if name in r.channels]
        top = max(float(np.nanmax(values)) for values, _ in series)
        level = sum(int(np.sum(values > top - 0.5 * noise)) for values, noise in series)
        exactly = sum(int(np.sum(values > top - 0.1 * noise)) for values, noise in series)
        if level >= _ON_THE_CEILING and exactly >= 0.8 * level:
            found[name] = top
    return found


def _lines(prepared: Prepared, at: Linearised, channel: int) -> tuple[float, ...]:
    """Strongest spectral lines in the residual of a channel over all records, Hz."""
    frequencies, power = None, 0.0
    for index, record in enumerate(prepared.experiment.records):
        if at.channels[channel] not in record.channels:
            continue
        residual = at.of_record(at.residual[..., channel], index, len(record.time))
        dt = float(np.median(np.diff(record.time)))
        count = max(1 << 17, 1 << (len(residual) - 1).bit_length())
        spectrum = np.abs(np.fft.rfft(residual, count)) ** 2 / max(len(residual), 1)
        frequencies = np.fft.rfftfreq(count, dt) if frequencies is None else frequencies
        power = power + np.interp(frequencies, np.fft.rfftfreq(count, dt), spectrum)
    if frequencies is None:
        return ()
    found = []
    power = np.where(frequencies > 15.0, power, 0.0)
    for _ in range(_LINES):
        best = float(frequencies[np.argmax(power)])
        found.append(best)
        power = np.where(np.abs(frequencies - best) < 2.0, 0.0, power)
    return tuple(found)
