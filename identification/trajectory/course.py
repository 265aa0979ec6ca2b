"""Motion along a record by samples: where effects that the model leaves out would act, and what their forces would do.

A force, a shift of the stop and an addition to a reading are the three ways in which something left out reaches the readings. The chain is
linearised from sample to sample, so that each of them, as a signal in time, gives the change of all readings and of the ends of segments.
"""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from identification.guesses.motion import inputs_of
from identification.trajectory.fit import Fitted
from identification.trajectory.motion import CHUNK, Estimate, homes, linearise, travelled, vectors_of
from identification.trajectory.remodel import late_channels
from identification.trajectory.segments import APPROACH_SPEED, VARIATION, Chains, chains_of
from identification.trajectory.start import Problem
from vibrojax.channels import recorded
from vibrojax.compiling import soon_compiled
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import Motion
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.system import System


class Course(eqx.Module):
    """The estimated motion along one record; (time,) each."""

    motion: Motion
    acceleration: Float[Array, " time"]
    """x'', m/s^2."""
    push: Float[Array, " time"]
    """Of the stop in front, N."""
    push_rate: Float[Array, " time"]
    """Derivative of the push by the rate of indentation, N s/m; 0 for a rigid stop."""
    readings: dict[str, Float[Array, " time"]]
    """Of every channel, by the model."""
    system: System
    """The rig in this record, without effects."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BySample:
    """Derivatives from sample to sample: state and readings by the state, the force at both ends of the interval, and the stop's place.

    Attributes:
        readings_by: readings over the noise by state, force here and there, stop; (segments, samples, channels, states + 3).
        next_by: state at the next sample by the same; (segments, samples, states, states + 3).
    """

    readings_by: np.ndarray
    next_by: np.ndarray


@soon_compiled
def _along(model, unknowns, files, integrator, segments, vectors):
    systems, lanes, _ = travelled(model, unknowns, files, integrator, segments, vectors)
    forces = jax.vmap(lambda system, one: system.forces(one.ts, one.u, one.v, one.own, one.in_contact, one.approach_speed))(systems, lanes)
    motion = jax.vmap(lambda system, one: system.motion(one.ts, one.u, one.v, one.own, one.in_contact))(systems, lanes)
    readings, own = jax.vmap(recorded)(systems, lanes)
    states = jnp.concatenate([lanes.u[..., None], lanes.v[..., None], own], axis=-1)
    push_rate = jax.vmap(_push_rate)(systems, motion, lanes.approach_speed)
    return states, motion, forces.absolute, forces.push, push_rate, lanes.approach_speed, readings


def _push_rate(system: System, motion: Motion, approach_speed):
    law = system.law
    if not isinstance(law, AbstractCompliantLaw):
        return jnp.zeros_like(motion.u)
    depth = jnp.maximum(motion.indentation, 0.0)
    found = jax.jvp(lambda rate: law.force(depth, rate, approach_speed), (motion.indentation_rate,), (jnp.ones_like(depth),))[1]
    return jnp.where(motion.in_contact, found, 0.0)


def courses(fitted: Fitted) -> tuple[tuple[Course, ...], Float[np.ndarray, "segments knots states"]]:
    """The motion along every record, all padded to the longest with its last values; and states at all samples and ends of segments."""
    problem, at = fitted.problem, fitted.at
    chains, model = problem.chains, jax.tree.map(np.asarray, problem.model_at(at))
    vectors, found = vectors_of(chains, at), []
    for group in chains.groups:
        for begin in range(0, len(group.place), CHUNK):
            rows = np.resize(np.arange(len(group.place))[begin : begin + CHUNK], CHUNK)
            chunk = jax.tree.map(lambda leaf, rows=rows: leaf[rows], group)
            parts = _along(model, problem.unknowns, homes(model, chains.files), problem.integrator, chunk, vectors[chunk.place])
            found = found or jax.tree.map(lambda leaf: np.zeros((len(chains.left), *leaf.shape[1:]), leaf.dtype), parts)
            for whole, part in zip(jax.tree.leaves(found), jax.tree.leaves(parts), strict=True):
                whole[chunk.place] = part
    states, motion, absolute, push, push_rate, approach_speed, readings = found
    records = problem.experiment.records
    longest = max(len(record.time) for record in records)
    made = []
    for index, record in enumerate(records):

        def series(values, index=index, record=record):
            one = chains.series(index, values[:, :-1], len(record.time))
            return jnp.asarray(np.pad(one, [(0, longest - len(one)), *[(0, 0)] * (one.ndim - 1)], mode="edge"))

        step = record.time[-1] - record.time[-2]
        ts = np.concatenate([record.time, record.time[-1] + step * np.arange(1, longest - len(record.time) + 1)])
        made.append(
            Course(
                motion=dataclasses.replace(jax.tree.map(series, motion), t=jnp.asarray(ts)),
                acceleration=series(absolute),
                push=series(push),
                push_rate=series(push_rate),
                readings={name: series(values) for name, values in readings.items()},
                system=record_system(problem, at, index),
            )
        )
    held = problem.unknowns.states[-1] == APPROACH_SPEED
    return tuple(made), np.concatenate([states, approach_speed[..., None]], axis=-1) if held else states


def record_system(problem: Problem, at: Estimate, index: int) -> System:
    """The rig in one whole record, without random force and effects."""
    record, own = problem.experiment.records[index], dict(zip(problem.unknowns.own, at.own[index], strict=True))
    values = problem.values(at)
    for name, logarithmic in zip(problem.unknowns.own, problem.unknowns.logarithmic_own, strict=True):
        if name.startswith(VARIATION):
            shared = name.removeprefix(VARIATION)
            values[shared] = values[shared] * np.exp(own[name]) if dict(problem.unknowns.shared)[shared] else values[shared] + own[name]
        elif name in problem.model.values():
            values[name] = np.exp(own[name]) if logarithmic else own[name]
    inputs = inputs_of(record)
    amplitude, phase = np.hypot(own["base_sine"], own["base_cosine"]), np.arctan2(own["base_cosine"], own["base_sine"])
    base = Harmonic(amplitude, phase, record.excitation_frequency or 0.0) if inputs.cart is None else inputs.cart
    applied = Unforced() if inputs.applied is None else inputs.applied
    here = problem.model.replace(values).in_record(lambda file: 1.0 if file == record.file else 0.0)
    system = dataclasses.replace(here.system(gap=record.gap + own["gap_error"], base=base, applied=applied), effects=())
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), system)


def by_sample(fitted: Fitted, sampled: Float[np.ndarray, "segments knots states"]) -> BySample:
    """Linearise the chain about its estimate from sample to sample, with the states there."""
    problem, at, chains = fitted.problem, fitted.at, fitted.problem.chains
    fine = chains_of(problem.experiment.records, 1, rest=problem.rest, late=late_channels(problem.model_at(at)))
    states, force = np.zeros((fine.knot_count, len(problem.unknowns.states))), np.zeros(fine.knot_count)
    for index, knots in enumerate(fine.knots):
        samples = knots.stop - knots.start - 1
        parts = chains.of_record(index)
        ends = np.stack([at.force[chains.left[parts]], at.force[chains.left[parts] + 1]], axis=1)
        share = np.arange(chains.samples) / chains.samples
        between = (ends[:, :1] * (1.0 - share) + ends[:, 1:] * share).ravel()
        states[knots] = np.concatenate([chains.series(index, sampled[:, :-1], samples), sampled[parts][-1:, -1]])
        force[knots] = np.concatenate([between[:samples], ends[-1:, 1]])
    finely = linearise(
        problem.model_at(at),
        problem.unknowns,
        fine,
        problem.integrator,
        dataclasses.replace(at, states=states, force=force),
        problem.scales.states,
        chunk=CHUNK * chains.samples,
    )
    count = len(problem.unknowns.states)
    columns = [*range(count + 2), count + 2 + len(problem.unknowns.shared) + problem.unknowns.own.index("gap_error")]
    shape = (len(chains.left), chains.samples)
    readings_by = np.zeros((*shape, len(chains.channels), len(columns)))
    next_by = np.zeros((*shape, count, len(columns)))
    for index, _ in enumerate(fine.knots):
        mine, of = fine.of_record(index), chains.of_record(index)
        samples = mine.stop - mine.start
        for whole, part in ((readings_by, finely.by[mine, 0][..., columns]), (next_by, finely.end_by[mine][..., columns])):
            flat = np.zeros(((of.stop - of.start) * chains.samples, *part.shape[1:]))
            flat[:samples] = part
            whole[of] = flat.reshape(-1, chains.samples, *part.shape[1:])
    for group in chains.groups:
        if group.prescribed is not None:
            for channel, factor in (("reaction_force", -1.0), ("hammer_acceleration", 1.0 / problem.experiment.mass)):
                if channel in chains.channels:  # the machine takes a force up and the hammer does not move: it is seen at once
                    place = chains.channels.index(channel)
                    readings_by[group.place, :, place, count] = factor * chains.weight[group.place, :, place]
    return BySample(readings_by=readings_by, next_by=next_by)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Signal:
    """What an effect adds along all records, at its probing strength; (segments, samples + 1) on the chain's samples.

    Attributes:
        force: on the hammer, N.
        stop: place of the stop, m.
        readings: by channel, SI.
        record: the only one in which it is not zero; None where it acts in all.
    """

    force: np.ndarray | None
    stop: np.ndarray | None
    readings: Mapping[str, np.ndarray]
    record: int | None = None


def responses(
    by: BySample, chains: Chains, signals: list[Signal]
) -> tuple[Float[np.ndarray, "segments samples channels signals"], Float[np.ndarray, "segments states signals"]]:
    """Change of the residuals, over the noise, and of the states at the end of every segment, by each signal."""
    segments, samples, states = by.next_by.shape[:3]
    nothing = np.zeros((segments, samples + 1))
    force, stop = (
        np.stack([nothing, *(nothing if x is None else x for x in parts)], axis=-1)[..., 1:]
        for parts in ([one.force for one in signals], [one.stop for one in signals])
    )
    acts = np.flatnonzero((force != 0).any(axis=(1, 2)) | (stop != 0).any(axis=(1, 2)))
    seen = np.zeros((segments, samples, len(chains.channels), len(signals)))
    end = np.zeros((segments, states, len(signals)))
    state = np.zeros((len(acts), states, len(signals)))
    for i in range(samples):
        around = np.stack([force[acts, i], force[acts, i + 1], 0.5 * (stop[acts, i] + stop[acts, i + 1])], axis=1)
        here = np.concatenate([state, np.stack([force[acts, i], force[acts, i + 1], stop[acts, i]], axis=1)], axis=1)
        seen[acts, i] = by.readings_by[acts, i] @ here
        state = by.next_by[acts, i] @ np.concatenate([state, around], axis=1)
    end[acts] = state
    for column, one in enumerate(signals):
        for channel, values in one.readings.items():
            place = chains.channels.index(channel)
            seen[..., place, column] += values[:, :-1] * chains.weight[..., place]
    return seen, end
