"""Signature of an effect: its perturbation of force, stop, base and readings along the fitted motion."""

import dataclasses
import math
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from identification.likelihood.linearised import Linearised
from identification.likelihood.response import Perturbation
from identification.windows import measured_input
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from vibrojax.channels import EVERY_CHANNEL, channels
from vibrojax.compiling import soon_compiled
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.effects import AbstractEffect, Motion
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS, Trajectory
from vibrojax.steps import runge_kutta_step
from vibrojax.system import System

_ANGLE = 0.6
"""Longest integration step of an effect's own states, in radians of its fastest vibration."""
_SIZES = (1, 4, 8)
"""Batch sizes of effects; the last effect fills up a batch, so that few programs are compiled."""
_ALONG = ("u", "v", "acceleration", "push", "in_contact", "approach_speed", "own")


class Course(eqx.Module):
    """The fitted motion along one record, (time,) each, and its system."""

    ts: Float[Array, " time"]
    u: Float[Array, " time"]
    v: Float[Array, " time"]
    acceleration: Float[Array, " time"]
    push: Float[Array, " time"]
    in_contact: Array
    readings: dict[str, Float[Array, " time"]]
    system: System
    """Without the model's effects, so that compiled programs do not depend on them."""


def courses(prepared: Prepared, at: Linearised, estimate: Estimate) -> tuple[Course, ...]:
    """The fitted motion along every record, with a continuous clock; all padded to the longest."""
    found, longest = [], max(len(record.time) for record in prepared.experiment.records)
    model = prepared.model.replace(prepared.layout.physical(estimate.shared))
    for index, record in enumerate(prepared.experiment.records):
        (amplitude, phase, gap_error), others = estimate.nuisances[index, :3], estimate.nuisances[index, prepared.layout.without_effects :]
        own = {p.name: p.to_physical(value) for p, value in zip(prepared.layout.record_parameters, others, strict=True)}
        here = model.replace(own).in_record(lambda file, record=record: 1.0 if file == record.file else 0.0)
        base = prepared.carts[index] or Harmonic(amplitude, phase, record.excitation_frequency or 0.0)
        applied = measured_input.measured_force(record) if record.kind == "forced" else Unforced()
        system = here.system(gap=record.gap + gap_error, base=base, applied=applied)
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), system)
        along = {name: jnp.asarray(_padded(at.of_record(getattr(at, name), index, len(record.time)), longest)) for name in _ALONG}
        step = record.time[-1] - record.time[-2]
        ts = jnp.asarray(np.concatenate([record.time, record.time[-1] + step * np.arange(1, longest - len(record.time) + 1)]))
        moving = {name: along.pop(name) for name in ("approach_speed", "own")}
        trajectory = Trajectory(
            ts=ts, u=along["u"], v=along["v"], in_contact=along["in_contact"], result=jnp.asarray(SUCCESS), steps=jnp.asarray(0), **moving
        )
        readings = channels(system, trajectory)
        found.append(Course(ts=ts, readings=readings, system=dataclasses.replace(system, effects=()), **along))
    return tuple(found)


def _padded(values: np.ndarray, samples: int) -> np.ndarray:
    """Values extended to `samples` with their last value."""
    return np.pad(values, [(0, samples - len(values)), *[(0, 0)] * (values.ndim - 1)], mode="edge")


def signatures(at: Linearised, courses: tuple[Course, ...], files: tuple[str, ...], effects: list[AbstractEffect]) -> list[Perturbation]:
    """Perturbation due to every effect of one class (and the same channel and record), in the windows' shape."""
    size = next(size for size in _SIZES if size >= len(effects))
    filled = [*effects, *effects[-1:] * (size - len(effects))]
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf, jnp.float64) for leaf in leaves]), *filled)
    shape = (len(effects), *at.u.shape)
    names = ("force", "stop_position", "stop_velocity", "base_displacement", "base_acceleration")
    whole = {name: np.zeros(shape) for name in names}
    readings: dict[str, np.ndarray] = {}
    for index, course in enumerate(courses):
        if effects[0].record not in (None, files[index]):
            continue
        substeps = jnp.asarray(max(_substeps(effect, course) for effect in effects))
        parts, read = jax.tree.map(lambda values: np.asarray(values)[: len(effects)], _along(stacked, course, substeps))
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
    """Time series of the effect's own states along every record, (time, own), from rest at its start."""
    effect = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), effect)
    return [np.asarray(_own_along(effect, course, jnp.asarray(_substeps(effect, course)))) for course in courses]


