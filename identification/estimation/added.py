"""Effects added on request, whether or not the records give evidence of them."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import jax.numpy as jnp
import numpy as np
from scipy.signal import periodogram

from identification.estimation.prediction import record_fits
from identification.experiment import Experiment
from identification.likelihood.evidence import chance
from identification.result.result import Added, RecordFit, impacts
from identification.trajectory.chain_equations import solve
from identification.trajectory.extended import with_effect
from identification.trajectory.fit import Fitted, equations, fit, reweighed
from identification.trajectory.motion import Estimate
from identification.trajectory.segments import at_ceiling
from identification.trajectory.start import Problem
from identification.wording.numbers import joined
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import EFFECTS, AbstractEffect, ProbeScales
from vibrojax.errors import InputError

_WEAK = 1e-3
"""Strength, over that of a candidate, at which the expected gain is worked out."""
_STRONGEST = 3.0
"""Largest strength of a start, over that of a candidate."""
_LOWEST_LINE_HZ, _APART_HZ, _LINES = 15.0, 2.0, 2
"""Lowest frequency of a line in a residual, distance of two, and how many are taken of a channel."""


def with_effects(nominal: Fitted, names: Sequence[str], *, seed: int, progress: Callable[[str], None]) -> tuple[Fitted, Added]:
    """The fitted model with effects, added in the order of `names`, each fitted anew with everything else, and what they gain.

    Of the candidates of an effect (frequencies, channels, records), that with the largest expected gain is the start: the gain of the
    chain's equations at a thousandth of the candidate's strength, from where the strength enters linearly.

    Raises:
        InputError: an effect has nothing to act on in these records, or cannot be read segment by segment.
    """
    found, possibilities, places = nominal, 1, []
    for name in names:
        if any(not state.carried for state in EFFECTS[name].own_states):
            raise InputError(f"{name} cannot be fitted yet: what it shows depends on samples of the past; leave it out")
        progress(f"choosing where {name} begins")
        candidates = [effect for one in EFFECTS[name].probe.candidates(probe_scales(found)) for effect in [EFFECTS[name].probe.joined(one)]]
        if not candidates:
            channels = joined(list(found.problem.chains.channels))
            raise InputError(f"{name} has nothing to act on in these records, which hold {channels}: leave it out")
        gains = [_expected(found, effect) for effect in candidates]
        best = int(np.argmax([gain for gain, _ in gains]))
        places.append(candidates[best].channel or candidates[best].record or "")
        possibilities *= len(candidates) * EFFECTS[name].probe.searched
        progress(f"fitting the model with {name}")
        found = fit(gains[best][1], seed=seed, progress=progress)
    gain = 0.5 * (nominal.solution.deviance - found.solution.deviance)
    numbers = max(_unknowns(found) - _unknowns(nominal), 1)
    return found, Added(
        names=tuple(names),
        places=tuple(places),
        gain=gain,
        chance=chance(2.0 * gain, numbers, possibilities),
        bic=-2.0 * gain + numbers * float(np.log(max(found.local.samples, 1))),
        held_back=None,
    )


def _unknowns(fitted: Fitted) -> int:
    return int(fitted.problem.border.shared.sum() + fitted.problem.border.own.sum())


def _expected(fitted: Fitted, effect: AbstractEffect) -> tuple[float, Problem]:
    """Expected gain of twice the log-likelihood by a candidate, and the problem that begins with it at its estimated strength."""
    weak = with_effect(fitted.problem, fitted.at, effect.scaled(_WEAK))
    strengths = _strengths(effect)
    names = [name for name, _ in weak.unknowns.shared]
    free = weak.border.shared & np.array([name not in strengths or strengths[name] for name in names])
    scored = dataclasses.replace(weak, border=dataclasses.replace(weak.border, shared=free, proximal=0.0))
    without = np.array([name not in strengths for name in names]), np.array([name not in strengths for name in weak.unknowns.own])
    held = dataclasses.replace(scored.border, shared=free & without[0], own=scored.border.own & without[1])
    own = np.where(weak.border.own, _own(fitted, weak), weak.start.own)
    at = Estimate(states=_carried(fitted, weak), force=fitted.at.force, shared=weak.start.shared, own=own)
    linear, _, solution = equations(scored, at, fitted.variances)
    nothing = dataclasses.replace(scored, border=held)
    local, mass = reweighed(nothing, at, linear, fitted.variances.readings), weak.experiment.mass
    before = solve(weak.chains, weak.unknowns, held, weak.scales, at, local, fitted.variances.force, mass)
    gain = float(before.deviance - solution.deviance)
    begin = with_effect(fitted.problem, fitted.at, effect)
    shared = begin.start.shared.copy()
    listed = {p.name: p for p in weak.parameters}
    for index, name in enumerate(names):
        if not strengths.get(name, False):
            continue
        p, step = listed[name], float(solution.shared[index])
        most = abs(float(begin.model.values()[name]))
        weakest = float(np.exp(at.shared[index]) if p.logarithmic else at.shared[index])
        value = weakest * (1.0 + step) if p.logarithmic else weakest + p.scale * step
        if value < 0 and not effect.probe.either_sign:
            return -np.inf, begin
        value = float(np.clip(value, -_STRONGEST * most, _STRONGEST * most))
        shared[index] = np.log(max(value, _WEAK * most)) if p.logarithmic else value
    return gain, dataclasses.replace(begin, start=dataclasses.replace(begin.start, shared=shared))


def _strengths(effect: AbstractEffect) -> dict[str, bool]:
    """Every parameter of an effect by its name in the model, and whether it is a strength: whether it changes with the strength."""
    twice, once = effect.scaled(2.0), effect.scaled(1.0)
    return {f"{effect.name}.{p.name}": bool(getattr(twice, p.field) != getattr(once, p.field)) for p in effect.parameters}


def _carried(fitted: Fitted, extended: Problem) -> np.ndarray:
    """States of the fit among those of a problem with an effect more, which is at rest."""
    states = extended.start.states.copy()
    for place, name in enumerate(fitted.problem.unknowns.states):
        states[:, extended.unknowns.states.index(name)] = fitted.at.states[:, place]
    return states


def _own(fitted: Fitted, extended: Problem) -> np.ndarray:
    """The same of the records' own numbers."""
    own = extended.start.own.copy()
    for place, name in enumerate(fitted.problem.unknowns.own):
        own[:, extended.unknowns.own.index(name)] = fitted.at.own[:, place]
    return own


