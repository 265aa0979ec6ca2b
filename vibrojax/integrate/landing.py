"""Runge-Kutta steps that land on every sample, touch and release; natively batched."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.contact import AbstractCompliantLaw, AbstractInstantaneousLaw
from vibrojax.contact.base import SLOWEST_APPROACH
from vibrojax.integrate.base import NOT_FINITE, STEP_LIMIT, SUCCESS, AbstractIntegrator, Trajectory
from vibrojax.integrate.crossing import crossing, landing_correction
from vibrojax.shapes import Number
from vibrojax.system import System

_Lanes = Float[Array, " lanes"]
_SLOWEST_TOUCH = 1e-4
"""m/s; an approach slower than this does not lengthen the contact steps further."""


class _Carry(NamedTuple):
    """State of all lanes between two steps."""

    t: _Lanes
    u: _Lanes
    v: _Lanes
    approach_speed: _Lanes
    in_contact: Bool[Array, " lanes"]
    landing: Bool[Array, " lanes"]
    """The next step is to end on the boundary of contact, after `h_landing`."""
    h_landing: _Lanes
    sample: Int[Array, " lanes"]
    """Next sample to reach."""


class _Row(NamedTuple):
    """What is kept of each step."""

    u: _Lanes
    v: _Lanes
    approach_speed: _Lanes
    in_contact: Bool[Array, " lanes"]
    sample: Int[Array, " lanes"]


class Landing(AbstractIntegrator):
    """Classical Runge-Kutta of order four, one step a sample in flight, finer in contact, no step across a touch or a release.

    No step straddles the kink of the contact law at delta = 0. The error falls with order four in the contact steps where the law is
    linear, and with order n + 1 where delta^n is not smooth at the touch (n = 1.5, 2.5). A step that would cross the
    boundary is taken back and repeated with the length at which a cubic through its ends reaches the boundary. The landing time is
    differentiable (one Newton correction), so forward-mode derivatives include the jump that a discontinuous force causes.
    Reverse mode is not supported (the loop has no fixed length).

    Arguments:
        contact_steps: steps in an impact of average duration, at least; the samples inside an impact come on top.
        flight_step: longest step in flight, s.
        max_steps_per_sample: loops stop after this many steps a sample, with `STEP_LIMIT`.

    Source: landing by interpolation as in E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.6.
    """

    contact_steps: Number = 40.0
    flight_step: Number = 2e-3
    max_steps_per_sample: int = eqx.field(static=True, default=3)

    def __call__(self, system: System, ts: Float[Array, " time"], state: Float[Array, "2"]) -> Trajectory:
        """Integrate one trajectory; see `AbstractIntegrator`."""
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=ts.dtype)[None], system)
        many = self.batch(system, ts[None], state[None], jnp.full((1,), ts.shape[0]))
        return Trajectory(ts, many.u[0], many.v[0], many.in_contact[0], many.approach_speed[0], many.result[0], many.steps)

    def batch(
        self, systems: System, ts: Float[Array, "lanes time"], states: Float[Array, "lanes 2"], lengths: Int[Array, " lanes"]
    ) -> Trajectory:
        """Integrate many trajectories side by side.

        Arguments:
            systems: one system with a leading lane axis on every array leaf.
            ts: times of each lane, s.
            states: initial (u, u') of each lane.
            lengths: how many of the times of each lane count; what is returned beyond is meaningless.
        """
        limit = self.max_steps_per_sample * ts.shape[1] + 1000
        start = self._start(systems, ts, states)
        history = jax.tree.map(lambda leaf: jnp.zeros((limit, *leaf.shape), leaf.dtype).at[0].set(leaf), _row(start))

        def unfinished(loop):
            count, carry, _ = loop
            return (count < limit - 1) & jnp.any((carry.sample < lengths) & jnp.isfinite(carry.u))

        def advance(loop):
            count, carry, rows = loop
            carry = jax.vmap(self._step)(systems, ts, carry)
            rows = jax.tree.map(lambda r, leaf: lax.dynamic_update_index_in_dim(r, leaf, count + 1, 0), rows, _row(carry))
            return count + 1, carry, rows

        count, last, history = lax.while_loop(unfinished, advance, (0, start, history))
        return _at_samples(history, count, last, ts, lengths)

    def _start(self, systems: System, ts: Float[Array, "lanes time"], states: Float[Array, "lanes 2"]) -> _Carry:
        u, v = states[:, 0], states[:, 1]
        lanes = u.shape[0]
        rigid = isinstance(systems.law, AbstractInstantaneousLaw)
        touching = (lax.stop_gradient(jax.vmap(lambda system, u: system.indentation(u))(systems, u)) > 0) & (not rigid)
        return _Carry(
            t=ts[:, 0] + 0.0 * u,
            u=u,
            v=v,
            approach_speed=jnp.maximum(jnp.abs(v), _SLOWEST_TOUCH),
            in_contact=touching,
            landing=jnp.zeros(lanes, bool),
            h_landing=jnp.zeros(lanes, u.dtype),
            sample=jnp.ones(lanes, int),
        )

    def _step(self, system: System, ts: Float[Array, " time"], carry: _Carry) -> _Carry:
        """One trial step of one lane: accepted, or taken back because it crosses the boundary of contact."""
        to_sample = ts[jnp.minimum(carry.sample, ts.shape[0] - 1)] - carry.t
        pieces = jnp.ceil(lax.stop_gradient(to_sample / self._longest(system, carry)) - 1e-6)
        h = jnp.where(carry.landing, carry.h_landing, to_sample / jnp.maximum(pieces, 1.0))
        u1, v1, a1 = self._runge_kutta(system, carry, h)
        before, after = system.indentation(carry.u), system.indentation(u1)
        outward = jnp.where(carry.in_contact, -1.0, 1.0)
        crosses, h_landing = crossing(outward * before, outward * carry.v, outward * after, outward * v1, h)
        crosses &= ~carry.landing

        correction = jnp.where(carry.landing, landing_correction(after, v1), 0.0)
        t1, u1, v1 = carry.t + h + correction, u1 + v1 * correction, v1 + a1 * correction
        touches = carry.landing & ~carry.in_contact
        v_touch = jnp.maximum(v1, SLOWEST_APPROACH)
        approach_speed = jnp.where(touches, v_touch, carry.approach_speed)
        if isinstance(system.law, AbstractInstantaneousLaw):
            v1 = jnp.where(touches, -system.law.rebound_speed(v_touch), v1)
            in_contact = carry.in_contact
        else:
            in_contact = carry.in_contact ^ carry.landing
        arrives = ~carry.landing & (pieces <= 1.0)
        accepted = _Carry(
            t=jnp.where(arrives, ts[jnp.minimum(carry.sample, ts.shape[0] - 1)], t1),
            u=u1,
            v=v1,
            approach_speed=approach_speed,
            in_contact=in_contact,
            landing=jnp.zeros_like(crosses),
            h_landing=h_landing,
            sample=carry.sample + arrives.astype(int),
        )
        rejected = carry._replace(landing=jnp.ones_like(crosses), h_landing=h_landing)
        return jax.tree.map(lambda yes, no: jnp.where(crosses, yes, no), rejected, accepted)

    def _longest(self, system: System, carry: _Carry) -> Float[Array, ""]:
        """Longest step that the present state allows, s."""
        if not isinstance(system.law, AbstractCompliantLaw):
            return jnp.asarray(self.flight_step)
        speed = jnp.maximum(carry.approach_speed, _SLOWEST_TOUCH)
        in_contact = system.law.contact_time(jnp.asarray(system.mass), speed) / self.contact_steps
        return jnp.where(carry.in_contact, jnp.minimum(in_contact, self.flight_step), self.flight_step)

    def _runge_kutta(self, system: System, carry: _Carry, h: Float[Array, ""]):
        """State after h, and the acceleration there (of the last stage)."""

        def acceleration(t, u, v):
            force = jnp.where(carry.in_contact, system.contact_force(u, v, carry.approach_speed), 0.0)
            return system.relative_acceleration(t, u, v, force)

        t, u, v, half = carry.t, carry.u, carry.v, 0.5 * h
        a_1 = acceleration(t, u, v)
        v_2 = v + half * a_1
        a_2 = acceleration(t + half, u + half * v, v_2)
        v_3 = v + half * a_2
        a_3 = acceleration(t + half, u + half * v_2, v_3)
        v_4 = v + h * a_3
        a_4 = acceleration(t + h, u + h * v_3, v_4)
        return u + h / 6 * (v + 2 * v_2 + 2 * v_3 + v_4), v + h / 6 * (a_1 + 2 * a_2 + 2 * a_3 + a_4), a_4


def _row(carry: _Carry) -> _Row:
    return _Row(carry.u, carry.v, carry.approach_speed, carry.in_contact, carry.sample)


def _at_samples(history: _Row, count, last: _Carry, ts, lengths) -> Trajectory:
    """Pick from the history of all steps those at which a sample was reached."""
    wanted = jnp.arange(1, ts.shape[1] + 1)
    reached = jnp.where(jnp.arange(history.sample.shape[0])[:, None] <= count, history.sample, ts.shape[1] + 1)
    row = jax.vmap(lambda column: jnp.searchsorted(column, wanted), in_axes=1)(reached)
    row = jnp.minimum(row, count)

    def pick(leaf):
        return jnp.take_along_axis(leaf.T, row, axis=1)

    finite = jnp.isfinite(last.u) & jnp.isfinite(last.v)
    result = jnp.where(finite, jnp.where(last.sample >= lengths, SUCCESS, STEP_LIMIT), NOT_FINITE)
    return Trajectory(ts, pick(history.u), pick(history.v), pick(history.in_contact), pick(history.approach_speed), result, count)
