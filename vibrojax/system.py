"""The rig as one system: hammer, suspension, stop, cart and applied force."""

import equinox as eqx
import jax.numpy as jnp

from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw, smoothed_force
from vibrojax.excitation import AbstractAppliedForce, AbstractBaseMotion
from vibrojax.shapes import Number, Scalars, Value
from vibrojax.suspension import AbstractSuspension


class System(eqx.Module):
    """Hammer of mass m on a suspension in a moving cart, in front of a stop at distance `gap`.

    u'' = suspension(u, u', drive) with drive = -y'' + (applied force - contact force) / m; u = x - y, delta = u - gap.
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

    def indentation(self, u: Scalars) -> Scalars:
        """Distance into the stop, delta = u - gap, m; positive in contact."""
        return u - self.gap

    def relative_acceleration(self, t: Scalars, u: Scalars, v: Scalars, contact_force: Scalars) -> Scalars:
        """u'', m/s^2, under a given push of the stop, N."""
        drive = (self.applied.force(t) - contact_force) / self.mass - self.base.acceleration(t)
        return self.suspension.acceleration(u, v, drive)

    def contact_force(self, u: Scalars, v: Scalars, approach_speed: Scalars) -> Scalars:
        """Force of the stop while in contact, N; indentation is cut at zero, a rigid stop gives none."""
        if not isinstance(self.law, AbstractCompliantLaw):
            return jnp.zeros_like(u)
        return self.law.force(jnp.maximum(self.indentation(u), 0.0), v, approach_speed)

    def smoothed_contact_force(self, u: Scalars, v: Scalars, approach_speed: Scalars, smoothing: Number) -> Scalars:
        """Force of the stop with the contact switch spread over `smoothing`, m, in and out of contact, N."""
        if not isinstance(self.law, AbstractCompliantLaw):
            raise TypeError(f"a rigid stop ({self.law.name}) has no force to smooth: integrate it with the landing or switch integrator")
        return smoothed_force(self.law, self.indentation(u), v, approach_speed, smoothing)
