"""Which further record would separate causes that the present ones do not, and by how many standard errors.

Free decays, drop tests and driven records are simulated with either cause. Their distance counts after everything that is not known has
made them as alike as it can: the parameters of both models within the covariances of their fits, and the new record's initial state,
drive and gap. Its errors are as large, and last as long, as those that the named model leaves in the present records.

Source: W. G. Hunter, A. M. Reiner, Designs for discriminating between two rival models, Technometrics 7 (1965) 307-323.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.signal import correlate

from identification.diagnosis.decide import IDENTIFIED
from identification.estimation.prediction import LANES, PERIODS
from identification.experiment import Experiment
from identification.guesses.motion import driving_channels
from identification.guesses.parameters import GAP_PRIOR_STD_M
from identification.result.result import RecordFit
from identification.trajectory.fit import Fitted
from identification.trajectory.motion import Estimate
from identification.trajectory.segments import not_shown
from identification.trajectory.start import Problem
from identification.wording.names import plain_name
from identification.wording.numbers import joined, significant, with_unit
from vibrojax.channels import channels
from vibrojax.compiling import soon_compiled
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS, Landing
from vibrojax.integrate.landing import flight_step
from vibrojax.model import Model

_FACTORS = (0.5, 0.8, 1.25, 2.0)
"""By which the amplitude, the frequency or the gap of a driven record is changed: what a rig most likely allows."""
_PERIODS = 12.0
"""Of the slower of suspension and drive in a record without impacts; behind many impacts small changes grow out of proportion."""
_UNKNOWN = 0.1
"""Standard deviation of a new record's initial state and amplitude over their size, and of its phase in rad, as one sets them by hand."""
_STEP = 0.01
"""Of the difference quotients, in standard deviations."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cause:
    """A fitted model with one cause in it, without its equations.

    Attributes:
        problem, at: as fitted.
        root: standard deviations of the shared parameters, in independent directions.
    """

    problem: Problem
    at: Estimate
    root: Float[np.ndarray, "parameters directions"]

    @classmethod
    def of(cls, fitted: Fitted) -> "Cause":
        """From a fit."""
        values, vectors = np.linalg.eigh(fitted.solution.covariance)
        values = np.minimum(values, 1.0)  # natural sizes: what is not identified stays near where it is
        root = fitted.problem.border.shared_scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return cls(problem=fitted.problem, at=fitted.at, root=root[:, values > 0.0])

    @property
    def is_of_any_record(self) -> bool:
        """Whether its effects act in a further record as in the present ones: none is at home in one, or has numbers of its own in each."""
        effects = self.problem.model.effects
        return not any(effect.record is not None or any(p.per_record for p in effect.parameters) for effect in effects)

    def models(self) -> list[Model]:
        """The model, and those a part of a standard deviation off in each direction, to the side that the bounds leave."""
        border, shared = self.problem.border, [self.at.shared]
        for step in _STEP * self.root.T:
            sides = [self.at.shared + step, self.at.shared - step]
            inside = [bool(np.all((one >= border.lower) & (one <= border.upper))) for one in sides]
            shared.append(sides[0] if inside[0] or not inside[1] else sides[1])
        limited = [np.clip(one, border.lower, border.upper) for one in shared]
        return [self.problem.model_at(dataclasses.replace(self.at, shared=one)) for one in limited]


class Proposal(NamedTuple):
    """A further record, SI: gap, drive, release of the hammer, how many periods of the slower vibration count; and its description."""

    gap: float
    amplitude: float
    frequency: float
    phase: float
    u: float
    v: float
    periods: float
    text: str

    def moved(self) -> list["Proposal"]:
        """The same record with its initial state, drive and gap a part of their standard deviations off, one by one."""
        part = _STEP * _UNKNOWN * max(self.amplitude, abs(self.u))
        return [
            self._replace(u=self.u - part),
            self._replace(v=self.v - 2.0 * np.pi * self.frequency * part),
            self._replace(amplitude=self.amplitude + (part if self.amplitude else 0.0)),
            self._replace(phase=self.phase + _STEP * _UNKNOWN),
            self._replace(gap=self.gap + _STEP * GAP_PRIOR_STD_M),
        ]


def next_experiment(experiment: Experiment, named: Cause, twins: Mapping[str, Cause], name: str, records: tuple[RecordFit, ...]) -> str:
    """The record that would best separate a named cause from all its twins, in a sentence; empty where none can be proposed.

    None can for a hammer without a spring, and for causes that act in one record, or differently in each.

    Args:
        experiment: as loaded.
        named: model with the cause that was named.
        twins: models with those that the records do not separate from it, by name.
        name: of the first cause.
        records: with their predictions by the named model.
    """
    twins = {twin: cause for twin, cause in twins.items() if cause.is_of_any_record}
    proposals, errors = list(_proposals(experiment, named, records)), _errors(experiment, records)
    if not proposals or not twins or not errors or not named.is_of_any_record:
        return ""
    sampling = float(np.median([np.median(np.diff(record.time)) for record in experiment.records]))
    distances = np.min([separation(proposals, named, twin, errors, sampling) for twin in twins.values()], axis=0)
    if not np.isfinite(distances).any():
        return ""
    best = int(np.nanargmax(distances))
    both = f"{plain_name(name)} from {joined([plain_name(one) for one in twins])}"
    farthest = float(distances[best])
    sigma = f"{significant(farthest, 2)} standard errors"
    if farthest < IDENTIFIED:
        return f"Of {len(proposals)} further records that were simulated none would separate {both} by more than {sigma}."
    return f"{proposals[best].text} would separate {both} by {sigma}."


def _proposals(experiment: Experiment, named: Cause, records: tuple[RecordFit, ...]) -> Iterator[Proposal]:
    """Free decays and drop tests from some amplitudes, and changes of the first driven record; none of a hammer without a spring."""
    f_n = named.problem.values(named.at).get("f_n", 0.0)
    largest = float(np.nan_to_num(np.abs(np.concatenate([one.relative_displacement for one in records]))).max())
    if not f_n > 0.0 or not largest > 0.0:
        return
    for factor in (0.5, 1.0, 2.0):
        u = -factor * largest
        yield Proposal(1e3 * largest, 0.0, f_n, 0.0, u, 0.0, _PERIODS, f"A free decay from {_millimetres(-u)} without impacts")
        for gap in sorted({one.gap for one in experiment.records if 0.0 <= one.gap < largest})[:2]:
            text = f"A drop test from {_millimetres(-u)} behind rest, with a gap of {_millimetres(gap)},"
            yield Proposal(gap, 0.0, f_n, 0.0, u, 0.0, PERIODS, text)
    for one in [one for one in records if any(n.name == "base_amplitude" for n in one.nuisances)][:1]:
        driven = next(record for record in experiment.records if record.file == one.file)
        amplitude, hz = next(n.value for n in one.nuisances if n.name == "base_amplitude"), driven.excitation_frequency or 0.0
        changes = [(a, 1.0, 1.0) for a in _FACTORS] + [(1.0, b, 1.0) for b in _FACTORS] + [(1.0, 1.0, c) for c in _FACTORS]
        for a, b, c in changes if hz > 0.0 and driven.gap >= 0.0 else ():
            drive = f"{with_unit(significant(b * hz), 'Hz')} from rest, with an amplitude of {_millimetres(a * amplitude)}"
            text = f"A record at {drive} and a gap of {_millimetres(c * driven.gap)},"
            yield Proposal(c * driven.gap, a * amplitude, b * hz, 0.0, 0.0, 0.0, PERIODS, text)


def _millimetres(value: float) -> str:
    return with_unit(significant(1e3 * value), "mm")


def _errors(experiment: Experiment, records: tuple[RecordFit, ...]) -> dict[str, tuple[float, float]]:
    """By channel that is compared: standard deviation of what the model leaves, and how many samples one independent error lasts."""
    left: dict[str, list[np.ndarray]] = {}
    for one in records:
        inputs = driving_channels(next(record for record in experiment.records if record.file == one.file))
        for channel in one.measured.keys() - inputs:
            error = one.measured[channel] - one.predicted[channel]
            kept = error[np.isfinite(error) & ~not_shown(channel, one.measured[channel])]
            left.setdefault(channel, []).extend([kept] if len(kept) else [])
    return {
        channel: (
            float(np.sqrt(np.mean(np.concatenate(errors) ** 2))),
            float(np.average([_lasting(e) for e in errors], weights=[*map(len, errors)])),
        )
        for channel, errors in left.items()
        if errors and np.concatenate(errors).any()
    }


def _lasting(error: Float[np.ndarray, " samples"]) -> float:
    """Samples that one independent error lasts: the integral of the autocorrelation up to where it first vanishes."""
    products = correlate(error, error, method="fft")[len(error) - 1 :]
    until = int(np.argmax(products <= 0.0)) or len(products)
    return float(2.0 * products[:until].sum() / max(products[0], 1e-300) - 1.0)


def separation(
    proposals: list[Proposal], named: Cause, twin: Cause, errors: Mapping[str, tuple[float, float]], sampling: float
) -> Float[np.ndarray, " proposals"]:
    """Standard errors by which each record separates two causes; NaN where a motion cannot be integrated.

    Args:
        proposals: the records.
        named: one cause.
        twin: the other one.
        errors: by channel, standard deviation and samples that one independent error lasts.
        sampling: interval between samples, s.
    """
    f_n = named.problem.values(named.at)["f_n"]
    every = max(1, int(np.ceil(_PERIODS / f_n / sampling / 8000)))  # samples at most: a longer record is thinned
    time = every * sampling * np.arange(int(_PERIODS / f_n / (every * sampling)))
    per_error = {channel: std * np.sqrt(max(lasting / every, 1.0)) for channel, (std, lasting) in errors.items()}
    a, b = (_simulated(one.models(), proposals, per_error, time) for one in (named, twin))
    changed = [each for one in proposals for each in one.moved()]
    moved = _simulated(named.models()[:1], changed, per_error, time).reshape(len(proposals), -1, a.shape[-1]).swapaxes(0, 1)
    slopes = np.concatenate([a[1:] - a[0], b[1:] - b[0], moved - a[0]]) / _STEP
    found = np.full(len(proposals), np.nan)
    for place, (one, distance) in enumerate(zip(proposals, a[0] - b[0], strict=True)):
        counted = np.tile(time < one.periods / min(one.frequency, f_n), len(errors))
        slope, distance = slopes[:, place, counted], distance[counted]
        if np.isfinite(slope).all() and np.isfinite(distance).all():
            across = slope @ distance
            residual = distance @ distance - across @ np.linalg.solve(slope @ slope.T + np.eye(len(across)), across)
            found[place] = np.sqrt(max(residual, 0.0))
    return found


def _simulated(
    models: Sequence[Model], proposals: Sequence[Proposal], per_error: Mapping[str, float], time: np.ndarray
) -> Float[np.ndarray, "models proposals values"]:
    """Readings in every record, each channel over its error and one behind the other."""
    systems, states = [], []
    for model in models:
        for one in proposals:
            base = Harmonic(base_amplitude=one.amplitude, base_phase=one.phase, frequency_hz=one.frequency)
            systems.append(model.in_record(lambda file: 0.0).system(gap=one.gap, base=base, applied=Unforced()))
            states.append([one.u, one.v] + [0.0] * systems[-1].own_size)
    fastest = max(float(models[0].values()["f_n"]), *(one.frequency for one in proposals))
    step = float(flight_step(models[0].effects, fastest, a_period=60.0, an_own_period=24.0))
    capacity = 1000 * int(np.ceil((2.0 * time[-1] / step + 100.0 * fastest * time[-1] * 2.0) / 1000 + 1))
    integrator = Landing(flight_step=jnp.asarray(step), most_steps=min(capacity, 100_000))  # memory
    stacked = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf, float) for leaf in leaves]), *systems)
    found = []
    for begin in range(0, len(systems), LANES):
        lanes = np.resize(np.arange(begin, min(begin + LANES, len(systems))), LANES)
        part = jax.tree.map(lambda leaf, lanes=lanes: jnp.asarray(leaf[lanes]), stacked)
        readings, result = _readings(integrator, part, jnp.asarray(time), jnp.asarray(np.array(states)[lanes]))
        values = np.concatenate([np.asarray(readings[channel]) / error for channel, error in per_error.items()], axis=1)
        found.append(np.where(np.asarray(result)[:, None] == SUCCESS, values, np.nan)[: len(systems) - begin])
    return np.concatenate(found).reshape(len(models), len(proposals), -1)


@soon_compiled
def _readings(integrator, systems, time, states):
    times = jnp.broadcast_to(time, (len(states), len(time)))
    path = integrator.batch(systems, times, states, jnp.full(len(states), len(time)))
    lanes = dataclasses.replace(path, steps=jnp.broadcast_to(path.steps, path.result.shape))
    return jax.vmap(channels)(systems, lanes), path.result
