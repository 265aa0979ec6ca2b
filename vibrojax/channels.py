"""What sensors would read: from a trajectory to the channels of a record."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from vibrojax.integrate import Trajectory
from vibrojax.system import System

CHANNELS = (
    "hammer_displacement",
    "cart_displacement",
    "hammer_acceleration",
    "cart_acceleration",
    "impact_force",
    "applied_force",
    "relative_displacement",
)
"""Every channel that the model can predict, in the order of the tables."""

UNITS = {
    "hammer_displacement": "m",
    "cart_displacement": "m",
    "hammer_acceleration": "m/s^2",
    "cart_acceleration": "m/s^2",
    "impact_force": "N",
    "applied_force": "N",
    "relative_displacement": "m",
}


def channels(system: System, trajectory: Trajectory) -> dict[str, Float[Array, " time"]]:
    """Ideal readings along one trajectory, SI; sensor faults are no business of this function.

    Displacements and accelerations of hammer and cart are absolute, `relative_displacement` is u = x - y, and `impact_force` is the
    push of the stop, positive in compression.
    """
    ts, u, v = trajectory.ts, trajectory.u, trajectory.v
    pushed = system.contact_force(u, v, trajectory.approach_speed)
    force = jnp.where(trajectory.in_contact, pushed, jnp.zeros_like(pushed))
    y, y2 = system.base.displacement(ts), system.base.acceleration(ts)
    return {
        "hammer_displacement": u + y,
        "cart_displacement": y,
        "hammer_acceleration": system.relative_acceleration(ts, u, v, force) + y2,
        "cart_acceleration": y2,
        "impact_force": force,
        "applied_force": system.applied.force(ts),
        "relative_displacement": u,
    }
