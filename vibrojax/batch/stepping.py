"""The general path: Runge-Kutta steps that land on every touch, for any suspension and any effect."""

from collections.abc import Iterable
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.batch.base import AbstractEngine, Count, Cycles, Lanes, LaneState, numbered
from vibrojax.effects.base import AbstractEffect
from vibrojax.integrate.base import NOT_FINITE, STEP_LIMIT, SUCCESS
from vibrojax.integrate.impacts import Push, peak_of_step, push_of
from vibrojax.integrate.landing import Landing, LandingState, flight_step
from vibrojax.steps import cubic_top
from vibrojax.system import System

_Lanes = Float[Array, " lanes"]


class _Cycle(NamedTuple):
    """What one cycle has brought so far."""

    impacts: Int[Array, " lanes"]
    peak: _Lanes
    speed: _Lanes
    u_max: _Lanes
    push: Push
    """At the end of the last step."""


class Stepping(AbstractEngine):
    """`vibrojax.integrate.Landing` from strobe to strobe, its samples replaced by what a cycle is reduced to.

    Any suspension, law, effect and base whose period is that of the excitation. All lanes wait at each strobe for the last. The error of a
    section point falls with the fourth power of the steps in flight and with order n + 1 in contact; the peak of a force is the
    top of the cubic through the force and its rate at the ends of steps (`vibrojax.integrate.impacts`).

    Arguments:
        contact_steps: steps in an impact of average duration.
        flight_steps: steps in a cycle of excitation, at least.
        most_steps: steps in one cycle; a lane that needs more ends with `STEP_LIMIT`.
    """

    name: ClassVar[str] = "stepping"

    contact_steps: float = eqx.field(static=True, default=60.0)
    flight_steps: float = eqx.field(static=True, default=200.0)
    most_steps: int = eqx.field(static=True, default=100_000)

    def unfit(self, lanes: Lanes) -> str | None:
        """It integrates every rig."""
        return None

    def advance(self, lanes: Lanes, state: LaneState, cycles: Count, recorded: int) -> tuple[LaneState, Cycles]:
        system = lanes.systems
        period = 1.0 / lanes.frequency_hz
        begin = state.cycle.astype(state.u.dtype) * period
        motion = self._landing((), period[0]).start(
            system, begin[:, None], jnp.concatenate([state.u[:, None], state.v[:, None], state.own], 1)
        )
        motion = motion._replace(in_contact=state.in_contact, approach_speed=jnp.maximum(state.approach_speed, motion.approach_speed * 0))

        def one_cycle(motion: LandingState, number: Int[Array, " lanes"]):
            target = (state.cycle + jnp.maximum(number + 1, 0)).astype(period.dtype) * period
            motion, cycle, late = self._to_strobe(system, period, target, motion)
            return motion, (motion.u, motion.v, cycle, late)

        numbers = numbered(cycles, recorded, period.shape[0])
        motion, (u, v, cycle, late) = lax.scan(one_cycle, motion, numbers)
        finite = jnp.isfinite(motion.u) & jnp.isfinite(motion.v)
        result = jnp.where(finite, jnp.where(jnp.any(late, axis=0), STEP_LIMIT, SUCCESS), NOT_FINITE)
        nothing = jnp.zeros_like(motion.u)
        after = LaneState(motion.u, motion.v, motion.in_contact, motion.approach_speed, nothing, state.cycle + cycles, motion.own)
        kept = [part[-recorded:] for part in (u, v, cycle.impacts, cycle.peak, cycle.speed)]
        return after, Cycles(kept[0], kept[1], kept[2], kept[3], kept[4], jnp.max(cycle.u_max[-recorded:], axis=0), result)

    def _landing(self, effects: Iterable[AbstractEffect], period: Float[Array, ""]) -> Landing:
        """The stepper of one lane."""
        return Landing(contact_steps=self.contact_steps, flight_step=flight_step(effects, 1.0 / period, a_period=self.flight_steps))

    def _to_strobe(self, systems: System, periods: _Lanes, targets: _Lanes, motion: LandingState):
        """All lanes to their next strobe: the motion there, what the cycle brought, and which lanes did not get there."""

        def step(system: System, period: Array, target: Array, before: LandingState, cycle: _Cycle):
            after = self._landing(system.effects, period).step(system, target, before)
            after = jax.tree.map(lambda new, old: jnp.where(before.t < target, new, old), after, before)
            return after, _noted(system, before, after, cycle)

        def unfinished(loop):
            motion, _, steps = loop
            return (steps < self.most_steps) & jnp.any(_open(motion, targets))

        def onward(loop):
            motion, cycle, steps = loop
            motion, cycle = jax.vmap(step)(systems, periods, targets, motion, cycle)
            return motion, cycle, steps + 1

        at_strobe = jax.vmap(push_of)(systems, motion)
        cycle = _Cycle(jnp.zeros(motion.u.shape, int), at_strobe.force, jnp.zeros_like(motion.u), motion.u, at_strobe)
        motion, cycle, _ = lax.while_loop(unfinished, onward, (motion, cycle, jnp.asarray(0)))
        return motion, cycle, _open(motion, targets)


def _open(motion: LandingState, targets: _Lanes) -> Bool[Array, " lanes"]:
    return (motion.t < targets) & jnp.isfinite(motion.u)


def _noted(system: System, before: LandingState, after: LandingState, cycle: _Cycle) -> _Cycle:
    """The cycle after one trial step of one lane."""
    touches = before.landing & ~after.landing & ~before.in_contact
    push, h = push_of(system, after), after.t - before.t
    arriving = after.v if after.v_arriving is None else after.v_arriving
    return _Cycle(
        impacts=cycle.impacts + touches.astype(int),
        peak=jnp.maximum(cycle.peak, peak_of_step(cycle.push, push, h)),
        speed=jnp.where(touches, jnp.maximum(cycle.speed, after.approach_speed), cycle.speed),
        u_max=jnp.maximum(cycle.u_max, cubic_top(before.u, h * before.v, after.u, h * arriving)),
        push=push,
    )
