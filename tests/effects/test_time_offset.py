import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import sine, system
from tests.effects.scales import SCALES, is_recorded
from tests.effects.sensor import record, shown, unheard
from vibrojax.effects import TimeOffset


@pytest.mark.parametrize("delay", [2.2e-4, -2.2e-4, 3.83e-3, -3.83e-3])
def test_a_sine_comes_late_also_beyond_the_ends(delay):
    reading, _, ts = shown(TimeOffset(delay, "cart_displacement"))
    np.testing.assert_allclose(reading, sine(ts - delay)[0], atol=1e-7)
    inside = slice(10, -10)
    np.testing.assert_allclose(reading[inside], sine(ts - delay)[0][inside], atol=1e-11)
    assert unheard(TimeOffset(delay, "cart_displacement"))


def test_a_whole_number_of_samples_shifts_the_samples():
    dt = 5e-4
    reading, force, _ = shown(TimeOffset(3 * dt, "impact_force"))
    np.testing.assert_allclose(reading[3:], force[:-3], atol=1e-9 * force.max())


def test_slope_in_the_delay_is_minus_the_velocity():
    ideal, trajectory = record()
    effect = TimeOffset(1.3e-4, "cart_displacement")
    motion = _motion(trajectory)

    def read(delay):
        return dataclasses.replace(effect, delay=delay).read(ideal, motion, jnp.zeros((len(trajectory.ts), 0)))["cart_displacement"]

    _, slope = jax.jvp(read, (jnp.asarray(1.3e-4),), (jnp.asarray(1.0),))
    np.testing.assert_allclose(slope[5:-5], -sine(np.asarray(trajectory.ts) - 1.3e-4)[1][5:-5], atol=1e-6)


def test_needs_no_even_sampling():
    ts = jnp.asarray(np.cumsum(np.tile([1e-3, 2e-3, 1.5e-3], 20)))
    zero = jnp.zeros_like(ts)
    ideal, trajectory = record()
    motion = dataclasses.replace(_motion(trajectory), t=ts, u=zero, v=zero, indentation=zero, indentation_rate=zero, in_contact=zero > 0)
    reading = TimeOffset(7e-4, "cart_displacement").read({"cart_displacement": ts**3}, motion, jnp.zeros((len(ts), 0)))
    np.testing.assert_allclose(reading["cart_displacement"], (ts - 7e-4) ** 3, rtol=1e-9)


def test_begins_where_the_records_show_a_delay():
    scales = dataclasses.replace(SCALES, lags={"impact_force": -3e-3, "hammer_acceleration": 3e-3})  # the latter is not fitted
    found = [one for (one,) in TimeOffset.probe.candidates(scales)]
    assert [(one.of_channel, one.delay) for one in found if is_recorded(one, scales)] == [("impact_force", -3e-3)]
    assert [one.of_channel for one in found if not is_recorded(one, scales)] == list(SCALES.channels)


def _motion(trajectory):
    return system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)
