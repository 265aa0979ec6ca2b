"""Design of a further record that separates alternatives which the present records do not."""

import dataclasses
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from identification.diagnosis.errors import errors
from identification.diagnosis.search.forward import Search
from identification.experiment import Record
from identification.least_squares.fit import as_arrays, landing_for
from identification.least_squares.residual import predict
from identification.likelihood.fitted import Fitted
from identification.windows.lanes import Inputs, lane
from identification.windows.layout import BASE_AMPLITUDE, NUISANCES, STATES
from identification.windows.windows import Windows
from vibrojax.compiling import soon_compiled
from vibrojax.effects import EFFECTS
from vibrojax.integrate import Landing

_NO_RECORD = -1
"""Index of a record not yet taken: effects confined to one record do not act there."""
_SECONDS, _PERIODS = 1.0, 10.0
"""Length of a trial record, s, or in periods of f_n if that is shorter: longer motions with impacts diverge and separate nothing."""
_SAMPLES = 2000
_FAR = 50.0
"""Separation in sigma reported at most."""
_UNSURE = {"base_amplitude": 1e-3, "base_phase": 1.0, "gap_error": 1e-3, "initial_displacement": 1e-3, "initial_velocity": 0.1}
"""Prior standard deviations, SI, of the numbers that the new record would have to identify itself."""
_STEP = 1e-3
"""Step of the central differences, over these standard deviations."""


def next_experiment(found: Search, ambiguous: tuple[str, ...]) -> str:
    """One sentence on the record that separates the chosen model from an alternative best; empty without an alternative.

    It is also empty where a machine prescribes the motion. Both models, each fitted to the present records, predict trial records: other
    release heights, slower, faster and stronger drives. Their separation in units of the noise is d' (I + J C J')^-1 d: d is the difference
    of the predictions, J the Jacobian of the first model, C the covariance of its parameters, with the new record's own unknowns free.
    """
    pair = _doubt(found, ambiguous)
    if pair is None:
        return ""
    first, second = pair
    if all(record.kind == "prescribed" for record in first.prepared.experiment.records):
        return ""
    best = max(((_sigma(first, second, record), words) for record, words in _trials(first)), default=(0.0, ""))
    if best[0] < 1.0:
        return f"No simple further record would separate {_words(first)} and {_words(second)}."
    parted = f"by more than {_FAR:.0f} sigma" if best[0] > _FAR else f"by {best[0]:.0f} sigma"
    return f"A {best[1]} would separate {_words(first)} and {_words(second)} {parted}."


def _doubt(found: Search, ambiguous: tuple[str, ...]) -> tuple[Fitted, Fitted] | None:
    """The chosen model and an alternative that these records do not separate from it; None without one."""
    for one in found.steps:
        for alternative in one.alternatives[1:]:
            if alternative.name in ambiguous:
                return one.alternatives[0].fitted, alternative.fitted
    return None


def _words(fitted: Fitted) -> str:
    return EFFECTS[fitted.names[-1]].summary if fitted.names[-1] in EFFECTS else fitted.names[-1]


def _trials(fitted: Fitted) -> Iterator[tuple[Record, str]]:
    """Trial records, each with a description."""
    f_n = float(fitted.model.values().get("f_n", 0.0))
    time = np.arange(_SAMPLES) / _SAMPLES * (min(_SECONDS, _PERIODS / f_n) if f_n > 0 else _SECONDS)
    amplitude = float(np.abs(fitted.estimate.nuisances[:, BASE_AMPLITUDE]).max(initial=0.0))
    lowest = min((float(motion.u.min()) for motion in fitted.prepared.motions if motion is not None), default=-1e-3)
    still = Record(file="trial", kind="drop-test", gap=0.0, time=time, initial_displacement=0.0, initial_velocity=0.0, base_amplitude=0.0)
    for factor in (0.5, 2.0):
        height = factor * lowest
        yield dataclasses.replace(still, initial_displacement=height), f"drop from {-1e3 * height:.3g} mm"
        free = dataclasses.replace(still, kind="free-decay", gap=10.0 * abs(height), initial_displacement=height)
        yield free, f"free decay from {-1e3 * height:.3g} mm, clear of the stop"
    if amplitude > 0 and f_n > 0:
        for ratio in (0.7, 1.0, 1.5, 3.0):
            for stronger in (1.0, 2.0):
                drive = stronger * amplitude
                record = dataclasses.replace(
                    still,
                    kind="cart-excitation",
                    gap=2.0 * amplitude,
                    excitation_frequency=ratio * f_n,
                    base_amplitude=drive,
                    initial_velocity=-drive * 2.0 * np.pi * ratio * f_n,
                )
                yield record, f"drive of {1e3 * drive:.3g} mm at {ratio * f_n:.4g} Hz with a gap of {2e3 * amplitude:.3g} mm"


