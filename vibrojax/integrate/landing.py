"""Runge-Kutta steps that land on every touch and release; natively batched.

From the ends of all steps the samples in between are read off a cubic.
"""

import functools
from collections.abc import Iterable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.contact import AbstractCompliantLaw, AbstractInstantaneousLaw
from vibrojax.contact.base import SLOWEST_APPROACH
from vibrojax.effects.base import AbstractEffect
from vibrojax.integrate.base import NOT_FINITE, STEP_LIMIT, SUCCESS, AbstractIntegrator, Trajectory
from vibrojax.shapes import Number
from vibrojax.steps import cubic, runge_kutta_step
from vibrojax.system import System

_Scalars = Float[Array, "..."]
_GRAZE = 1e-6
"""m/s; a touch slower than this is a graze: the derivative of its time grows without bound and is taken as zero."""
SLOWEST_TOUCH = 1e-4
"""m/s; an approach slower than this does not lengthen the contact steps further."""
_TO_REVERSAL = 0.5
"""Longest step towards a reversal of dry friction, over the time to it."""
_SWITCHED = 4.0
"""Velocity over that of a friction's switch beyond which the force is constant."""
STEPS_OF_A_VIBRATION = 40.0
"""Flight steps in a period of the fastest vibration of an effect, at least."""


def crossing(
    before: _Scalars, rate_before: _Scalars, after: _Scalars, rate_after: _Scalars, h: _Scalars
) -> tuple[Bool[Array, "..."], _Scalars]:
    """Whether the cubic through both ends of a step rises above zero on its way, if only for a moment, and when it first does.

    A step starts at or below zero by definition, whatever rounding says. Newton's method starts from the root of a parabola, which is
    right even where a step starts on the boundary and comes back to it after a small part of its length.

    Arguments:
        before: signed distance past the boundary at the start of the step, m.
        rate_before: its rate, m/s.
        after: distance at the end, m.
        rate_after: rate at the end, m/s.
        h: length of the step, s.

    Returns:
        crosses, and the time from the start of the step, s, without derivative (see `landing_correction`).
    """
    p0, m0, p1, m1 = (lax.stop_gradient(x) for x in (jnp.minimum(before, 0.0), h * rate_before, after, h * rate_after))
    turns = (p1 <= 0) & (m0 > 0) & (m1 < 0)
    top = jnp.where(turns, m0 / jnp.where(turns, m0 - m1, 1.0), 1.0)
    p_top, _ = cubic(top, p0, m0, p1, m1)
    crosses = p_top > 0

    s = jnp.where(crosses, top * _parabola_root(p0, top * m0, p_top), 0.0)
    low, high = jnp.zeros_like(s), top
    for _ in range(4):
        value, slope = cubic(s, p0, m0, p1, m1)
        low, high = jnp.where(value > 0, low, s), jnp.where(value > 0, s, high)
        newton = s - value / jnp.where(slope == 0, 1.0, slope)
        s = jnp.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    return crosses, lax.stop_gradient(s * h)


def landing_correction(distance: _Scalars, rate: _Scalars) -> _Scalars:
    """Newton correction of the time of a landing, s: its value is rounding error, its derivative is that of the landing time."""
    moving = jnp.abs(rate) > _GRAZE
    return jnp.where(moving, -distance / jnp.where(moving, rate, 1.0), 0.0)


def _parabola_root(p0: _Scalars, slope: _Scalars, p1: _Scalars) -> _Scalars:
    """Upward root in [0, 1] of the parabola from p0 <= 0, with that slope there, to p1 > 0; without cancellation."""
    a = p1 - p0 - slope
    root = jnp.sqrt(jnp.maximum(slope**2 - 4.0 * a * p0, 0.0))
    rising = slope > 0
    over = jnp.where(rising, slope + root, 2.0 * a)
    return jnp.where(rising, -2.0 * p0, root - slope) / jnp.where(over == 0, 1.0, over)


class LandingState(NamedTuple):
    """State between two steps: of all lanes, of one, or of all lanes at the ends of many steps, then without the next landing."""

    t: _Scalars
    u: _Scalars
    v: _Scalars
    """Velocity with which the next step begins."""
    approach_speed: _Scalars
    in_contact: Bool[Array, "..."]
    landing: Bool[Array, "..."]
    """The next step is to end on the boundary of contact, after `h_landing`."""
    h_landing: _Scalars
    v_arriving: _Scalars | None
    """Velocity at the end of the last step, before the jump that a rigid stop causes there; None where the stop is compliant."""
    own: Float[Array, "... own"]
    """States of the system's effects."""
    own_rates: Float[Array, "... own"]
    """Their rates at the end of the last step."""


