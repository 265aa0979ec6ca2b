"""What sensors would read: from a trajectory to the channels of a record."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from vibrojax.channel_units import CHANNELS as CHANNELS
from vibrojax.channel_units import EVERY_CHANNEL as EVERY_CHANNEL
from vibrojax.channel_units import SUPPORT_CHANNELS as SUPPORT_CHANNELS
from vibrojax.channel_units import UNITS as UNITS
from vibrojax.integrate import Trajectory
from vibrojax.system import System


def channels(system: System, trajectory: Trajectory) -> dict[str, Float[Array, " time"]]:
    """What the recorder shows along one trajectory, SI.

    Displacements and accelerations of hammer and cart are absolute, `relative_displacement` is u = x - y, and `impact_force` is the
    push of the stop in front, positive in compression; `reaction_force` is all that holds the hammer back, applied force and
    load less inertia: what suspension and stop resist with. Ideal readings, but for the faults of sensors among the system's effects.
    """
    return recorded(system, trajectory)[0]


def recorded(system: System, trajectory: Trajectory) -> tuple[dict[str, Float[Array, " time"]], Float[Array, "time own"]]:
    """Channels, and beside them the effects' own states at every instant, those of a recorder's filters included.

    What a filter keeps from one sample to the next is what its channel shows less what goes in: from that state at an instant, and the
    motion from there on, the channel follows.
    """
    ts, u, v, own = trajectory.ts, trajectory.u, trajectory.v, trajectory.own
    forces = system.forces(ts, u, v, own, trajectory.in_contact, trajectory.approach_speed)
    y = system.base.displacement(ts)
    for effect, part in system.each(own):
        y = y + effect.base_displacement(part)
    readings = {
        "hammer_displacement": u + y,
        "cart_displacement": y,
        "hammer_acceleration": forces.absolute,
        "cart_acceleration": forces.absolute - forces.acceleration,
        "impact_force": forces.push,
        "applied_force": system.applied.force(ts),
        "relative_displacement": u,
        "reaction_force": system.applied.force(ts) + system.load - system.mass * forces.absolute,
    }
    motion = system.motion(ts, u, v, own, trajectory.in_contact)
    parts = system.each(own)
    kept = [part for _, part in parts]
    for index in sorted(range(len(parts)), key=lambda index: parts[index][0].is_fault):  # the recorder's faults come last
        effect, part = parts[index]
        before, readings = readings, effect.read(readings, motion, part)
        kept[index] = effect.memory(before, readings, part)
    return readings, jnp.concatenate(kept, axis=-1) if kept else own
