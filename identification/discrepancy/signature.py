"""What an effect would do along the fitted motion: its own hooks, called on that motion."""

import math
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from identification.discrepancy.linearised import Linearised
from identification.discrepancy.response import Perturbation
from identification.layout import Estimate
from identification.prepare import Prepared
from vibrojax.channels import CHANNELS
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import AbstractEffect, Motion
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.system import System

_ANGLE = 0.6
"""Longest step of an effect's own states, in radians of its fastest vibration."""


class Course(eqx.Module):
    """The fitted motion along one record, (time,) each, and the system that made it."""

    ts: Float[Array, " time"]
    u: Float[Array, " time"]
    v: Float[Array, " time"]
    acceleration: Float[Array, " time"]
    push: Float[Array, " time"]
    in_contact: Array
    readings: dict[str, Float[Array, " time"]]
    system: System


def courses(prepared: Prepared, at: Linearised, estimate: Estimate) -> tuple[Course, ...]:
    """The fitted motion along every record, with a continuous clock; all padded to the longest."""
    found, longest = [], max(len(record.time) for record in prepared.experiment.records)
    values = prepared.layout.physical(estimate.shared)
    model = prepared.model.replace(values)
    for index, record in enumerate(prepared.experiment.records):
        amplitude, phase, gap_error = estimate.nuisances[index, :3]
        base = prepared.carts[index] or Harmonic(amplitude, phase, record.excitation_frequency or 0.0)
        system = model.system(gap=record.gap + gap_error, base=base, applied=Unforced())
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), system)
        along = {
            name: jnp.asarray(_padded(at.of_record(getattr(at, name), index, len(record.time)), longest))
            for name in ("u", "v", "acceleration", "push", "in_contact")
        }
        step = record.time[-1] - record.time[-2]
        ts = jnp.asarray(np.concatenate([record.time, record.time[-1] + step * np.arange(1, longest - len(record.time) + 1)]))
        y, y2 = system.base.displacement(ts), system.base.acceleration(ts)
        readings = {
            "hammer_displacement": along["u"] + y,
            "cart_displacement": y,
            "hammer_acceleration": along["acceleration"],
            "cart_acceleration": y2,
            "impact_force": along["push"],
            "applied_force": jnp.zeros_like(y),
            "relative_displacement": along["u"],
        }
        found.append(Course(ts=ts, readings=readings, system=system, **along))
    return tuple(found)


def _padded(values: np.ndarray, samples: int) -> np.ndarray:
    """Values held at their last until there are as many as `samples`."""
    return np.pad(values, (0, samples - len(values)), mode="edge")


def signatures(at: Linearised, courses: tuple[Course, ...], files: tuple[str, ...], effects: list[AbstractEffect]) -> list[Perturbation]:
    """Perturbation of every effect of one class (and the same channel and record), in the windows' shape."""
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf, jnp.float64) for leaf in leaves]), *effects)
    substeps = max(_substeps(effect, courses[0]) for effect in effects)
    shape = (len(effects), *at.u.shape)
    names = ("force", "stop_position", "stop_velocity", "base_displacement", "base_acceleration")
    whole = {name: np.zeros(shape) for name in names}
    readings: dict[str, np.ndarray] = {}
    for index, course in enumerate(courses):
        if effects[0].record not in (None, files[index]):
            continue
        parts, read = jax.tree.map(np.asarray, _along(stacked, course, substeps))
        for name in names:
            windows, values = at.in_windows(parts[name], index)
            whole[name][:, windows] = values
        for channel, added in read.items():
            if added.any():
                windows, values = at.in_windows(added, index)
                readings.setdefault(channel, np.zeros(shape))[:, windows] = values
    return [
        Perturbation(**{name: whole[name][k] for name in names}, readings={c: v[k] for c, v in readings.items() if v[k].any()})
        for k in range(len(effects))
    ]


def own_states(effect: AbstractEffect, courses: tuple[Course, ...]) -> list[np.ndarray]:
    """The effect's own states along every record, (time, own), from rest at its start."""
    effect = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), effect)
    return [np.asarray(_own_along(effect, course, _substeps(effect, course))) for course in courses]


