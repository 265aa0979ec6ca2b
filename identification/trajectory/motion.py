"""Motion through a segment and its derivatives: the only place of a fit that integrates.

z_(k+1) = phi_k(z_k, f_k, f_(k+1); theta, nu) with the random force linear from f_k to f_(k+1), and the readings of every channel at the
samples in between. Segments are short, so that none diverges, whatever the parameters.
"""

import dataclasses
import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from identification.trajectory.segments import APPROACH_SPEED, OF_RECORD, VARIATION, Chains, Segments, Unknowns
from vibrojax.channels import recorded
from vibrojax.compiling import soon_compiled
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.effects import AbstractEffect
from vibrojax.excitation import Harmonic, PiecewiseLinearForce, Unforced
from vibrojax.integrate import SUCCESS, Guided, Landing, Trajectory
from vibrojax.integrate.landing import SLOWEST_TOUCH, LandingState
from vibrojax.model import Model
from vibrojax.system import Approach, System

CHUNK = 256
"""Segments that are integrated side by side."""


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
        value = value + mine.get(f"{VARIATION}{name}", 0.0)
        values[name] = jnp.exp(value) if logarithmic else value
    for name, logarithmic in zip(unknowns.own, unknowns.logarithmic_own, strict=True):
        if name not in OF_RECORD and not name.startswith(("zero.", VARIATION)):
            values[name] = jnp.exp(mine[name]) if logarithmic else mine[name]
    base = one.motion
    if base is None:
        sine, cosine = mine["base_sine"], mine["base_cosine"]
        still = (sine == 0.0) & (cosine == 0.0)
        safe = jnp.where(still, 1.0, sine)
        amplitude = jnp.where(still, 0.0, jnp.hypot(safe, cosine))
        base = Harmonic(base_amplitude=amplitude, base_phase=jnp.arctan2(cosine, safe), frequency_hz=one.frequency_hz)
    beside = Unforced() if one.applied is None else one.applied
    applied = beside
    if one.prescribed is None:
        applied = PiecewiseLinearForce(start=one.ts[0], spacing=(one.ts[-1] - one.ts[0]) / (len(force) - 1), values=force, beside=beside)

    def acts(file: str) -> Float[Array, ""] | float:
        return jnp.where(one.record == files.index(file), 1.0, 0.0) if file in files else 0.0

    return model.replace(values).in_record(acts).system(gap=one.gap + mine["gap_error"], base=base, applied=applied)


def homes(model: Model, files: tuple[str, ...]) -> tuple[str, ...]:
    """The files, where an effect acts in the record of one of them alone; else none, so that no program is compiled for their names."""
    return files if any(effect.record is not None for effect in model.effects) else ()


def read(
    unknowns: Unknowns, one: Segments, system: System, along: Trajectory, vector: Float[Array, " columns"]
) -> Float[Array, "samples channels"]:
    """What the sensors read along a motion, with their zeros."""
    return _compared(unknowns, one, recorded(system, along)[0], vector)


def _compared(unknowns: Unknowns, one: Segments, readings, vector: Float[Array, " columns"]) -> Float[Array, "samples channels"]:
    """Readings of the channels that are compared, with their zeros."""
    for name, value in zip(unknowns.own, vector[len(vector) - len(unknowns.own) :], strict=True):
        if name.startswith("zero."):
            readings = readings | {name[5:]: readings[name[5:]] + value}
    return jnp.stack([readings[name] for name in one.channels], axis=-1)


def travelled(
    model: Model,
    unknowns: Unknowns,
    files: tuple[str, ...],
    integrator: Landing,
    segments: Segments,
    vectors: Float[Array, "segments columns"],
) -> tuple[System, Trajectory, Bool[Array, " segments"]]:
    """The rig in every segment, its motion at all knots of the samples, the last one included, and whether it was integrated."""
    systems = jax.vmap(lambda one, vector: segment_system(model, unknowns, files, one, vector))(segments, vectors)
    held = _holds_approach_speed(unknowns)
    integrated = len(unknowns.states) - held
    states, speed = vectors[:, :integrated], jnp.maximum(vectors[:, integrated], SLOWEST_TOUCH) if held else None
    if segments.prescribed is not None:
        speeds = jnp.full(len(states), SLOWEST_TOUCH) if speed is None else speed
        follow = lambda motion, speed, *where: Guided(motion, approach_speed=speed)(*where)  # noqa: E731
        whole = jax.vmap(follow)(segments.prescribed, speeds, systems, segments.ts, states)
        return systems, eqx.tree_at(lambda one: one.steps, whole, jnp.zeros(len(states), int)), whole.result == SUCCESS
    along, done = _moving(integrator, systems, segments, states, speed)
    return systems, eqx.tree_at(lambda one: one.steps, along, jnp.zeros(len(states), int)), done


