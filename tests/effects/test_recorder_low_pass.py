import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lfilter

from tests.effects import rig
from tests.effects.scales import SCALES
from tests.effects.sensor import continued, record
from vibrojax.channels import EVERY_CHANNEL, channels
from vibrojax.effects import RecorderLowPass

FILTER = RecorderLowPass(1.5e-3)


def read(effect, names=EVERY_CHANNEL):
    ideal, trajectory = record()
    motion = rig.system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)
    given = {name: ideal[name] for name in names}
    return effect.read(given, motion, jnp.zeros((len(trajectory.ts), len(effect.own_states)))), given, np.asarray(trajectory.ts)


def test_every_channel_goes_through_the_same_filter_and_starts_settled():
    ideal, trajectory = record()
    own = jnp.zeros((len(trajectory.ts), len(FILTER.own_states)))
    readings = channels(rig.system(FILTER), dataclasses.replace(trajectory, own=own))
    assert set(readings) == set(ideal) == set(EVERY_CHANNEL)
    a = np.exp(-5e-4 / 1.5e-3)
    for name, value in ideal.items():
        expected = lfilter([1 - a], [1, -a], value, zi=[a * value[0]])[0]
        np.testing.assert_allclose(readings[name], expected, atol=1e-12 * np.abs(value).max(), rtol=0, err_msg=name)


def test_channels_that_are_not_recorded_stay_away():
    readings, given, _ = read(FILTER, ("cart_acceleration",))
    whole, _, _ = read(FILTER)
    assert set(readings) == {"cart_acceleration"}
    np.testing.assert_array_equal(readings["cart_acceleration"], whole["cart_acceleration"])
    assert read(FILTER, ())[0] == {}


def test_all_channels_come_equally_late():
    """A sine of the cart by atan(Omega tau), less half a sample."""
    readings, given, ts = read(FILTER)
    late = np.arctan(rig.OMEGA * 1.5e-3) / rig.OMEGA - 2.5e-4
    y = readings["cart_displacement"][60:]
    np.testing.assert_allclose(y, np.cos(rig.OMEGA * late) * rig.sine(ts[60:] - late)[0], atol=2e-3 * rig.A0)


@pytest.mark.parametrize("cut", [1, 90, 400])
def test_a_stretch_can_begin_anywhere(cut):
    in_one, in_two, moved = continued(FILTER, cut)
    assert moved > 1e-6
    np.testing.assert_allclose(in_two, in_one, atol=1e-12, rtol=0)


def test_a_time_constant_of_zero_is_an_ideal_recorder():
    readings, given, _ = read(RecorderLowPass(0.0))
    for name in EVERY_CHANNEL:
        np.testing.assert_array_equal(readings[name], given[name])


def test_candidates_are_cut_offs_between_the_suspension_and_half_the_sampling_rate():
    cut_offs = [1 / (2 * np.pi * one.time_constant) for (one,) in RecorderLowPass.probe.candidates(SCALES)]
    assert (cut_offs[0], cut_offs[-1]) == (pytest.approx(0.7 * SCALES.f_n), pytest.approx(0.4 / SCALES.sampling))
    assert max(np.diff(np.log(cut_offs))) <= np.log(2.0)