def at_samples(points: LandingState, count: Int[Array, ""], ts: Float[Array, "lanes time"]):
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
    u, slope = cubic(s, u0, h * v0, u1, h * v1)
    v = slope / h  # of a lane that has ended, s is 0 and h 1: its last velocity
    own = _own_at(points, begin, s, h)
    return u, v, pick(points.in_contact, begin), pick(points.approach_speed, begin), own


def _own_at(points: LandingState, begin: Int[Array, "time lanes"], s: Float[Array, "lanes time"], h: Float[Array, "lanes time"]) -> Array:
    """Own states at part s of steps of length h."""
    if points.own.shape[-1] == 0:
        return jnp.zeros((*s.shape, 0), s.dtype)

    def pick(leaf: Array, rows: Array) -> Array:
        return jnp.swapaxes(jnp.take_along_axis(leaf, rows[:, :, None], axis=0), 0, 1)

    w0, w1 = pick(points.own, begin), pick(points.own, begin + 1)
    m0, m1 = h[..., None] * pick(points.own_rates, begin), h[..., None] * pick(points.own_rates, begin + 1)
    return cubic(s[..., None], w0, m0, w1, m1)[0]


class Landing(AbstractIntegrator):
    """Classical Runge-Kutta of order four, finer in contact than in flight, no step across a touch or a release.

    Steps do not care for the samples: these are read off the cubic through the ends of the step in which they lie. No step straddles
    the kink of the contact law at delta = 0, so the error falls with order four in the contact steps where the law is linear, and with
    order n + 1 where delta^n is not smooth at the touch (n = 1.5, 2.5). A step that would cross the boundary is taken back and repeated
    with the length at which a cubic through its ends reaches it. The time of the landing is differentiated too (one Newton correction):
    forward-mode derivatives then include the jump of a discontinuous force, and elsewhere are a hundred times nearer the truth, because
    the steps move with the touch. Reverse mode is not supported (the loop has no fixed length).

    Where dry friction switches with the sign of the velocity, steps in flight shorten towards the reversal. Where it holds the hammer,
    steps are exponential.

    Arguments:
        contact_steps: steps in an impact of average duration, at least.
        flight_step: longest step, s; with a sampled excitation no longer than its sampling interval.
        most_steps: the loop stops after so many steps, with `STEP_LIMIT`; by default three a sample and a thousand.

    Source: landing by interpolation as in E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.6.
    """

    contact_steps: Number = 60.0
    flight_step: Number = 5e-4
    most_steps: int | None = eqx.field(static=True, default=None)

    def __call__(self, system: System, ts: Float[Array, " time"], state: Float[Array, " states"]) -> Trajectory:
        at_rest = jnp.zeros(2 + system.own_size - state.shape[0], state.dtype)
        state = jnp.concatenate([state, at_rest])
        system = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=ts.dtype)[None], system)
        many = self.batch(system, ts[None], state[None], jnp.full((1,), ts.shape[0]))
        first = (many.u[0], many.v[0], many.in_contact[0], many.approach_speed[0], many.result[0], many.steps, many.own[0])
        return Trajectory(ts, *first)

    def batch(
        self, systems: System, ts: Float[Array, "lanes time"], states: Float[Array, "lanes states"], lengths: Int[Array, " lanes"]
    ) -> Trajectory:
        """Integrate many trajectories side by side.

        Arguments:
            systems: one system with a leading lane axis on every array leaf.
            ts: times of each lane, s.
            states: initial (u, u') of each lane, and the initial states of the system's effects.
            lengths: how many of the times of each lane count; what is returned beyond is meaningless.
        """
        count, last, history, t_end = self.steps(systems, ts, states, lengths)
        finite = jnp.isfinite(last.u) & jnp.isfinite(last.v)
        result = jnp.where(finite, jnp.where(last.t >= t_end, SUCCESS, STEP_LIMIT), NOT_FINITE)
        u, v, in_contact, approach_speed, own = at_samples(history, count, ts)
        return Trajectory(ts, u, v, in_contact, approach_speed, result, count, own)

    def steps(self, systems: System, ts: Float[Array, "lanes time"], states: Float[Array, "lanes states"], lengths: Int[Array, " lanes"]):
        """The steps themselves: their count, the last state of all lanes, the ends of the steps, `(points, lanes)`, and the last times.

        Arguments are those of `batch`.
        """
        limit = 3 * ts.shape[1] + 1000 if self.most_steps is None else self.most_steps
        t_end = jnp.take_along_axis(ts, lengths[:, None] - 1, axis=1)[:, 0]
        start = self.start(systems, ts, states)
        history = jax.tree.map(lambda leaf: jnp.zeros((limit + 1, *leaf.shape), leaf.dtype).at[0].set(leaf), _end(start))

        def unfinished(loop):
            count, carry, _ = loop
            return (count < limit) & jnp.any((carry.t < t_end) & jnp.isfinite(carry.u))

        def advance(loop):
            count, carry, points = loop
            carry = jax.vmap(self.step)(systems, t_end, carry)
            points = jax.tree.map(lambda all_, new: lax.dynamic_update_index_in_dim(all_, new, count + 1, 0), points, _end(carry))
            return count + 1, carry, points

        count, last, history = lax.while_loop(unfinished, advance, (jnp.zeros((), int), start, history))
        return count, last, history, t_end

    def start(self, systems: System, ts: Float[Array, "lanes time"], states: Float[Array, "lanes states"]) -> LandingState:
        """All lanes before their first step, each at the first of its times."""
        u, v, own = states[:, 0], states[:, 1], states[:, 2:]
        lanes = u.shape[0]
        rigid = isinstance(systems.law, AbstractInstantaneousLaw)
        near = jax.vmap(lambda system, *state: system.approach(*state).indentation)(systems, ts[:, 0], u, v, own)
        touching = (lax.stop_gradient(near) > 0) & (not rigid)
        return LandingState(
            t=ts[:, 0] + 0.0 * u,
            u=u,
            v=v,
            approach_speed=jnp.maximum(jnp.abs(v), SLOWEST_TOUCH),
            in_contact=touching,
            landing=jnp.zeros(lanes, bool),
            h_landing=jnp.zeros(lanes, u.dtype),
            v_arriving=v if rigid else None,
            own=own,
            own_rates=jnp.zeros_like(own),
        )

    def step(self, system: System, t_end: Float[Array, ""], carry: LandingState) -> LandingState:
        """One trial step of one lane: accepted, or taken back because it crosses the boundary of contact."""
        remaining, friction = t_end - carry.t, _friction(system, carry)
        longest = self._longest(system, carry, jnp.inf if friction is None else friction.to_reversal)
        last = ~carry.landing & (remaining <= longest)
        h = jnp.where(last, remaining, jnp.where(carry.landing, carry.h_landing, longest))

        def rates(t, state):
            u, v, own = state
            found = system.forces(t, u, v, own, carry.in_contact, carry.approach_speed)
            return v, found.acceleration, found.own_rates

        (u1, v1, own1), (_, acceleration, own_rates) = runge_kutta_step(rates, carry.t, (carry.u, carry.v, carry.own), h)
        if friction is not None:
            u1, v1 = friction.held(carry, h, u1, v1)
        before = system.approach(carry.t, carry.u, carry.v, carry.own)
        after = system.approach(carry.t + h, u1, v1, own1)
        outward = jnp.where(carry.in_contact, -1.0, 1.0)
        crosses, h_landing = crossing(
            outward * before.indentation, outward * before.rate, outward * after.indentation, outward * after.rate, h
        )
        crosses &= ~carry.landing

        correction = jnp.where(carry.landing, landing_correction(after.indentation, after.rate), 0.0)
        t1, u1, v1 = carry.t + h + correction, u1 + v1 * correction, v1 + acceleration * correction
        own1 = own1 + own_rates * correction
        v_arriving = None if carry.v_arriving is None else v1
        touches = carry.landing & ~carry.in_contact
        v_touch = jnp.maximum(system.approach(t1, u1, v1, own1).rate, SLOWEST_APPROACH)
        approach_speed = jnp.where(touches, v_touch, carry.approach_speed)
        if isinstance(system.law, AbstractInstantaneousLaw):
            v1 = jnp.where(touches, -system.law.rebound_speed(v_touch), v1)
            in_contact = carry.in_contact
        else:
            in_contact = carry.in_contact ^ carry.landing
        accepted = LandingState(
            t=jnp.where(last, t_end, t1),
            u=u1,
            v=v1,
            approach_speed=approach_speed,
            in_contact=in_contact,
            landing=jnp.zeros_like(crosses),
            h_landing=h_landing,
            v_arriving=v_arriving,
            own=own1,
            own_rates=own_rates,
        )
        rejected = carry._replace(landing=jnp.ones_like(crosses), h_landing=h_landing)
        return jax.tree.map(lambda yes, no: jnp.where(crosses, yes, no), rejected, accepted)

    def _longest(self, system: System, carry: LandingState, to_reversal: Float[Array, ""] | float) -> Float[Array, ""]:
        """Longest step that the present state allows, s."""
        flight = jnp.minimum(self.flight_step, to_reversal)
        if not isinstance(system.law, AbstractCompliantLaw):
            return flight
        speed = jnp.maximum(carry.approach_speed, SLOWEST_TOUCH)
        in_contact = system.law.contact_time(jnp.asarray(system.mass), speed) / self.contact_steps
        return jnp.where(carry.in_contact, jnp.minimum(in_contact, self.flight_step), flight)