def _moving(
    integrator: Landing,
    systems: System,
    segments: Segments,
    states: Float[Array, "segments states"],
    speed: Float[Array, " segments"] | None,
):
    """Trajectory and success of segments in which the hammer moves freely."""
    start = integrator.start(systems, segments.ts, states)
    rigid = isinstance(systems.law, AbstractInstantaneousLaw)
    if rigid:
        start = jax.vmap(_against_a_rigid_stop)(systems, start, jnp.asarray(segments.resting))
    shortest = 0.05 * (segments.ts[:, 1] - segments.ts[:, 0])  # a body that would fly for less rests on a rigid stop
    if speed is not None:
        start = start._replace(approach_speed=speed)

    def unfinished(loop):
        count, carry, t_end = loop
        return (count < 200) & jnp.any((carry.t < t_end) & jnp.isfinite(carry.u))  # more steps to a sample: not integrated

    def sample(carry, t_end):
        def advance(loop):
            count, carry, _ = loop
            step = partial(_step_or_rest, integrator) if rigid else lambda *of_lane: integrator.step(*of_lane[:3])
            return count + 1, jax.vmap(step)(systems, t_end, carry, shortest), t_end

        _, after, _ = lax.while_loop(unfinished, advance, (jnp.zeros((), int), carry, t_end))
        return after, _seen(after)

    last, later = lax.scan(sample, start, segments.ts[:, 1:].T)
    u, v, in_contact, approach_speed, own = jax.tree.map(
        lambda first, then: jnp.swapaxes(jnp.concatenate([first[None], then]), 0, 1), _seen(start), later
    )
    none = jnp.zeros(len(segments.ts), int)
    finite = jnp.isfinite(last.u) & jnp.isfinite(last.v) & jnp.isfinite(last.own).all(axis=1)
    done = finite & (last.t >= segments.ts[:, -1])
    return Trajectory(segments.ts, u, v, in_contact, approach_speed, none, jnp.zeros((), int), own), done


def _read(systems: System, lanes: Trajectory, segments: Segments):
    """Readings at all knots of the samples, and own states there; a channel that is late shows the motion of a little before.

    The chain compares it with the motion of the nearest sample; what is left of its delay, half a sample at most, is a short way along
    the motion: u + u' r + u'' r^2 / 2.
    """
    late = {effect.channel: k for k, effect in enumerate(systems.effects) if effect.does("lateness")}
    if not late or segments.ahead is None:
        return jax.vmap(recorded)(systems, lanes)
    prompt = dataclasses.replace(systems, effects=tuple(effect for effect in systems.effects if not effect.does("lateness")))
    readings, own = jax.vmap(recorded)(prompt, lanes)
    for channel, place in late.items():
        if channel in segments.ahead:
            ahead = jnp.concatenate([segments.ahead[channel], segments.ahead[channel][:, -1:]], axis=1)
            after = jax.vmap(partial(_moved, channel=channel))(prompt, systems.effects[place], lanes, ahead)
            readings = readings | {channel: after}
    return readings, own


def _moved(prompt: System, effect: AbstractEffect, one: Trajectory, ahead: Float[Array, " time"], *, channel: str) -> Float[Array, " time"]:
    """What one channel shows of the motion at its reading's true time."""
    r = ahead - effect.lateness(one.ts + ahead)
    forces = prompt.forces(one.ts, one.u, one.v, one.own, one.in_contact, one.approach_speed)
    u, v, ts = one.u + r * (one.v + 0.5 * r * forces.acceleration), one.v + r * forces.acceleration, one.ts + r
    own = one.own + r[:, None] * forces.own_rates if one.own.shape[-1] else one.own
    touches = prompt.approach(ts, u, v, own).indentation > 0
    in_contact = one.in_contact if isinstance(prompt.law, AbstractInstantaneousLaw) else touches
    return recorded(prompt, Trajectory(ts, u, v, in_contact, one.approach_speed, one.result, one.steps, own))[0][channel]


