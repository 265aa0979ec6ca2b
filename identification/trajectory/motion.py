"""Motion through a segment and its derivatives: the only place of a fit that integrates.

z_(k+1) = phi_k(z_k, f_k, f_(k+1); theta, nu) with the random force linear from f_k to f_(k+1), and the readings of every channel at the
samples in between. Segments are short, so that none diverges, whatever the parameters.
"""

import dataclasses
import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from identification.trajectory.segments import APPROACH_SPEED, OF_RECORD, Chains, Segments, Unknowns
from vibrojax.channels import channels
from vibrojax.compiling import soon_compiled
from vibrojax.excitation import Harmonic, PiecewiseLinearForce, Unforced
from vibrojax.integrate import Landing, Trajectory
from vibrojax.integrate.landing import SLOWEST_TOUCH
from vibrojax.model import Model
from vibrojax.system import System

CHUNK = 256
"""Segments that are integrated side by side."""
STEEPEST = 1e3
"""Largest derivative of a segment's end by its beginning, in natural sizes, that a linearisation may have: beyond, a touch grazes."""
_STEPS_A_SAMPLE = 200
"""Limit to the steps between two samples; a segment that needs more has not been integrated."""


class Passed(NamedTuple):
    """What segments give: readings at their samples, and the states at their ends."""

    readings: Float[Array, "segments samples channels"]
    end: Float[Array, "segments states"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Linearised:
    """All segments about an estimate, in their order, readings over the noise.

    Attributes:
        residual: predicted less measured; (segments, samples, channels), 0 where nothing counts.
        by: derivative of the residual by states, force at both ends, shared and own unknowns; (segments, samples, channels, columns).
        end: states at the end of each segment; (segments, states).
        end_by: their derivative; (segments, states, columns).
        done: whether a segment was integrated; (segments,).
    """

    residual: np.ndarray
    by: np.ndarray
    end: np.ndarray
    end_by: np.ndarray
    done: np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Estimate:
    """A point: states and random force at every knot, shared and own unknowns.

    Attributes:
        states: (knots, states), SI.
        force: (knots,), N.
        shared: (parameters,), logarithm or SI.
        own: (records, own), SI.
    """

    states: np.ndarray
    force: np.ndarray
    shared: np.ndarray
    own: np.ndarray


def segment_system(model: Model, unknowns: Unknowns, files: tuple[str, ...], one: Segments, vector: Float[Array, " columns"]) -> System:
    """The rig in one segment; or in several of equal length in a row, where the vector holds the force at all their knots."""
    states, border = len(unknowns.states), len(unknowns.shared) + len(unknowns.own)
    force, shared, own = jnp.split(vector[states:], [len(vector) - states - border, len(vector) - states - len(unknowns.own)])
    mine = dict(zip(unknowns.own, own, strict=True))
    values = {}
    for (name, logarithmic), value in zip(unknowns.shared, shared, strict=True):
        value = value + mine.get(f"variation.{name}", 0.0)
        values[name] = jnp.exp(value) if logarithmic else value
    for name, logarithmic in zip(unknowns.own, unknowns.logarithmic_own, strict=True):
        if name not in OF_RECORD and not name.startswith(("zero.", "variation.")):
            values[name] = jnp.exp(mine[name]) if logarithmic else mine[name]
    base = one.motion
    if base is None:
        sine, cosine = mine["base_sine"], mine["base_cosine"]
        still = (sine == 0.0) & (cosine == 0.0)
        safe = jnp.where(still, 1.0, sine)
        amplitude = jnp.where(still, 0.0, jnp.hypot(safe, cosine))
        base = Harmonic(base_amplitude=amplitude, base_phase=jnp.arctan2(cosine, safe), frequency_hz=one.frequency_hz)
    beside = Unforced() if one.applied is None else one.applied
    applied = PiecewiseLinearForce(start=one.ts[0], spacing=(one.ts[-1] - one.ts[0]) / (len(force) - 1), values=force, beside=beside)

    def acts(file: str) -> Float[Array, ""] | float:
        return jnp.where(one.record == files.index(file), 1.0, 0.0) if file in files else 0.0

    return model.replace(values).in_record(acts).system(gap=one.gap + mine["gap_error"], base=base, applied=applied)


def read(
    unknowns: Unknowns, one: Segments, system: System, along: Trajectory, vector: Float[Array, " columns"]
) -> Float[Array, "samples channels"]:
    """What the sensors read along a motion, with their zeros."""
    readings = channels(system, along)
    for name, value in zip(unknowns.own, vector[len(vector) - len(unknowns.own) :], strict=True):
        if name.startswith("zero."):
            readings[name[5:]] = readings[name[5:]] + value
    return jnp.stack([readings[name] for name in one.channels], axis=-1)


def passed(
    model: Model,
    unknowns: Unknowns,
    files: tuple[str, ...],
    integrator: Landing,
    segments: Segments,
    vectors: Float[Array, "segments columns"],
):
    """Readings and ends of segments, and beside them, without derivative, whether each was integrated."""
    systems = jax.vmap(lambda one, vector: segment_system(model, unknowns, files, one, vector))(segments, vectors)
    held = unknowns.states[-1] == APPROACH_SPEED
    integrated = len(unknowns.states) - held
    start = integrator.start(systems, segments.ts, vectors[:, :integrated])
    if held:
        start = start._replace(approach_speed=jnp.maximum(vectors[:, integrated], SLOWEST_TOUCH))

    def unfinished(loop):
        count, carry, t_end = loop
        return (count < _STEPS_A_SAMPLE) & jnp.any((carry.t < t_end) & jnp.isfinite(carry.u))

    def sample(carry, t_end):
        def advance(loop):
            count, carry, _ = loop
            return count + 1, jax.vmap(integrator.step)(systems, t_end, carry), t_end

        _, after, _ = lax.while_loop(unfinished, advance, (jnp.zeros((), int), carry, t_end))
        return after, (carry.u, carry.v, carry.in_contact, carry.approach_speed, carry.own)

    last, (u, v, in_contact, approach_speed, own) = lax.scan(sample, start, segments.ts[:, 1:].T)
    ts, none = segments.ts[:, :-1], jnp.zeros(len(segments.ts), int)
    along = Trajectory(ts, u.T, v.T, in_contact.T, approach_speed.T, none, jnp.zeros((), int), jnp.swapaxes(own, 0, 1))
    lanes = eqx.tree_at(lambda one: one.steps, along, none)
    stacked = jax.vmap(lambda one, system, along, vector: read(unknowns, one, system, along, vector))(segments, systems, lanes, vectors)
    end = jnp.concatenate([jnp.stack([last.u, last.v], axis=1), last.own], axis=1)
    if held:
        end = jnp.concatenate([end, last.approach_speed[:, None]], axis=1)
    done = jnp.all(jnp.isfinite(end), axis=1) & (last.t >= segments.ts[:, -1])
    return Passed(stacked, end), done


@soon_compiled
def _derivatives(model, unknowns, files, integrator, segments, vectors):
    """`passed` with its derivative by every column of the vectors: one forward sweep with as many tangents."""

    def along(direction):
        function = lambda moved: passed(model, unknowns, files, integrator, segments, moved)  # noqa: E731
        return jax.jvp(function, (vectors,), (jnp.broadcast_to(direction, vectors.shape),), has_aux=True)

    value, by, beside = jax.vmap(along, out_axes=(None, -1, None))(jnp.eye(unknowns.columns))
    return value, by, beside


def vectors_of(chains: Chains, at: Estimate) -> Float[np.ndarray, "segments columns"]:
    """What each segment depends on."""
    shared = np.broadcast_to(at.shared, (len(chains.left), len(at.shared)))
    force = np.stack([at.force[chains.left], at.force[chains.left + 1]], axis=1)
    return np.concatenate([at.states[chains.left], force, shared, at.own[chains.record]], axis=1)


def linearise(
    model: Model, unknowns: Unknowns, chains: Chains, integrator: Landing, at: Estimate, sizes: Float[np.ndarray, " states"]
) -> Linearised:
    """Integrate every segment from its knot, with derivatives; one that cannot be integrated, or that is too steep, has no weight.

    `sizes` are natural ones of the states.
    """
    vectors, model = vectors_of(chains, at), jax.tree.map(jnp.asarray, model)
    count, samples, states = len(chains.left), chains.samples, len(unknowns.states)
    residual = np.zeros((count, samples, len(chains.channels)))
    by, end, end_by = np.zeros((*residual.shape, unknowns.columns)), np.zeros((count, states)), np.zeros((count, states, unknowns.columns))
    done = np.zeros(count, bool)

    def run(chunk: Segments):
        found = _derivatives(model, unknowns, chains.files, integrator, chunk, jnp.asarray(vectors[chunk.place]))
        return chunk.place, jax.tree.map(np.asarray, found)

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for place, (value, slope, fine) in threads.map(run, _chunks(chains, at)):
            fine = fine & np.isfinite(slope.end).all(axis=(1, 2)) & np.isfinite(slope.readings).all(axis=(1, 2, 3))
            steepness = np.abs(slope.end[:, :, : len(sizes)]) * sizes / sizes[:, None]
            fine &= np.nan_to_num(steepness, nan=np.inf).max(axis=(1, 2)) < STEEPEST
            usable = chains.weight[place] * fine[:, None, None]
            counts = usable > 0
            residual[place] = np.where(counts, (np.where(counts, value.readings, 0.0) - chains.measured[place]) * usable, 0.0)
            by[place] = np.where(counts[..., None], slope.readings, 0.0) * usable[..., None]
            end[place], end_by[place] = np.where(fine[:, None], value.end, 0.0), np.where(fine[:, None, None], slope.end, 0.0)
            done[place] = fine
    return Linearised(residual=residual, by=by, end=end, end_by=end_by, done=done)


def _chunks(chains: Chains, at: Estimate):
    """Segments in chunks of one size, those nearest to the stop together, since contact takes more steps than flight."""
    for group in chains.groups:
        u = at.states[chains.left[group.place], 0]
        order = np.argsort(u - group.gap, kind="stable")
        for begin in range(0, len(order), CHUNK):
            rows = np.resize(order[begin : begin + CHUNK], CHUNK)
            yield jax.tree.map(lambda leaf, rows=rows: leaf[rows], group)