def _substeps(effect: AbstractEffect, course: Course) -> int:
    """Integration steps of an effect's own states per sampling interval."""
    sampling = float(course.ts[1] - course.ts[0])
    return max(1, math.ceil(2.0 * math.pi * float(effect.fastest_hz) * sampling / _ANGLE))


@soon_compiled
def _own_along(effect: AbstractEffect, course: Course, substeps: Int[Array, ""]):
    motion = _motion(course)
    own = _own(course, effect, motion, substeps)
    return effect.memory(course.readings, effect.read(course.readings, motion, own), own)


@soon_compiled
def _along(effects: AbstractEffect, course: Course, substeps: Int[Array, ""]):
    """Perturbations due to stacked effects along one record."""
    return jax.vmap(partial(_one, course, substeps))(effects)


def _one(course: Course, substeps: Int[Array, ""], effect: AbstractEffect):
    system, motion = course.system, _motion(course)
    own = _own(course, effect, motion, substeps)
    moved = effect.base(system.base)
    read = effect.read(course.readings, motion, own)
    further = _further_push(system, effect, motion)
    parts = {
        "force": effect.force(motion, own) + _second_stop(system, effect, motion) - further,
        "stop_position": effect.stop_position(course.ts, own),
        "stop_velocity": effect.stop_velocity(course.ts, own),
        "base_displacement": moved.displacement(course.ts) - system.base.displacement(course.ts) + effect.base_displacement(own),
        "base_acceleration": moved.acceleration(course.ts)
        - system.base.acceleration(course.ts)
        + effect.base_acceleration(own, course.push),
    }
    shown = {name: read[name] - course.readings[name] for name in EVERY_CHANNEL if name != "applied_force"}
    return parts, shown | {"impact_force": shown["impact_force"] + further}


def _second_stop(system: System, effect: AbstractEffect, motion: Motion) -> Float[Array, " time"]:
    """Contact force of a stop behind the hammer, along a motion without that stop, N."""
    if effect.back_gap is None or not isinstance(system.law, AbstractCompliantLaw):
        return jnp.zeros_like(motion.u)
    return _push(system.law, -motion.u - effect.back_gap, -motion.v)


def _further_push(system: System, effect: AbstractEffect, motion: Motion) -> Float[Array, " time"]:
    """Contact force of the front stop as the effect changes it, less that of the nominal model, along a motion without the effect, N."""
    law, gap = effect.stop(system.law, system.gap)
    if law is system.law or not (isinstance(law, AbstractCompliantLaw) and isinstance(system.law, AbstractCompliantLaw)):
        return jnp.zeros_like(motion.u)
    return _push(law, motion.u - gap, motion.v) - _push(system.law, motion.indentation, motion.v)


def _push(law: AbstractCompliantLaw, indentation: Float[Array, " time"], rate: Float[Array, " time"]) -> Float[Array, " time"]:
    """Contact force of a stop, N; a law that depends on approach speed gets 0.1 m/s."""
    pushed = law.force(jnp.maximum(indentation, 0.0), rate, jnp.full_like(indentation, 0.1))
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


def _own(course: Course, effect: AbstractEffect, motion: Motion, substeps: Int[Array, ""]) -> Float[Array, "time own"]:
    """Time series of the effect's own states, from rest at the record's start."""
    size = len(effect.own_states)
    if size == 0:
        return jnp.zeros((len(course.ts), 0))
    inputs = (motion, course.push, course.acceleration)
    begin, end = jax.tree.map(lambda x: x[:-1], inputs), jax.tree.map(lambda x: x[1:], inputs)

    def interval(own, ends):
        (left, right), dt = ends[:2], ends[2]

        def rates(part, own):
            motion, push, acceleration = jax.tree.map(lambda a, b: a if a.dtype == bool else a + part * (b - a), left, right)
            return dt * effect.rates(motion, own, push, acceleration)

        h = 1.0 / substeps

        def step(k, own):
            return runge_kutta_step(rates, k * h, own, h)[0]

        own = lax.fori_loop(0, substeps, step, own)
        return own, own

    start = jnp.zeros(size)
    _, later = lax.scan(interval, start, (begin, end, jnp.diff(course.ts)))
    return jnp.concatenate([start[None], later])
