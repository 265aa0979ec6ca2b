"""Impacts as the steps of a contact see them: peak force, impulse, contact time and approach speed, none of them read off samples.

Within a step the push of the stop is the cubic through its values and rates at both ends, F and dF/dt; its top, where dF/dt = 0, is the
peak, its integral the impulse. Every study takes its forces from here, or in `vibrojax.batch.contact_steps` from the same cubic through
that engine's own steps.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.contact import AbstractCompliantLaw
from vibrojax.integrate.landing import LandingState
from vibrojax.shapes import Scalars
from vibrojax.steps import cubic, cubic_top
from vibrojax.system import System

_PARTS = np.linspace(0.0, 1.0, 65)
"""Of the step that holds a peak, among which its instant is looked for."""


class Push(NamedTuple):
    """Push of the stop in front on the hammer at the end of a step."""

    force: Scalars
    """N; 0 of a rigid stop."""
    rate: Scalars
    """dF/dt, N/s."""


def push_of(system: System, at: LandingState) -> Push:
    """The push and its rate where a lane stands; 0 where it is not in contact.

    Arguments:
        system: the rig of the lane.
        at: one lane.
    """
    if not isinstance(system.law, AbstractCompliantLaw):
        return Push(jnp.zeros_like(at.u), jnp.zeros_like(at.u))
    forces = system.forces(at.t, at.u, at.v, at.own, at.in_contact, at.approach_speed)

    def push(t: Scalars, u: Scalars, v: Scalars, own: Float[Array, "*lanes own"]) -> Scalars:
        near = system.approach(t, u, v, own)
        return system.law.force(jnp.maximum(near.indentation, 0.0), near.rate, at.approach_speed) * near.side  # type: ignore[attr-defined]

    along = (jnp.ones_like(at.t), at.v, forces.acceleration, forces.own_rates)
    _, rate = jax.jvp(push, (at.t, at.u, at.v, at.own), along)
    return Push(forces.push, jnp.where(at.in_contact, rate, 0.0))


def peak_of_step(before: Push, after: Push, h: Scalars) -> Scalars:
    """Largest push in a step of length h, s, that ends in `after`, N.

    Example:
        >>> one = jnp.asarray(1.0)
        >>> float(peak_of_step(Push(0 * one, 2 * one), Push(0 * one, -2 * one), 0.5 * one))
        0.25
    """
    return cubic_top(before.force, h * before.rate, after.force, h * after.rate)


class Impacts(NamedTuple):
    """Every impact that began and ended in a stretch of motion, in the order of time, each field `(impacts,)`."""

    touch: np.ndarray
    """Time of the touch, s."""
    approach_speed: np.ndarray
    """v-, m/s."""
    peak_force: np.ndarray
    """N"""
    peak_time: np.ndarray
    """Time at which dF/dt = 0, s."""
    impulse: np.ndarray
    """N s"""
    duration: np.ndarray
    """From touch to release, s."""


def impacts(system: System, points: LandingState, count: int) -> Impacts:
    """The impacts in the steps of one lane.

    Arguments:
        system: the rig, its law compliant: at a rigid stop an impact lasts no time, and none is found.
        points: ends of the steps, `(points,)`, as `Landing.steps` has them.
        count: of steps.

    Returns:
        Impacts on the stop in front. One that is under way at either end of the stretch is left out.
    """
    stamps = np.asarray(points.t)[: count + 1]
    kept = np.append(True, np.diff(stamps) > 0)  # a step that was taken back repeats its beginning
    ends: Any = jax.tree.map(lambda leaf: jnp.asarray(leaf)[: count + 1][kept], points)
    t, inside = np.asarray(ends.t), np.asarray(ends.in_contact)
    held = ends._replace(in_contact=jnp.ones_like(ends.in_contact))
    force, rate = (np.asarray(part) for part in jax.vmap(push_of, (None, 0))(system, held))
    touches = 1 + np.flatnonzero(inside[1:] & ~inside[:-1])
    releases = 1 + np.flatnonzero(inside[:-1] & ~inside[1:])
    rows = []
    for begin in touches:
        for end in releases[releases > begin][:1]:
            part = slice(begin, end + 1)
            row = _impact(t[part], force[part], rate[part])
            rows.append((t[begin], float(ends.approach_speed[begin]), *row, t[end] - t[begin]))
    return Impacts(*np.reshape([row for row in rows if row[2] > 0], (-1, len(Impacts._fields))).T)


def _impact(t: np.ndarray, force: np.ndarray, rate: np.ndarray) -> tuple[float, float, float]:
    """Peak force, its time, and impulse of one contact, from the ends of its steps."""
    h = np.diff(t)
    rises, falls = h * rate[:-1], h * rate[1:]
    tops = np.asarray(cubic_top(*(jnp.asarray(part) for part in (force[:-1], rises, force[1:], falls))))
    top = int(np.argmax(tops))
    inside = np.asarray(cubic(jnp.asarray(_PARTS), *(jnp.asarray(part[top]) for part in (force[:-1], rises, force[1:], falls)))[0])
    impulse = float(np.sum(h * (0.5 * (force[:-1] + force[1:]) + (rises - falls) / 12.0)))
    return float(tops[top]), float(t[top] + h[top] * _PARTS[np.argmax(inside)]), impulse
