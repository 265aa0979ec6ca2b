"""What sensors would read: from a trajectory to the channels of a record."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from vibrojax.channel_units import CHANNELS as CHANNELS
from vibrojax.channel_units import EVERY_CHANNEL as EVERY_CHANNEL
from vibrojax.channel_units import UNITS as UNITS
from vibrojax.effects.filters import RecorderFilter
from vibrojax.integrate import Trajectory
from vibrojax.system import System

_PART_OF_A_STEP = 1e-2
"""Of a sampling step, to either side, over which the rate of a reading is taken."""


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
    motion from there on, the channel follows. Known filters of the recorder come last; they need the rates of the readings, which are
    central differences along the motion over a small part of a sampling step.
    """
    readings, kept = _read(system, trajectory)
    known = [(place, effect) for place, effect in enumerate(system.effects) if isinstance(effect, RecorderFilter)]
    if known:
        step = _PART_OF_A_STEP * (trajectory.ts[1] - trajectory.ts[0])
        after, before = (_read(system, _moved(system, trajectory, part))[0] for part in (step, -step))
        rates = {name: (after[name] - before[name]) / (2.0 * step) for name in readings}
        for place, effect in known:
            readings, rates, kept[place] = effect.passed(readings, rates, trajectory.ts, kept[place])
    return readings, jnp.concatenate(kept, axis=-1) if kept else trajectory.own


def _moved(system: System, one: Trajectory, step: Float[Array, ""]) -> Trajectory:
    """The motion a little later, by its acceleration."""
    forces = system.forces(one.ts, one.u, one.v, one.own, one.in_contact, one.approach_speed)
    u, v = one.u + step * (one.v + 0.5 * step * forces.acceleration), one.v + step * forces.acceleration
    own = one.own + step * forces.own_rates if one.own.shape[-1] else one.own
    return Trajectory(one.ts + step, u, v, one.in_contact, one.approach_speed, one.result, one.steps, own)


def _read(system: System, trajectory: Trajectory) -> tuple[dict[str, Float[Array, " time"]], list[Float[Array, "time own"]]]:
    """Channels in front of known filters, and the own states of each effect."""
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
    return readings, kept