def _seen(carry: LandingState):
    return carry.u, carry.v, carry.in_contact, carry.approach_speed, carry.own


def _holds_approach_speed(unknowns: Unknowns) -> bool:
    return unknowns.states[-1] == APPROACH_SPEED


def passed(
    model: Model,
    unknowns: Unknowns,
    files: tuple[str, ...],
    integrator: Landing,
    segments: Segments,
    vectors: Float[Array, "segments columns"],
):
    """Readings and ends of segments, and beside them, without derivative, whether each was integrated."""
    return shown(unknowns, segments, vectors, *travelled(model, unknowns, files, integrator, segments, vectors))


def shown(
    unknowns: Unknowns,
    segments: Segments,
    vectors: Float[Array, "segments columns"],
    systems: System,
    along: Trajectory,
    done: Bool[Array, " segments"],
):
    """What the sensors read along a motion, and its end; beside them whether it was integrated."""
    readings, own = _read(systems, along, segments)
    stacked = jax.vmap(partial(_compared, unknowns))(segments, readings, vectors)[:, :-1]
    end = jnp.concatenate([jnp.stack([along.u[:, -1], along.v[:, -1]], axis=1), own[:, -1]], axis=1)
    if _holds_approach_speed(unknowns):
        end = jnp.concatenate([end, along.approach_speed[:, -1:]], axis=1)
    return Passed(stacked, end), done & jnp.all(jnp.isfinite(end), axis=1)


def _at_the_stop(system: System, state: LandingState) -> tuple[Approach, LandingState, Float[Array, ""]]:
    """Where a lane is against its nearest stop, the same lane moved onto that, and how it is accelerated into the stop there, m/s^2."""
    near = system.approach(state.t, state.u, state.v, state.own)
    on = state._replace(u=state.u - near.side * near.indentation, v=state.v - near.side * near.rate)
    pressed = near.side * system.forces(on.t, on.u, on.v, on.own, on.in_contact, on.approach_speed).acceleration
    return near, on, pressed


def _against_a_rigid_stop(system: System, start: LandingState, resting: Bool[Array, ""]) -> LandingState:
    """One lane at the beginning: a knot beyond the stop is on it, and a lane in which the body rests begins at rest.

    Rest is contact that lasts; the stop being rigid, `in_contact` stands for it.
    """
    near, on, _ = _at_the_stop(system, start)
    beyond = near.indentation > 0
    start = start._replace(u=jnp.where(beyond | resting, on.u, start.u), v=jnp.where(resting, on.v, start.v))
    return start._replace(in_contact=resting | start.in_contact)


