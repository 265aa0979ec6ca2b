"""What an effect would add along the estimated motion, as signals in time: a force, a shift of the stop, an addition to readings."""

import math
from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from identification.trajectory.course import Course, Signal
from identification.trajectory.segments import Chains
from vibrojax.channels import EVERY_CHANNEL
from vibrojax.compiling import soon_compiled
from vibrojax.contact import AbstractCompliantLaw, AbstractInstantaneousLaw
from vibrojax.effects import AbstractEffect, Motion
from vibrojax.shapes import Value
from vibrojax.steps import runge_kutta_step

_ANGLE = 0.6
"""Longest integration step of an effect's own states, in radians of its fastest vibration."""


def signals(courses: tuple[Course, ...], chains: Chains, effects: list[AbstractEffect]) -> list[Signal]:
    """Signals of effects of one class, channel and record, at the strengths that they have."""
    found: list[dict[str, np.ndarray]] = [{} for _ in effects]
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf, jnp.float64) for leaf in leaves]), *effects)
    for index, course in enumerate(courses):
        if effects[0].record not in (None, chains.files[index]):
            continue
        own = own_states(stacked, effects, course)
        parts = jax.tree.map(np.asarray, _added_along(stacked, course, own))
        for name, values in parts.items():
            if values.any():
                for one, series in zip(found, values, strict=True):
                    one.setdefault(name, np.zeros((len(chains.left), chains.samples + 1)))[chains.of_record(index)] = on_segments(
                        chains, index, series
                    )
    return [
        Signal(force=one.get("force"), stop=one.get("stop"), readings={c: one[c] for c in chains.channels if c in one}) for one in found
    ]


def on_segments(chains: Chains, index: int, series: Float[np.ndarray, " time"]) -> Float[np.ndarray, "segments knots"]:
    """Values along a record, at the samples of its segments and at their ends."""
    count, samples = chains.of_record(index).stop - chains.of_record(index).start, chains.samples
    rows = samples * np.arange(count)[:, None] + np.arange(samples + 1)
    return series[np.minimum(rows, len(series) - 1)]


def own_states(stacked: AbstractEffect, effects: list[AbstractEffect], course: Course) -> Float[Array, "effects time own"]:
    """The effects' own states along a record, from rest at its start."""
    if not effects[0].own_states:
        return jnp.zeros((len(effects), len(course.push), 0))
    sampling = float(course.motion.t[1] - course.motion.t[0])
    fastest = max(float(effect.fastest_hz) for effect in effects)
    return _own_along(stacked, course, jnp.asarray(max(1, math.ceil(2.0 * math.pi * fastest * sampling / _ANGLE))))


@soon_compiled
def _added_along(effects: AbstractEffect, course: Course, own: Float[Array, "effects time own"]) -> dict[str, Float[Array, "effects time"]]:
    """What `_added` gives, of several effects of one class."""
    return jax.vmap(partial(_added, course))(effects, own)


def _added(course: Course, effect: AbstractEffect, own: Float[Array, "time own"]) -> dict[str, Float[Array, " time"]]:
    """Force on the hammer, place of the stop and additions to readings, along one record; nothing where the effect does not act."""
    system, motion, found = course.system, course.motion, {}

    def add(name: str, values: Float[Array, " time"]) -> None:
        found[name] = found[name] + values if name in found else values

    if effect.does("force"):
        add("force", effect.force(motion, own))
    if effect.does("back_gap"):
        add("force", _second_stop(course, effect))
    if effect.does("stop"):
        further = _further_push(course, effect)
        add("force", -further - _further_impulse(course, effect))
        add("impact_force", further)
    if effect.does("stop_position"):
        add("stop", effect.stop_position(motion.t, own))
        slower = course.push_rate * effect.stop_velocity(motion.t, own)
        add("force", slower)
        add("impact_force", -slower)
    if effect.does("base"):
        moved = effect.base(system.base)
        _move_base(
            add, system.mass, *(getattr(moved, x)(motion.t) - getattr(system.base, x)(motion.t) for x in ("displacement", "acceleration"))
        )
    if effect.does("base_displacement"):
        _move_base(add, system.mass, effect.base_displacement(own), effect.base_acceleration(own, course.push))
    if effect.does("read"):
        read = effect.read(course.readings, motion, own)
        for name in EVERY_CHANNEL:
            if name in read and read[name] is not course.readings[name]:
                add(name, read[name] - course.readings[name])
    return found


