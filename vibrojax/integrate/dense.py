"""From the ends of all steps to the samples in between."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int


class Point(NamedTuple):
    """The end of a step, of every lane."""

    t: Float[Array, "*points lanes"]
    u: Float[Array, "*points lanes"]
    v: Float[Array, "*points lanes"]
    """Velocity with which the next step begins."""
    v_arriving: Float[Array, "*points lanes"] | None
    """Velocity with which the last step ended, where a rigid stop can make it another than `v`."""
    approach_speed: Float[Array, "*points lanes"]
    in_contact: Bool[Array, "*points lanes"]
    own: Float[Array, "*points lanes own"]
    own_rates: Float[Array, "*points lanes own"]


def at_samples(points: Point, count: Int[Array, ""], ts: Float[Array, "lanes time"]):
    """u, u', contact and approach speed at the samples, each of shape (lanes, time), and the effects' own states, (lanes, time, own).

    Between the ends of each step lies the cubic through them.

    Points of one lane may repeat (a step that was taken back, a lane that has ended); those beyond `count` are not used. The cubic
    departs from the motion by h^4 / 384 of its fourth derivative, its slope by a third-order term.
    """
    used = jnp.arange(points.t.shape[0])[:, None] <= count
    stamps = jnp.where(used, lax.stop_gradient(points.t), jnp.inf)
    begin = jax.vmap(lambda column, times: jnp.searchsorted(column, times, side="right"), in_axes=(1, 0))(stamps, ts) - 1
    begin = jnp.clip(begin.astype(count.dtype), 0, jnp.maximum(count - 1, 0)).T

    def pick(leaf: Array, rows: Int[Array, "time lanes"]) -> Array:
        return jnp.take_along_axis(leaf, rows, axis=0).T

    arriving = points.v if points.v_arriving is None else points.v_arriving
    t0, u0, v0 = (pick(leaf, begin) for leaf in (points.t, points.u, points.v))
    t1, u1, v1 = (pick(leaf, begin + 1) for leaf in (points.t, points.u, arriving))
    moving = t1 > t0
    h = jnp.where(moving, t1 - t0, 1.0)
    s = jnp.clip(jnp.where(moving, (ts - t0) / h, 0.0), 0.0, 1.0)
    m0, m1 = jnp.where(moving, h * v0, 0.0), jnp.where(moving, h * v1, 0.0)
    c2, c3 = 3 * (u1 - u0) - 2 * m0 - m1, m0 + m1 - 2 * (u1 - u0)
    u = u0 + s * (m0 + s * (c2 + s * c3))
    v = v0 + s * (2 * c2 + 3 * s * c3) / h
    own = _own_at(points, begin, s, h)
    return u, v, pick(points.in_contact, begin), pick(points.approach_speed, begin), own


def _own_at(points: Point, begin: Int[Array, "time lanes"], s: Float[Array, "lanes time"], h: Float[Array, "lanes time"]) -> Array:
    """Own states at part s of steps of length h."""
    if points.own.shape[-1] == 0:
        return jnp.zeros((*s.shape, 0), s.dtype)

    def pick(leaf: Array, rows: Array) -> Array:
        return jnp.swapaxes(jnp.take_along_axis(leaf, rows[:, :, None], axis=0), 0, 1)

    w0, w1 = pick(points.own, begin), pick(points.own, begin + 1)
    m0, m1 = h[..., None] * pick(points.own_rates, begin), h[..., None] * pick(points.own_rates, begin + 1)
    s = s[..., None]
    c2, c3 = 3 * (w1 - w0) - 2 * m0 - m1, m0 + m1 - 2 * (w1 - w0)
    return w0 + s * (m0 + s * (c2 + s * c3))
