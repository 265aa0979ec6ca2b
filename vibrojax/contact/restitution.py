"""The restitution that a contact law gives a free mass."""

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from vibrojax.contact.base import AbstractCompliantLaw, AbstractContactLaw, AbstractInstantaneousLaw
from vibrojax.shapes import Value
from vibrojax.steps import runge_kutta_step

_STEPS, _MOST = 200, 40_000
"""Of the integration, in a law's rough contact time and at most."""
_RESOLVED = 2e-3
"""Error that the steps may leave."""


@eqx.filter_jit
def restitution(law: AbstractContactLaw, mass: Value, approach_speed: Float[Array, " speeds"]) -> Float[Array, " speeds"]:
    """Speed at which a free mass leaves the stop over that at which it came; m delta'' = -F(delta, delta') from touch to delta = 0.

    Classical Runge-Kutta with fixed steps, which resolves e to 5e-5, or to 2e-3 where a far harder stop is behind a soft one.

    Args:
        law: of the contact.
        mass: kg.
        approach_speed: m/s, above zero.

    Returns:
        e by speed, 0 to 1; NaN where the mass has not come back after 200 contact times, as without contact, and where a damping that is
        far above critical makes the steps unstable. Such a damping's e, next to nothing, comes out too large.

    Example:
        >>> from vibrojax.contact import Newton
        >>> restitution(Newton(restitution=0.8), 1.0, jnp.asarray([0.5])).tolist()
        [0.8]
    """
    if isinstance(law, AbstractInstantaneousLaw):
        return law.rebound_speed(approach_speed) / approach_speed
    assert isinstance(law, AbstractCompliantLaw)
    step = law.contact_time(jnp.asarray(mass), approach_speed) / _STEPS

    def rates(_, state):
        indentation, rate = state
        return rate, -law.force(jnp.maximum(indentation, 0.0), rate, approach_speed) / mass

    def onward(state):
        count, indentation, rate, leaving = state
        (deeper, faster), _ = runge_kutta_step(rates, 0.0, (indentation, rate), step)
        leaves = jnp.isnan(leaving) & (deeper <= 0.0)
        part = indentation / jnp.where(leaves, indentation - deeper, 1.0)
        return count + 1, deeper, faster, jnp.where(leaves, rate + part * (faster - rate), leaving)

    def unfinished(state):
        count, _, _, leaving = state
        return (count < _MOST) & jnp.any(jnp.isnan(leaving) & jnp.isfinite(step))

    start = (0, jnp.zeros_like(approach_speed), approach_speed, jnp.full_like(approach_speed, jnp.nan))
    *_, leaving = lax.while_loop(unfinished, onward, start)
    found = -leaving / approach_speed
    return jnp.where((found >= 0.0) & (found <= 1.0 + _RESOLVED), jnp.minimum(found, 1.0), jnp.nan)
