"""The rig as one system: hammer, suspension, stop, cart, applied force, and effects beyond them."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw
from vibrojax.effects.base import AbstractEffect, Motion
from vibrojax.excitation import AbstractAppliedForce, AbstractBaseMotion
from vibrojax.shapes import Scalars, Value
from vibrojax.suspension import AbstractSuspension

Own = Float[Array, "... own"]


class Approach(NamedTuple):
    """Where the hammer is against its stops: the one in front, and the one nearest to it."""

    side: Scalars | float
    """Of the nearest: 1 for the stop in front, -1 for one behind."""
    indentation: Scalars
    """Into the nearest, m; positive in contact."""
    rate: Scalars
    """m/s"""
    front: tuple[Scalars, Scalars]
    """Indentation and its rate at the stop in front."""


class Forces(NamedTuple):
    """What acts at one instant, or at many."""

    acceleration: Scalars
    """u'', m/s^2."""
    absolute: Scalars
    """x'', m/s^2."""
    push: Scalars
    """Push of the stop in front on the hammer, N."""
    own_rates: Own
    """Rates of the effects' own states."""


class System(eqx.Module):
    """Hammer of mass m on a suspension in a moving cart, in front of a stop at distance `gap`.

    u'' = suspension(u, u', drive) with drive = -y'' + (applied force + load + effects - contact force) / m; u = x - y, delta = u - gap.
    Physics only: which solver integrates it, and with which smoothing, is the integrator's business.
    """

    mass: Value
    """kg"""
    suspension: AbstractSuspension
    law: AbstractContactLaw
    gap: Value
    """m"""
    base: AbstractBaseMotion
    applied: AbstractAppliedForce
    effects: tuple[AbstractEffect, ...] = ()
    load: Value = 0.0
    """Known constant force on the hammer, N, positive towards the stop (`vibrojax.load`)."""

    @property
    def own_size(self) -> int:
        """Count of states that the effects add to u and u'."""
        return sum(len(effect.own_states) for effect in self.effects)

    def each(self, own: Own) -> list[tuple[AbstractEffect, Float[Array, "..."]]]:
        """Every effect with its own part of the states."""
        parts, begin = [], 0
        for effect in self.effects:
            parts.append((effect, own[..., begin : begin + len(effect.own_states)]))
            begin += len(effect.own_states)
        return parts

    def indentation(self, u: Scalars) -> Scalars:
        """Distance into a stop at rest, delta = u - gap, m; positive in contact."""
        return u - self.gap

    def approach(self, t: Scalars, u: Scalars, v: Scalars, own: Own) -> Approach:
        """Indentation and its rate at the nearest stop, wherever that stands by now."""
        position, velocity = self.indentation(u), v
        for effect, part in self.each(own):
            position, velocity = position - effect.stop_position(t, part), velocity - effect.stop_velocity(t, part)
        back_gap = next((effect.back_gap for effect in self.effects if effect.back_gap is not None), None)
        if back_gap is None:
            return Approach(1.0, position, velocity, (position, velocity))
        behind = -u - back_gap
        in_front = position >= behind
        nearest = jnp.where(in_front, position, behind), jnp.where(in_front, velocity, -v)
        return Approach(jnp.where(in_front, 1.0, -1.0), *nearest, (position, velocity))

    def motion(self, t: Scalars, u: Scalars, v: Scalars, own: Own, in_contact: Bool[Array, "..."]) -> Motion:
        """The motion as effects see it."""
        return _motion(t, u, v, self.approach(t, u, v, own), in_contact)

    def forces(self, t: Scalars, u: Scalars, v: Scalars, own: Own, in_contact: Bool[Array, "..."], approach_speed: Scalars) -> Forces:
        """All that acts on the hammer and on the effects' own states."""
        near = self.approach(t, u, v, own)
        push = jnp.zeros_like(u)
        if isinstance(self.law, AbstractCompliantLaw):
            pushed = self.law.force(jnp.maximum(near.indentation, 0.0), near.rate, approach_speed)
            push = jnp.where(in_contact, pushed, jnp.zeros_like(pushed)) * near.side
        motion = _motion(t, u, v, near, in_contact)
        force, base_acceleration = self.applied.force(t) + self.load - push, self.base.acceleration(t)
        for effect, part in self.each(own):
            force = force + effect.force(motion, part)
            base_acceleration = base_acceleration + effect.base_acceleration(part, push)
        acceleration = self.suspension.acceleration(u, v, force / self.mass - base_acceleration)
        absolute = acceleration + base_acceleration
        rates = [effect.rates(motion, part, push, absolute) for effect, part in self.each(own) if effect.own_states]
        in_front = jnp.where(near.side > 0, push, jnp.zeros_like(push))
        return Forces(acceleration, absolute, in_front, jnp.concatenate(rates, axis=-1) if rates else own)


def _motion(t: Scalars, u: Scalars, v: Scalars, near: Approach, in_contact: Bool[Array, "..."]) -> Motion:
    position, rate = near.front
    return Motion(t=t, u=u, v=v, indentation=position, indentation_rate=rate, in_contact=in_contact)