class _Friction(NamedTuple):
    """A force that switches with the velocity, at the start of a step.

    Attributes:
        to_reversal: longest step that resolves the switch, s.
        rate: at which the force brings the hammer to rest, 1/s; without derivative.
        acceleration: u'', m/s^2.
    """

    to_reversal: Float[Array, ""]
    rate: Float[Array, ""]
    acceleration: Float[Array, ""]

    def held(
        self, carry: LandingState, h: Float[Array, ""], u: Float[Array, ""], v: Float[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """State after a step; where the hammer sticks, by an exponential step in place of `u` and `v`.

        v1 = v + a (1 - exp(-c h)) / c, with c the rate: stable for any step, and exact where the force is linear in the velocity.

        Source: M. Hochbruck, A. Ostermann, Exponential integrators, Acta Numerica 19 (2010) 209-286 (exponential Rosenbrock-Euler method).
        """
        sticks = self.rate * h > 1.0
        rate = jnp.where(sticks, self.rate, 1.0)
        slow = carry.v - self.acceleration * jnp.expm1(-rate * h) / rate
        return jnp.where(sticks, carry.u + 0.5 * h * (carry.v + slow), u), jnp.where(sticks, slow, v)


def _friction(system: System, carry: LandingState) -> _Friction | None:
    """The force of the effects that switches with the sign of the velocity; None where there is none.

    Steps halve the velocity down to that of the switch, v_c, and then cover half of it each: (v_c + |u'|) / (2 |u''|).
    """
    speeds = [effect.switch_speed for effect in system.effects if effect.switch_speed is not None]
    if not speeds:
        return None

    def acceleration(v: Float[Array, ""]) -> Float[Array, ""]:
        return system.forces(carry.t, carry.u, v, carry.own, carry.in_contact, carry.approach_speed).acceleration

    found, slope = jax.jvp(acceleration, (carry.v,), (jnp.ones_like(carry.v),))
    switch = functools.reduce(jnp.minimum, [jnp.asarray(each) for each in speeds])
    speed, slowing, switch = lax.stop_gradient((jnp.abs(carry.v), found, switch))
    step = _TO_REVERSAL * (switch + speed) / jnp.maximum(jnp.abs(slowing), 1e-300)
    concerned = (slowing * carry.v < 0) | (speed < _SWITCHED * switch)
    return _Friction(jnp.where(concerned, lax.stop_gradient(step), jnp.inf), lax.stop_gradient(-slope), found)


def _end(carry: LandingState) -> LandingState:
    """What is kept of the end of a step: all but the next landing, which is None."""
    return carry._replace(landing=None, h_landing=None)


def flight_step(
    effects: Iterable[AbstractEffect], frequency_hz: Number, *, a_period: float, an_own_period: float = STEPS_OF_A_VIBRATION
) -> Number:
    """Longest step in flight that resolves the motion, s; infinite where nothing vibrates.

    Arguments:
        effects: of the rig.
        frequency_hz: fastest vibration of the suspension or the excitation.
        a_period: steps in a period of that.
        an_own_period: steps in a period of the fastest vibration of an effect, at least.
    """
    per_second = a_period * jnp.asarray(frequency_hz)
    for effect in effects:
        per_second = jnp.maximum(per_second, an_own_period * jnp.asarray(effect.fastest_hz))
    return 1.0 / per_second


def landing_for(effects: Iterable[AbstractEffect], frequency_hz: float, *, flight_steps: int = 200) -> Landing:
    """Steps of a part of an excitation cycle, or of the fastest vibration of an effect where that asks for shorter ones."""
    return Landing(flight_step=float(flight_step(effects, frequency_hz, a_period=float(flight_steps))))