def _step_or_rest(
    integrator: Landing, system: System, t_end: Float[Array, ""], carry: LandingState, shortest: Float[Array, ""]
) -> LandingState:
    """One step of one lane against a rigid stop; the body rests where its next flight would be shorter than `shortest`, s.

    Impacts that follow each other ever faster end in a finite time; what is cut off is a part of the last sample. A body at rest stays
    there until something draws it off the stop.
    """
    _, on, pressed = _at_the_stop(system, carry)
    stays = carry.in_contact & (pressed > 0)
    flying = integrator.step(system, t_end, carry._replace(in_contact=jnp.zeros_like(carry.in_contact)))
    near, landed, pressed = _at_the_stop(system, flying)
    rests = carry.landing & (pressed > 0) & (-2.0 * near.rate < shortest * pressed)
    flying = jax.tree.map(lambda yes, no: jnp.where(rests, yes, no), landed._replace(in_contact=jnp.ones_like(rests)), flying)
    return jax.tree.map(lambda yes, no: jnp.where(stays, yes, no), on._replace(t=t_end, landing=jnp.zeros_like(stays)), flying)


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
    model: Model,
    unknowns: Unknowns,
    chains: Chains,
    integrator: Landing,
    at: Estimate,
    sizes: Float[np.ndarray, " states"],
    *,
    chunk: int = CHUNK,
) -> Linearised:
    """Integrate every segment from its knot, with derivatives; one that cannot be integrated, or that is too steep, has no weight.

    `sizes` are natural ones of the states; `chunk` segments are integrated side by side.
    """
    vectors, model = vectors_of(chains, at), jax.tree.map(np.asarray, model)
    count, samples, states = len(chains.left), chains.samples, len(unknowns.states)
    residual = np.zeros((count, samples, len(chains.channels)))
    by, end, end_by = np.zeros((*residual.shape, unknowns.columns)), np.zeros((count, states)), np.zeros((count, states, unknowns.columns))
    done = np.zeros(count, bool)

    def run(part: Segments):
        found = _derivatives(model, unknowns, homes(model, chains.files), integrator, part, vectors[part.place])
        return part.place, jax.tree.map(np.asarray, found)

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for place, (value, slope, fine) in threads.map(run, _chunks(chains, at, chunk)):
            fine = fine & np.isfinite(slope.end).all(axis=(1, 2)) & np.isfinite(slope.readings).all(axis=(1, 2, 3))
            steepness = np.abs(slope.end[:, :, : len(sizes)]) * sizes / sizes[:, None]
            fine &= np.nan_to_num(steepness, nan=np.inf).max(axis=(1, 2)) < 1e3  # beyond, a touch grazes
            usable = chains.weight[place] * fine[:, None, None]
            counts = usable > 0
            residual[place] = np.where(counts, (np.where(counts, value.readings, 0.0) - chains.measured[place]) * usable, 0.0)
            by[place] = np.where(counts[..., None], slope.readings, 0.0) * usable[..., None]
            end[place], end_by[place] = np.where(fine[:, None], value.end, 0.0), np.where(fine[:, None, None], slope.end, 0.0)
            done[place] = fine
    return Linearised(residual=residual, by=by, end=end, end_by=end_by, done=done)


@soon_compiled
def _in_a_row(model, unknowns, files, integrator, segments: Segments, rest_of_vectors, states):
    """States at the ends of segments (steps, lanes), each step beginning where the last one ended; readings, and whether all went well."""

    def step(states, one):
        here, beside = one
        found, done = passed(model, unknowns, files, integrator, here, jnp.concatenate([states, beside], axis=1))
        return found.end, (found, done)

    return lax.scan(step, states, (segments, rest_of_vectors))[1]


def unrolled(model: Model, unknowns: Unknowns, chains: Chains, integrator: Landing, at: Estimate) -> tuple[Estimate, float]:
    """The motion of each record without a random force, from the first knot's state on: one trajectory in place of segments.

    With it comes the sum of its squared residuals, over the noise; infinite where a record cannot be integrated.
    """
    square, states, model = 0.0, at.states.copy(), jax.tree.map(np.asarray, model)
    beside = vectors_of(chains, dataclasses.replace(at, force=np.zeros_like(at.force)))[:, len(unknowns.states) :]
    for group in chains.groups:
        rows = [np.flatnonzero(group.record == record) for record in np.unique(group.record)]
        longest = max(len(one) for one in rows)
        order = np.stack([np.minimum(np.arange(longest), len(one) - 1) + one[0] for one in rows], axis=1)
        going = np.stack([np.arange(longest) < len(one) for one in rows], axis=1)
        segments, places = jax.tree.map(lambda leaf, order=order: leaf[order], group), group.place[order]
        begin = states[chains.left[places[0]]]
        found, done = _in_a_row(model, unknowns, homes(model, chains.files), integrator, segments, beside[places], begin)
        if not np.all(np.asarray(done) | ~going):
            return at, np.inf
        states[chains.left[places[going]] + 1] = np.asarray(found.end)[going]
        square += float(np.sum(((np.asarray(found.readings) - segments.measured) * segments.weight)[going] ** 2))
    return dataclasses.replace(at, states=states, force=np.zeros_like(at.force)), square


def _chunks(chains: Chains, at: Estimate, count: int):
    """Segments in chunks of one size, those nearest to the stop together, since contact takes more steps than flight."""
    for group in chains.groups:
        u = at.states[chains.left[group.place], 0]
        order = np.argsort(u - group.gap, kind="stable")
        for begin in range(0, len(order), count):
            rows = np.resize(order[begin : begin + count], count)
            yield jax.tree.map(lambda leaf, rows=rows: leaf[rows], group)