def probe_scales(fitted: Fitted) -> ProbeScales:
    """Scales of motion, force, time and frequency from which candidates derive their strengths and grids."""
    problem, records = fitted.problem, record_fits(fitted)
    experiment, model = problem.experiment, problem.model_at(fitted.at)
    speed = max(float(np.nanmax(np.abs(one.relative_velocity))) for one in records)
    force = max(float(np.nanmax(one.predicted["impact_force"])) for one in records)
    duration = np.nan
    if isinstance(model.law, AbstractCompliantLaw) and force > 0:
        duration = float(model.law.contact_time(jnp.asarray(float(model.mass)), jnp.asarray(speed)))
    channels = problem.chains.channels
    return ProbeScales(
        mass=float(model.mass),
        f_n=float(model.values().get("f_n", 0.0)),
        omega_exc=2 * np.pi * max((record.excitation_frequency or 0.0) for record in experiment.records),
        drives=tuple(sorted({2 * np.pi * r.excitation_frequency for r in experiment.records if r.excitation_frequency})),
        gaps={record.file: record.gap for record in experiment.records},
        clock={record.file: (float(record.time[0]), float(record.time[-1])) for record in experiment.records},
        contacts={one.file: tuple((float(one.time[i.first]), float(one.time[i.end - 1])) for i in impacts(one)) for one in records},
        channels=channels,
        noise={name: min(r.noise[name] for r in experiment.records if name in r.noise) for name in channels},
        amplitude=max(float(np.nanmax(np.abs(one.relative_displacement))) for one in records),
        lowest=min(float(np.nanmin(one.relative_displacement)) for one in records),
        speed=speed,
        force=force,
        deepest=max(0.0, *(float(np.nanmax(one.relative_displacement)) - one.gap for one in records)),
        contact_time=duration if np.isfinite(duration) else float("nan"),
        ceilings=_ceilings(experiment, channels),
        lines={name: tuple(_lines(records, name)) for name in channels},
        lags={},
        sampling=min(float(np.median(np.diff(record.time))) for record in experiment.records),
        law=model.law,
    )


def _ceilings(experiment: Experiment, channels: Sequence[str]) -> dict[str, float]:
    """Level at which each channel is cut off, where one is."""
    found = {}
    for name in channels:
        cut = [record.channels[name][at_ceiling(record.channels[name])] for record in experiment.records if name in record.channels]
        if any(len(one) for one in cut):
            found[name] = max(float(one.max()) for one in cut if len(one))
    return found


def _lines(records: Sequence[RecordFit], channel: str) -> Iterator[float]:
    """Strongest spectral lines in what the model leaves of a channel, Hz; of the longest record."""
    longest = max((one for one in records if channel in one.chi2_reduced), key=lambda one: len(one.time))
    left = np.nan_to_num(longest.measured[channel] - longest.predicted[channel])
    rate = 1.0 / float(np.median(np.diff(longest.time)))
    frequencies, power = periodogram(left, rate, nfft=max(1 << 17, len(left)))
    power = np.where(frequencies > _LOWEST_LINE_HZ, power, 0.0)
    for _ in range(_LINES):
        best = float(frequencies[np.argmax(power)])
        power = np.where(np.abs(frequencies - best) < _APART_HZ, 0.0, power)
        yield best
