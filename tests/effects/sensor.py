"""One simulated record, and what a recorder with a fault makes of it."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np

from tests.effects import rig
from vibrojax.channels import channels
from vibrojax.integrate import Landing


@functools.cache
def record():
    """Ideal channels of the rig and the trajectory that they come from."""
    return rig.simulate(integrator=Landing(contact_steps=100.0, flight_step=5e-4))


def shown(effect):
    """Channels of the same motion with the fault, and the ideal ones; that no other channel differs is checked."""
    ideal, trajectory = record()
    own = jnp.zeros((len(trajectory.ts), len(effect.own_states)))
    readings = channels(rig.system(effect), dataclasses.replace(trajectory, own=own))
    assert set(readings) == set(ideal)
    for name in set(ideal) - {effect.channel}:
        np.testing.assert_array_equal(readings[name], ideal[name])
    return np.asarray(readings[effect.channel]), np.asarray(ideal[effect.channel]), np.asarray(trajectory.ts)


def unheard(effect):
    """Whether readings without the faulty channel pass unchanged."""
    ideal, trajectory = record()
    others = {name: value for name, value in ideal.items() if name != effect.channel}
    motion = rig.system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)
    return effect.read(others, motion, jnp.zeros((len(trajectory.ts), 0))) == others


def continued(effect, cut):
    """Readings of a record from a sample on: of the whole record, and of a stretch that begins there with the memory of the filter.

    Each over the largest one of its channel, (channels, time); with them comes how far the memory has moved from the one that the record
    was begun with.
    """
    ideal, trajectory = record()
    motion = rig.system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)

    def read(part, start):
        given = {name: values[part] for name, values in ideal.items()}
        there = jax.tree.map(lambda values: values[part], motion)
        own = jnp.broadcast_to(start, (len(there.t), len(start)))
        return given, effect.read(given, there, own), own

    start = 0.01 * jnp.arange(1.0, 1.0 + len(effect.own_states))
    given, whole, own = read(slice(None), start)
    memory = effect.memory(given, whole, own)
    np.testing.assert_allclose(memory[0], start, rtol=1e-9)
    _, second, _ = read(slice(cut, None), memory[cut])
    count = len(motion.t) - cut
    sizes = {name: np.abs(values).max() for name, values in whole.items() if np.abs(values).max() > 0}
    in_one, in_two = (np.stack([values[name][-count:] / size for name, size in sizes.items()]) for values in (whole, second))
    return in_one, in_two, np.abs(memory[cut] - start).max()