def _move_base(add: Callable[[str, Array], None], mass: Value, displacement: Array, acceleration: Array) -> None:
    """A further motion of the cart: an inertia force on the hammer, and what the sensors see of it."""
    add("force", -mass * acceleration)
    add("hammer_displacement", displacement)
    add("cart_displacement", displacement)
    add("hammer_acceleration", acceleration)
    add("cart_acceleration", acceleration)
    add("reaction_force", -mass * acceleration)


def _second_stop(course: Course, effect: AbstractEffect) -> Float[Array, " time"]:
    """Contact force of a stop behind the hammer, along a motion without that stop, N."""
    law, motion = course.system.law, course.motion
    if effect.back_gap is None or not isinstance(law, AbstractCompliantLaw):
        return jnp.zeros_like(motion.u)
    return _push(law, -motion.u - effect.back_gap, -motion.v)


def _further_push(course: Course, effect: AbstractEffect) -> Float[Array, " time"]:
    """Contact force of the front stop as the effect changes it, less that of the model, along a motion without the effect, N."""
    system, motion = course.system, course.motion
    law, gap = effect.stop(system.law, system.gap)
    if law is system.law or not (isinstance(law, AbstractCompliantLaw) and isinstance(system.law, AbstractCompliantLaw)):
        return jnp.zeros_like(motion.u)
    return _push(law, motion.indentation + system.gap - gap, motion.indentation_rate) - course.push


def _further_impulse(course: Course, effect: AbstractEffect) -> Float[Array, " time"]:
    """Impulses of a rigid stop as the effect changes it, less those of the model, over the sampling interval, N.

    Each is at the first sample after the touch; linear between samples, it acts in part before, where the stop reflects it.
    """
    system, motion = course.system, course.motion
    law, _ = effect.stop(system.law, system.gap)
    if not (isinstance(law, AbstractInstantaneousLaw) and isinstance(system.law, AbstractInstantaneousLaw)):
        return jnp.zeros_like(motion.u)
    speed, dt = jnp.maximum(motion.indentation_rate[:-1], 0.0), jnp.diff(motion.t)
    touched = (speed > 0.0) & (motion.indentation_rate[1:] <= 0.0) & (motion.indentation[:-1] + speed * dt > 0.0)
    further = system.mass * (law.rebound_speed(speed) - system.law.rebound_speed(speed)) / dt
    return jnp.pad(jnp.where(touched, further, 0.0), (1, 0))


def _push(law: AbstractCompliantLaw, indentation: Float[Array, " time"], rate: Float[Array, " time"]) -> Float[Array, " time"]:
    """Contact force of a stop, N; a law that depends on approach speed gets 0.1 m/s."""
    pushed = law.force(jnp.maximum(indentation, 0.0), rate, jnp.full_like(indentation, 0.1))
    return jnp.where(indentation > 0, pushed, jnp.zeros_like(pushed))


@soon_compiled
def _own_along(effects: AbstractEffect, course: Course, substeps: Int[Array, ""]):
    return jax.vmap(lambda effect: _own(course, effect, substeps))(effects)


def _own(course: Course, effect: AbstractEffect, substeps: Int[Array, ""]) -> Float[Array, "time own"]:
    """Own states of one effect along a record, from rest at its start; force and motion are linear between samples."""
    size = len(effect.own_states)
    inputs: tuple[Motion, Array, Array] = (course.motion, course.push, course.acceleration)
    begin, end = jax.tree.map(lambda x: x[:-1], inputs), jax.tree.map(lambda x: x[1:], inputs)

    def interval(own, ends):
        left, right, dt = ends

        def rates(part, own):
            motion, push, acceleration = jax.tree.map(lambda a, b: a if a.dtype == bool else a + part * (b - a), left, right)
            return dt * effect.rates(motion, own, push, acceleration)

        h = 1.0 / substeps
        own = lax.fori_loop(0, substeps, lambda k, own: runge_kutta_step(rates, k * h, own, h)[0], own)
        return own, own

    _, later = lax.scan(interval, jnp.zeros(size), (begin, end, jnp.diff(course.motion.t)))
    return jnp.concatenate([jnp.zeros((1, size)), later])
