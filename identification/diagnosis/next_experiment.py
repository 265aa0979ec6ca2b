"""Which further record would tell causes apart that the present ones do not separate, and by how many standard errors.

Records that the rig can make are simulated with either cause in the model. Their distance counts after everything that is not known has
made them as alike as it can: the parameters of both models within the covariances of their fits, the new record's initial state and its
drive. Errors of the new record are as large, and last as long, as those that the named model leaves in the present records.

Source: W. G. Hunter, A. M. Reiner, Designs for discriminating between two rival models, Technometrics 7 (1965) 307-323.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from identification.experiment import Experiment
from identification.result.result import RecordFit
from identification.trajectory.fit import Fitted
from identification.trajectory.motion import Estimate
from identification.trajectory.start import Problem
from identification.wording.names import plain_name
from identification.wording.numbers import joined, significant, with_unit
from vibrojax.channels import channels
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS
from vibrojax.integrate.landing import landing_for
from vibrojax.model import Model

_FACTORS = (0.5, 0.8, 1.25, 2.0)
"""By which amplitude, frequency, gap and release are changed."""
_PERIODS, _SAMPLES = 12, 1200
"""Length of a new record, in periods of the slower of suspension and drive, and the samples that are compared."""
_FLIGHT_STEPS = 60
"""In a period of the fastest vibration."""
_CLEAR = 1e3
"""Gap of a record without impacts, over the largest displacement."""
_UNKNOWN = 0.1
"""Standard deviation of a new record's initial state and drive, over their size."""
_STEP = 0.1
"""Of the difference quotients, in standard deviations."""
_SEPARATED, _FAR = 3.0, 100.0
"""Standard errors from which two causes are told apart, and beyond which their number says no more."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cause:
    """A fitted model with one cause in it, without its equations.

    Attributes:
        problem, at: as fitted.
        root: standard deviations of the shared parameters, in independent directions; (parameters, directions).
    """

    problem: Problem
    at: Estimate
    root: np.ndarray

    @classmethod
    def of(cls, fitted: Fitted) -> "Cause":
        """From a fit."""
        values, vectors = np.linalg.eigh(fitted.solution.covariance)
        values = np.minimum(values, 1.0)  # natural sizes: what is not identified stays near where it is
        root = fitted.problem.border.shared_scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return cls(problem=fitted.problem, at=fitted.at, root=root[:, values > 0.0])

    def models(self) -> list[Model]:
        """The model, and those a part of a standard deviation off in each direction."""
        border = self.problem.border
        shared = [self.at.shared, *(self.at.shared + _STEP * self.root.T)]
        moved = [dataclasses.replace(self.at, shared=np.clip(one, border.lower, border.upper)) for one in shared]
        return [self.problem.model_at(one) for one in moved]


class Wish(NamedTuple):
    """A further record: gap, amplitude and frequency of the cart, release of the hammer, SI; and its description."""

    gap: float
    amplitude: float
    frequency: float
    u: float
    v: float
    text: str

    def moved(self) -> list["Wish"]:
        """The same record with its initial state, and its drive, a part of their standard deviation off."""
        part = _STEP * _UNKNOWN * max(self.amplitude, abs(self.u))
        drive = self._replace(amplitude=self.amplitude + part) if self.amplitude else self
        return [self._replace(u=self.u + part), self._replace(v=self.v + 2.0 * np.pi * self.frequency * part), drive]


def next_experiment(experiment: Experiment, named: Cause, twins: Mapping[str, Cause], name: str, records: tuple[RecordFit, ...]) -> str:
    """The record that would best tell a named cause from all its twins, in a sentence; empty where no record can be thought of.

    Args:
        experiment: as loaded.
        named: model with the cause that was named.
        twins: models with those that the records do not separate from it, by name.
        name: of the first cause.
        records: with their predictions by the named model.
    """
    wishes, errors = list(_wishes(experiment, named, records)), _errors(records)
    if not wishes or not twins or not errors:
        return ""
    apart = np.min([_separation(wishes, named, twin, errors) for twin in twins.values()], axis=0)
    if not np.isfinite(apart).any():
        return ""
    best = int(np.nanargmax(apart))
    both = f"{plain_name(name)} from {joined([plain_name(one) for one in twins])}"
    sigma = f"{significant(float(apart[best]), 2)} standard errors" if apart[best] < _FAR else f"more than {_FAR:g} standard errors"
    if apart[best] < _SEPARATED:
        return f"Of {len(wishes)} further records that were simulated none would tell {both} by more than {sigma}."
    return f"{wishes[best].text} would tell {both} by {sigma}."


def _wishes(experiment: Experiment, named: Cause, records: tuple[RecordFit, ...]) -> Iterator[Wish]:
    """Records with another drive, gap or release than the present ones; none of a hammer without a spring."""
    f_n = named.problem.values(named.at).get("f_n", 0.0)
    largest = max(float(np.nanmax(np.abs(one.relative_displacement))) for one in records)
    if not f_n > 0.0 or not largest > 0.0:
        return
    for factor in (1.0, *_FACTORS):
        u = -factor * largest
        yield Wish(_CLEAR * largest, 0.0, f_n, u, 0.0, f"A free decay from {_metres(-u)} without impacts")
        for gap in sorted({one.gap for one in experiment.records if one.gap < largest}):
            yield Wish(gap, 0.0, f_n, u, 0.0, f"A drop test from {_metres(-u)} behind rest, with a gap of {_metres(gap)},")
    for one in [one for one in records if any(n.name == "base_amplitude" for n in one.nuisances)][:1]:
        driven = next(record for record in experiment.records if record.file == one.file)
        amplitude, hz = next(n.value for n in one.nuisances if n.name == "base_amplitude"), driven.excitation_frequency or 0.0
        changes = [(a, b, 1.0) for a in (1.0, *_FACTORS) for b in (1.0, *_FACTORS[1:3])] + [(1.0, 1.0, c) for c in _FACTORS]
        for a, b, c in changes[1:]:
            wish = Wish(c * driven.gap, a * amplitude, b * hz, 0.0, 0.0, "")
            drive = f"{with_unit(significant(wish.frequency), 'Hz')}, with an amplitude of {_metres(wish.amplitude)}"
            yield wish._replace(text=f"A record at {drive} and a gap of {_metres(wish.gap)},")


def _metres(value: float) -> str:
    return with_unit(significant(1e3 * value), "mm")


def _errors(records: tuple[RecordFit, ...]) -> dict[str, tuple[float, float]]:
    """By channel: standard deviation of what the model leaves, and independent errors in a second."""
    found = {}
    for channel in {name for one in records for name in one.measured}:
        left = [one.measured[channel] - one.predicted[channel] for one in records if channel in one.measured]
        seconds = sum(float(one.time[-1] - one.time[0]) for one in records if channel in one.measured)
        turns = sum(int(np.sum(e[:-1] * e[1:] < 0.0)) for e in left)
        std = float(np.sqrt(np.nanmean(np.concatenate(left) ** 2)))
        if std > 0.0 and turns:
            found[channel] = (std, 2.0 * turns / seconds)  # white errors change their sign from every second sample to the next
    return found


def _separation(wishes: list[Wish], named: Cause, twin: Cause, errors: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """Standard errors by which each record tells two causes apart; NaN where a motion cannot be integrated; (wishes,)."""
    a, b = (_simulated(one.models(), wishes, errors) for one in (named, twin))
    moved = [_simulated(named.models()[:1], records, errors)[0] for records in zip(*(wish.moved() for wish in wishes), strict=True)]
    columns = np.concatenate([a[1:] - a[0], b[1:] - b[0], moved - a[0]]) / _STEP
    found = np.full(len(wishes), np.nan)
    for place, apart in enumerate(a[0] - b[0]):
        known = columns[:, place]
        if np.isfinite(known).all() and np.isfinite(apart).all():
            across = known @ apart
            left = apart @ apart - across @ np.linalg.solve(known @ known.T + np.eye(len(across)), across)
            found[place] = np.sqrt(max(left, 0.0))
    return found


def _simulated(models: Sequence[Model], wishes: Sequence[Wish], errors: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """Readings in every record, each channel over its standard error and side by side; (models, wishes, channels samples)."""
    pairs = [(model, wish) for model in models for wish in wishes]
    f_n = float(models[0].values()["f_n"])
    systems, times, states = [], [], []
    for model, wish in pairs:
        base = Harmonic(base_amplitude=wish.amplitude, base_phase=0.0, frequency_hz=wish.frequency)
        systems.append(model.in_record(lambda file: 0.0).system(gap=wish.gap, base=base, applied=Unforced()))
        times.append(np.linspace(0.0, _PERIODS / min(wish.frequency, f_n), _SAMPLES))
        states.append([wish.u, wish.v] + [0.0] * systems[-1].own_size)
    fastest = max(f_n, *(wish.frequency for wish in wishes))
    integrator = landing_for(models[0].effects, fastest, flight_steps=_FLIGHT_STEPS)
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf, float) for leaf in leaves]), *systems)
    readings, result = _readings(integrator, stacked, jnp.asarray(np.stack(times)), jnp.asarray(np.array(states)))
    length = np.array([time[-1] for time in times])[:, None]
    weighed = [np.asarray(readings[name]) / std * np.sqrt(rate * length / _SAMPLES) for name, (std, rate) in errors.items()]
    found = np.where(np.asarray(result)[:, None] == SUCCESS, np.concatenate(weighed, axis=1), np.nan)
    return found.reshape(len(models), len(wishes), -1)


@eqx.filter_jit
def _readings(integrator, systems, times, states):
    path = integrator.batch(systems, times, states, jnp.full(len(times), times.shape[1]))
    lanes = dataclasses.replace(path, steps=jnp.broadcast_to(path.steps, path.result.shape))
    return jax.vmap(channels)(systems, lanes), path.result
