"""The reference path: any integrator of `vibrojax.integrate`, cycle by cycle, its samples reduced."""

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array

from vibrojax.batch.base import AbstractEngine, Count, Cycles, Lanes, LaneState, numbered
from vibrojax.contact import AbstractInstantaneousLaw
from vibrojax.integrate.base import AbstractIntegrator
from vibrojax.integrate.smoothed import Smoothed
from vibrojax.system import System


class Sampled(AbstractEngine):
    """One lane at a time as far as accuracy goes, all of them side by side under `vmap`: slow, general, and made of parts tested elsewhere.

    With `Smoothed` (the default) this is Diffrax, with `Switch` the switch model of order eight. Section points are as good as the
    integrator. Impacts, peaks and speeds are read off `samples` equally spaced instants of each cycle: a touch is seen when a sample is
    past the stop, the peak of an impact of duration tau is low by up to (pi / samples * T / tau)^2 / 2 of itself, the approach speed is
    that at the last sample before.

    Arguments:
        integrator: of `vibrojax.integrate`.
        samples: in one cycle.
    """

    name: ClassVar[str] = "sampled"

    integrator: AbstractIntegrator = Smoothed(smoothing=1e-8, rtol=1e-10, atol=1e-13)
    samples: int = eqx.field(static=True, default=1000)

    def unfit(self, lanes: Lanes) -> str | None:
        if lanes.systems.effects:
            return f"effects ({', '.join(effect.name for effect in lanes.systems.effects)})"
        if isinstance(lanes.systems.law, AbstractInstantaneousLaw):
            return "a rigid stop, whose touches lie between samples"
        return None

    def advance(self, lanes: Lanes, state: LaneState, cycles: Count, recorded: int) -> tuple[LaneState, Cycles]:

        def one_lane(system: System, frequency_hz: Array, cycle: Array, numbers: Array, u: Array, v: Array):
            def one_cycle(carry, number):
                t = (cycle + number + jnp.linspace(0.0, 1.0, self.samples + 1)) / frequency_hz
                path = self.integrator(system, t, jnp.stack(carry))
                push = system.forces(t, path.u, path.v, path.own, path.in_contact, path.approach_speed).push
                inside = system.indentation(path.u) > 0
                touch = inside[1:] & ~inside[:-1]
                speed = jnp.max(jnp.where(touch, path.v[:-1], 0.0))
                after = tuple(jnp.where(number < 0, before, ys[-1]) for before, ys in zip(carry, (path.u, path.v), strict=True))
                return after, (*after, jnp.sum(touch), jnp.max(push), speed, jnp.max(path.u), path.result)

            _, found = lax.scan(one_cycle, (u, v), numbers)
            return found

        cycle = state.cycle.astype(state.u.dtype)
        numbers = numbered(cycles, recorded, cycle.shape[0]).astype(cycle.dtype)
        found = jax.vmap(one_lane, in_axes=(0, 0, 0, 1, 0, 0), out_axes=-1)(
            lanes.systems, lanes.frequency_hz, cycle, numbers, state.u, state.v
        )
        u, v, impacts, peak, speed, u_max, result = found
        worst, most = jnp.max(result, axis=0), jnp.max(u_max[-recorded:], axis=0)
        kept = [part[-recorded:] for part in (u, v, impacts, peak, speed)]
        what = Cycles(kept[0], kept[1], kept[2], kept[3], kept[4], most, worst)
        touching = lanes.systems.indentation(u[-1]) > 0
        return state._replace(u=u[-1], v=v[-1], in_contact=touching, cycle=state.cycle + cycles), what
