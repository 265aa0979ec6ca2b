"""One simulated record, and what a recorder with a fault makes of it."""

import dataclasses
import functools

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
