"""A hammer that is led along a prescribed motion: nothing to integrate but the states of effects."""

import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from vibrojax.contact.base import SLOWEST_APPROACH
from vibrojax.excitation import SampledMotion
from vibrojax.integrate.base import NOT_FINITE, SUCCESS, AbstractIntegrator, Trajectory
from vibrojax.shapes import Value
from vibrojax.steps import runge_kutta_step
from vibrojax.system import System

_SUBSTEPS = 4
"""Runge-Kutta steps of the effects' own states between two samples."""


class Guided(AbstractIntegrator):
    """Follows u(t) as prescribed, as a testing machine imposes it, whatever the forces are.

    What the model then says is which force it takes: `reaction_force` among the channels. The hammer is in contact where u exceeds the
    gap. Only the states of effects are integrated, by classical Runge-Kutta steps along the motion. Differentiable but at a touch.

    Arguments:
        motion: u and u'' along the record.
        approach_speed: m/s.

    Example:
        >>> from vibrojax.contact import NoContact
        >>> from vibrojax.excitation import CubicSignal, Unforced, at_rest
        >>> from vibrojax.suspension import Linear
        >>> ramp = CubicSignal(knots=jnp.asarray([0.0, 1.0]), coefficients=jnp.asarray([[0.0], [0.0], [2.0], [1.0]]))
        >>> still = CubicSignal(knots=ramp.knots, coefficients=jnp.zeros((4, 1)))
        >>> system = System(1.0, Linear(0.0, 1.0), NoContact(), 9.0, at_rest(), Unforced())
        >>> motion = Guided(SampledMotion(position=ramp, second_derivative=still))(system, jnp.asarray([0.0, 0.5]), jnp.zeros(2))
        >>> motion.u.tolist(), motion.v.tolist()
        ([1.0, 2.0], [2.0, 2.0])
    """

    motion: SampledMotion
    approach_speed: Value = SLOWEST_APPROACH
    """m/s; at the last touch before the first sample, which counts where the hammer is in contact there."""

    def __call__(self, system: System, ts: Float[Array, " time"], state: Float[Array, " states"]) -> Trajectory:
        """Trajectory along the prescribed motion; of `state` only what lies behind u and u' is used. See `AbstractIntegrator`."""
        system, motion = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=ts.dtype), (system, self.motion))
        own = jnp.concatenate([state[2:], jnp.zeros(system.own_size - (state.shape[0] - 2), state.dtype)])
        u, v = motion.displacement(ts), motion.velocity(ts)
        touching = system.approach(ts[0], u[0], v[0], own).indentation > 0.0
        begin = (own, touching, jnp.asarray(self.approach_speed, ts.dtype))

        def interval(carry, ends):
            t, dt = ends
            own, touching, speed = carry

            def rates(t, own):
                return system.forces(t, motion.displacement(t), motion.velocity(t), own, touching, speed).own_rates

            for step in range(_SUBSTEPS):
                own, _ = runge_kutta_step(rates, t + step * dt / _SUBSTEPS, own, dt / _SUBSTEPS)
            near = system.approach(t + dt, motion.displacement(t + dt), motion.velocity(t + dt), own)
            now = near.indentation > 0.0
            speed = jnp.where(now & ~touching, jnp.maximum(near.rate, SLOWEST_APPROACH), speed)
            return (own, now, speed), (own, now, speed)

        _, later = lax.scan(interval, begin, (ts[:-1], jnp.diff(ts)))
        own, in_contact, approach_speed = jax.tree.map(lambda first, rest: jnp.concatenate([first[None], rest]), begin, later)
        finite = jnp.isfinite(u).all() & jnp.isfinite(v).all() & jnp.isfinite(own).all()
        result = jnp.where(finite, SUCCESS, NOT_FINITE)
        return Trajectory(ts, u, v, in_contact, approach_speed, result, jnp.asarray(ts.shape[0] - 1), own)