def _substeps(effect: AbstractEffect, course: Course) -> int:
    """Steps of an effect's own states in a sampling interval."""
    sampling = float(course.ts[1] - course.ts[0])
    return max(1, math.ceil(2.0 * math.pi * float(effect.fastest_hz) * sampling / _ANGLE))


@eqx.filter_jit
def _own_along(effect: AbstractEffect, course: Course, substeps: int):
    return _own(course, effect, _motion(course), substeps)


@eqx.filter_jit
def _along(effects: AbstractEffect, course: Course, substeps: int):
    """Hooks of stacked effects along one record."""
    return jax.vmap(partial(_one, course, substeps))(effects)


def _one(course: Course, substeps: int, effect: AbstractEffect):
    system, motion = course.system, _motion(course)
    own = _own(course, effect, motion, substeps)
    moved = effect.base(system.base)
    read = effect.read(course.readings, motion, own)
    parts = {
        "force": effect.force(motion, own) + _second_stop(system, effect, motion) - _missing_stop(system, effect, motion),
        "stop_position": effect.stop_position(course.ts, own),
        "stop_velocity": effect.stop_velocity(course.ts, own),
        "base_displacement": moved.displacement(course.ts) - system.base.displacement(course.ts) + effect.base_displacement(own),
        "base_acceleration": moved.acceleration(course.ts)
        - system.base.acceleration(course.ts)
        + effect.base_acceleration(own, course.push),
    }
    return parts, {name: read[name] - course.readings[name] for name in CHANNELS if name != "applied_force"}


def _second_stop(system: System, effect: AbstractEffect, motion: Motion) -> Float[Array, " time"]:
    """Push of a stop behind, along a motion that does not know it, N."""
    if effect.back_gap is None or not isinstance(system.law, AbstractCompliantLaw):
        return jnp.zeros_like(motion.u)
    indentation = -motion.u - effect.back_gap
    pushed = system.law.force(jnp.maximum(indentation, 0.0), -motion.v, jnp.full_like(motion.u, 0.1))
    return jnp.where(indentation > 0, pushed, jnp.zeros_like(pushed))


def _missing_stop(system: System, effect: AbstractEffect, motion: Motion) -> Float[Array, " time"]:
    """Push of a stop in front that the nominal model lacks, along a motion that does not know it, N."""
    law, gap = effect.stop(system.law, system.gap)
    if type(law) is type(system.law) or not isinstance(law, AbstractCompliantLaw):
        return jnp.zeros_like(motion.u)
    indentation = motion.u - gap
    pushed = law.force(jnp.maximum(indentation, 0.0), motion.v, jnp.full_like(motion.u, 0.1))
    return jnp.where(indentation > 0, pushed, jnp.zeros_like(pushed))


def _motion(course: Course) -> Motion:
    return Motion(
        t=course.ts,
        u=course.u,
        v=course.v,
        indentation=course.system.indentation(course.u),
        indentation_rate=course.v,
        in_contact=course.in_contact,
    )


def _own(course: Course, effect: AbstractEffect, motion: Motion, substeps: int) -> Float[Array, "time own"]:
    """The effect's own states, from rest at the record's start."""
    size = len(effect.own_states)
    if size == 0:
        return jnp.zeros((len(course.ts), 0))
    inputs = (motion, course.push, course.acceleration)
    begin, end = jax.tree.map(lambda x: x[:-1], inputs), jax.tree.map(lambda x: x[1:], inputs)

    def interval(own, ends):
        (left, right), dt = ends[:2], ends[2]

        def rates(own, part):
            motion, push, acceleration = jax.tree.map(lambda a, b: a if a.dtype == bool else a + part * (b - a), left, right)
            return effect.rates(motion, own, push, acceleration)

        h = 1.0 / substeps
        for k in range(substeps):
            one = rates(own, k * h)
            two = rates(own + 0.5 * h * dt * one, (k + 0.5) * h)
            three = rates(own + 0.5 * h * dt * two, (k + 0.5) * h)
            four = rates(own + h * dt * three, (k + 1) * h)
            own = own + h * dt / 6 * (one + 2 * two + 2 * three + four)
        return own, own

    start = jnp.zeros(size)
    _, later = lax.scan(interval, start, (begin, end, jnp.diff(course.ts)))
    return jnp.concatenate([start[None], later])
