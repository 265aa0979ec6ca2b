"""What an effect would do along the fitted motion: its own hooks, called on that motion."""

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
from vibrojax.effects import AbstractEffect, Motion
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.system import System

_SUBSTEPS = 8
"""Steps of an effect's own states in a sampling interval."""


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
    """The fitted motion along every record, with a continuous clock."""
    found = []
    values = prepared.layout.physical(estimate.shared)
    model = prepared.model.replace(values)
    for index, record in enumerate(prepared.experiment.records):
        amplitude, phase, gap_error = estimate.nuisances[index, :3]
        base = prepared.carts[index] or Harmonic(amplitude, phase, record.excitation_frequency or 0.0)
        system = model.system(gap=record.gap + gap_error, base=base, applied=Unforced())
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), system)
        along = {
            name: jnp.asarray(at.of_record(getattr(at, name), index, len(record.time)))
            for name in ("u", "v", "acceleration", "push", "in_contact")
        }
        ts = jnp.asarray(record.time)
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


def signatures(at: Linearised, courses: tuple[Course, ...], files: tuple[str, ...], effects: list[AbstractEffect]) -> list[Perturbation]:
    """Perturbation of every effect of one class (and the same channel and record), in the windows' shape."""
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf, jnp.float64) for leaf in leaves]), *effects)
    shape = (len(effects), *at.u.shape)
    names = ("force", "stop_position", "stop_velocity", "base_displacement", "base_acceleration")
    whole = {name: np.zeros(shape) for name in names}
    readings: dict[str, np.ndarray] = {}
    for index, course in enumerate(courses):
        if effects[0].record not in (None, files[index]):
            continue
        parts, read = jax.tree.map(np.asarray, _along(stacked, course))
        for name in names:
            for k in range(len(effects)):
                at.in_windows(parts[name][k], index, whole[name][k])
        for channel, values in read.items():
            into = readings.setdefault(channel, np.zeros(shape))
            for k in range(len(effects)):
                at.in_windows(values[k], index, into[k])
    return [
        Perturbation(**{name: whole[name][k] for name in names}, readings={c: v[k] for c, v in readings.items() if v[k].any()})
        for k in range(len(effects))
    ]


@eqx.filter_jit
def _along(effects: AbstractEffect, course: Course):
    """Hooks of stacked effects along one record."""
    return jax.vmap(partial(_one, course))(effects)


def _one(course: Course, effect: AbstractEffect):
    system = course.system
    motion = Motion(
        t=course.ts,
        u=course.u,
        v=course.v,
        indentation=system.indentation(course.u),
        indentation_rate=course.v,
        in_contact=course.in_contact,
    )
    own = _own(course, effect, motion)
    moved = effect.base(system.base)
    read = effect.read(course.readings, course.ts, own)
    parts = {
        "force": effect.force(motion, own),
        "stop_position": effect.stop_position(course.ts, own),
        "stop_velocity": effect.stop_velocity(course.ts, own),
        "base_displacement": moved.displacement(course.ts) - system.base.displacement(course.ts) + effect.base_displacement(own),
        "base_acceleration": moved.acceleration(course.ts)
        - system.base.acceleration(course.ts)
        + effect.base_acceleration(own, course.push),
    }
    return parts, {name: read[name] - course.readings[name] for name in CHANNELS if name != "applied_force"}


def _own(course: Course, effect: AbstractEffect, motion: Motion) -> Float[Array, "time own"]:
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

        h = 1.0 / _SUBSTEPS
        for k in range(_SUBSTEPS):
            one = rates(own, k * h)
            two = rates(own + 0.5 * h * dt * one, (k + 0.5) * h)
            three = rates(own + 0.5 * h * dt * two, (k + 0.5) * h)
            four = rates(own + h * dt * three, (k + 1) * h)
            own = own + h * dt / 6 * (one + 2 * two + 2 * three + four)
        return own, own

    start = jnp.zeros(size)
    _, later = lax.scan(interval, start, (begin, end, jnp.diff(course.ts)))
    return jnp.concatenate([start[None], later])