def _sigma(first: Fitted, second: Fitted, record: Record) -> float:
    """Difference of two predictions that the first model cannot absorb within its errors, in standard deviations of the noise."""
    center, directions = _vector(first, record), _known(first)
    with np.errstate(over="ignore", invalid="ignore"):
        one = _shown(first, record, np.concatenate([center[None], center + _STEP * directions, center - _STEP * directions]))
        (other,) = _shown(second, record, _vector(second, record)[None])
    count = len(directions)
    difference, jacobian = other - one[0], (one[1 : 1 + count] - one[1 + count :]) / (2.0 * _STEP)
    if not (np.all(np.isfinite(difference)) and np.all(np.isfinite(jacobian))):
        return 0.0
    onto = jacobian @ difference
    taken_up = onto @ np.linalg.solve(np.eye(count) + jacobian @ jacobian.T, onto)
    return float(np.sqrt(max(difference @ difference - taken_up, 0.0)))


def _vector(fitted: Fitted, record: Record) -> np.ndarray:
    """Vector of unknowns of a trial record: fitted shared parameters, drive and initial state as planned."""
    layout, estimate = fitted.prepared.layout, fitted.estimate
    nuisances = np.zeros(estimate.nuisances.shape[1])
    nuisances[BASE_AMPLITUDE] = record.base_amplitude or 0.0
    begin = np.zeros(layout.states)
    begin[: len(STATES)] = record.initial_displacement or 0.0, record.initial_velocity or 0.0
    return np.concatenate([estimate.shared, nuisances, begin])


def _known(fitted: Fitted) -> np.ndarray:
    """(directions, size): independent directions of the first model's uncertainty, one standard deviation each."""
    layout = fitted.prepared.layout
    covariance = errors(fitted).covariance[: layout.shared, : layout.shared]
    values, vectors = np.linalg.eigh(covariance)
    moves = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    shared = np.concatenate([moves, np.zeros((len(moves), layout.size - layout.shared))], axis=1)
    zeros = range(layout.shared + len(NUISANCES), layout.shared + layout.without_effects)
    begin = layout.size - layout.states
    unsure = {layout.shared + place: _UNSURE[name] for place, name in enumerate(NUISANCES)}
    unsure |= dict.fromkeys(zeros, 1.0) | {begin + place: _UNSURE[name] for place, name in enumerate(STATES)}
    own = np.zeros((len(unsure), layout.size))
    own[np.arange(len(unsure)), list(unsure)] = list(unsure.values())
    return np.concatenate([shared, own])


def _shown(fitted: Fitted, record: Record, local: np.ndarray) -> np.ndarray:
    """(vectors, time * channels): predicted channels over their noise, one row per vector of unknowns."""
    experiment, coarse = fitted.prepared.experiment, landing_for(fitted.prepared)
    noise = {name: value for one in experiment.records for name, value in one.noise.items()}
    samples = len(record.time)
    window = lane(_NO_RECORD, record, 0, samples, samples, Inputs())
    windows = jax.tree.map(lambda leaf: jnp.broadcast_to(jnp.asarray(leaf), (len(local), *np.shape(leaf))), window)
    steps = 4 * (float(record.time[-1]) / float(coarse.flight_step) + 20 * float(coarse.contact_steps))
    integrator = dataclasses.replace(coarse, most_steps=512 * int(np.ceil(steps / 512)))
    found = np.asarray(_predicted(as_arrays(fitted.prepared.model), fitted.prepared.layout, integrator, windows, jnp.asarray(local)))
    columns = [index for index, name in enumerate(windows.channels) if name in noise]
    scale = np.array([noise[windows.channels[index]] for index in columns])
    return (found[:, :, columns] / scale).reshape(len(local), -1)


@soon_compiled
def _predicted(model, layout, integrator: Landing, windows: Windows, local):
    """Compiled `predict`, channels only; NaN where the integration failed."""
    shown, trajectory = predict(model, layout, integrator, windows, local)
    return jnp.where((trajectory.result == 0)[:, None, None], shown, jnp.nan)
