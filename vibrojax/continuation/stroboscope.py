"""The stroboscopic map: the state of the rig some cycles of the cart later."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.contact import AbstractCompliantLaw
from vibrojax.continuation.rig import ForcedRig
from vibrojax.integrate.base import NOT_FINITE, STEP_LIMIT, SUCCESS
from vibrojax.integrate.landing import Landing, LandingState
from vibrojax.system import System

_Scalar = Float[Array, ""]
_Number = Float[Array | np.ndarray, ""]
_SPARE = 3.0
_TOUCH_STEPS = 2000


class Passage(NamedTuple):
    """What an orbit met on its way; without derivatives."""

    touches: Int[Array | np.ndarray, ""]
    slowest_touch: _Number
    """Least approach speed, m/s; infinite without a touch."""
    fastest_touch: _Number
    """Largest approach speed, m/s; zero without a touch."""
    closest: _Number
    """Largest indentation at a turning point in flight, m: minus the clearance of the closest miss; -infinite where none turns."""
    highest: _Number
    """Largest u at the end of a step, m."""
    lowest: _Number
    """Least u at the end of a step, m."""
    peak_force: _Number
    """Largest push of the stop at the end of a step, N; zero for a rigid stop."""
    starts_in_contact: Bool[Array | np.ndarray, ""]
    result: Int[Array | np.ndarray, ""]
    """A code of `vibrojax.integrate`."""


def strobe(
    landing: Landing, rig: ForcedRig, cycles: Int[Array, ""], state: Float[Array, " states"]
) -> tuple[Float[Array, " states"], Passage]:
    """State after so many cycles of the cart, and what happened on the way.

    P: (u, u', ...) at t = 0 -> the same at t = cycles / f, with y = A0 sin(2 pi f t). A periodic orbit of p cycles is a fixed point of P^p.

    Differentiable (forward mode) in the state and in every number of the rig, the time of each touch included; not at a grazing touch,
    and with a jump of the derivative where an orbit begins to graze. The values are those of the discretised motion, whose error falls
    with the steps of `landing`; its derivative agrees with the derivative of the values to that error.

    Arguments:
        landing: the integrator, whose steps are taken.
        rig: with arrays as numbers (`as_arrays`).
        cycles: p > 0.
        state: (u, u') in m and m/s, and the states of the effects.

    Source: the loop is that of `Landing`, without its history.
    """
    system, t_end = rig.system(), rig.period(cycles)
    system = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=state.dtype), system)
    lane = jax.tree.map(lambda leaf: leaf[None], system)
    start: LandingState = jax.tree.map(lambda leaf: leaf[0], landing.start(lane, jnp.zeros((1, 1)), state[None]))
    limit = _most_steps(landing, lax.stop_gradient(t_end), cycles)

    def unfinished(loop):
        count, carry, _ = loop
        return (count < limit) & (carry.t < t_end) & jnp.isfinite(carry.u)

    def advance(loop):
        count, carry, passage = loop
        after = landing.step(system, t_end, carry)
        return count + 1.0, after, _seen(system, carry, after, passage)

    nothing = Passage(
        touches=jnp.asarray(0),
        slowest_touch=jnp.asarray(jnp.inf),
        fastest_touch=jnp.asarray(0.0),
        closest=jnp.asarray(-jnp.inf),
        highest=lax.stop_gradient(state[0]),
        lowest=lax.stop_gradient(state[0]),
        peak_force=jnp.asarray(0.0),
        starts_in_contact=start.in_contact,
        result=jnp.asarray(SUCCESS),
    )
    _, last, passage = lax.while_loop(unfinished, advance, (jnp.asarray(0.0), start, nothing))
    finite = jnp.isfinite(last.u) & jnp.isfinite(last.v)
    result = jnp.where(finite, jnp.where(last.t >= t_end, SUCCESS, STEP_LIMIT), NOT_FINITE)
    return jnp.concatenate([jnp.stack([last.u, last.v]), last.own]), passage._replace(result=result)


@eqx.filter_jit
def strobe_from(landing: Landing, rig: ForcedRig, cycles: Int[Array, ""], state: Float[Array, " states"]):
    """`strobe`, compiled."""
    return strobe(landing, rig, cycles, state)


@eqx.filter_jit
def linearised(landing: Landing, rig: ForcedRig, name: str, cycles: Int[Array, ""], state: Float[Array, " states"]):
    """End state, its Jacobian with respect to (state, the number called `name`), shape (states, states + 1), and what was met.

    By forward-mode differentiation, all columns in one run.
    """

    def end(z):
        reached, passage = strobe(landing, rig.replace(name, z[-1]), cycles, z[:-1])
        return reached, (reached, passage)

    z = jnp.concatenate([state, jnp.asarray(rig.value(name), dtype=state.dtype)[None]])
    jacobian, (reached, passage) = jax.jacfwd(end, has_aux=True)(z)
    return reached, jacobian, passage


def _most_steps(landing: Landing, t_end: _Scalar, cycles: Int[Array, ""]) -> _Scalar:
    """After how many steps the loop gives up."""
    if landing.most_steps is not None:
        return jnp.asarray(float(landing.most_steps))
    return _SPARE * t_end / landing.flight_step + _TOUCH_STEPS * jnp.asarray(cycles, dtype=float)


def _seen(system: System, before: LandingState, after: LandingState, passage: Passage) -> Passage:
    """What one step adds to the passage."""
    before, after, system = lax.stop_gradient((before, after, system))
    taken = ~after.landing
    landed = before.landing & taken
    touch = landed & ~before.in_contact
    old = system.approach(before.t, before.u, before.v, before.own)
    new = system.approach(after.t, after.u, after.v, after.own)
    turns = taken & ~landed & ~before.in_contact & (old.rate > 0) & (new.rate <= 0)
    top = _top(old.indentation, old.rate, new.indentation, new.rate, after.t - before.t)
    speed = after.approach_speed
    push = passage.peak_force
    if isinstance(system.law, AbstractCompliantLaw):
        push = system.forces(after.t, after.u, after.v, after.own, after.in_contact, speed).push
    return passage._replace(
        touches=passage.touches + touch.astype(int),
        slowest_touch=jnp.where(touch, jnp.minimum(passage.slowest_touch, speed), passage.slowest_touch),
        fastest_touch=jnp.where(touch, jnp.maximum(passage.fastest_touch, speed), passage.fastest_touch),
        closest=jnp.where(turns, jnp.maximum(passage.closest, top), passage.closest),
        highest=jnp.maximum(passage.highest, after.u),
        lowest=jnp.minimum(passage.lowest, after.u),
        peak_force=jnp.maximum(passage.peak_force, push),
    )


def _top(p0: _Scalar, r0: _Scalar, p1: _Scalar, r1: _Scalar, h: _Scalar) -> _Scalar:
    """Greatest value of the cubic through both ends of a step, whose rate falls through zero within it."""
    m0, m1 = h * r0, h * r1
    falls = m0 - m1 > 0
    s = jnp.where(falls, m0 / jnp.where(falls, m0 - m1, 1.0), 0.0)
    c2, c3 = 3.0 * (p1 - p0) - 2.0 * m0 - m1, m0 + m1 - 2.0 * (p1 - p0)
    for _ in range(2):
        bend = 2.0 * c2 + 6.0 * s * c3
        slope = m0 + s * (2.0 * c2 + 3.0 * s * c3)
        s = jnp.clip(s - jnp.where(bend < 0, slope / jnp.where(bend < 0, bend, 1.0), 0.0), 0.0, 1.0)
    return p0 + s * (m0 + s * (c2 + s * c3))
