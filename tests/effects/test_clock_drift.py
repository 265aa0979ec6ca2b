import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from benchmarks.simulator.faults import ClockRate
from tests.effects.rig import sine, system
from tests.effects.scales import SCALES
from tests.effects.sensor import record, shown, unheard
from vibrojax.effects import ClockDrift


@pytest.mark.parametrize("ppm", [900.0, -900.0, 20_000.0])
def test_a_sine_is_stretched(ppm):
    effect = ClockDrift(ppm, "cart_displacement")
    reading, value, ts = shown(effect)
    np.testing.assert_allclose(reading[:-20], sine(ts * (1 - 1e-6 * ppm))[0][:-20], atol=1e-10)
    assert reading[0] == value[0]
    assert unheard(effect)


def test_agrees_with_the_independent_simulator():
    reading, value, ts = shown(ClockDrift(3000.0, "hammer_displacement"))
    expected = ClockRate(channel="hammer_displacement", ppm=3000.0).distort("", ts, value)
    np.testing.assert_allclose(reading[:-3], expected[:-3], atol=2e-3 * np.abs(expected - value).max())
    np.testing.assert_allclose(expected, CubicSpline(ts, value)(ts * (1 - 3e-3)), atol=1e-15)


def test_lateness_is_what_it_reads_by_and_grows_with_time():
    effect = ClockDrift(-500.0, "cart_displacement")
    np.testing.assert_allclose(effect.lateness(jnp.asarray([0.0, 2.0, 10.0])), [0.0, -1e-3, -5e-3])


def test_slope_in_the_drift_is_minus_time_times_the_velocity():
    ideal, trajectory = record()
    motion = system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)

    def read(ppm):
        return ClockDrift(ppm, "cart_displacement").read(ideal, motion, jnp.zeros((len(trajectory.ts), 0)))["cart_displacement"]

    _, slope = jax.jvp(read, (jnp.asarray(130.0),), (jnp.asarray(1.0),))
    ts = np.asarray(trajectory.ts)
    np.testing.assert_allclose(slope[5:-5], -1e-6 * (ts * sine(ts * (1 - 130e-6))[1])[5:-5], atol=1e-12)


def test_candidates_are_half_a_sample_late_by_the_end_of_the_longest_record():
    found = [one for (one,) in ClockDrift.probe.candidates(SCALES)]
    assert [one.of_channel for one in found] == list(SCALES.channels)
    assert all(float(one.lateness(jnp.asarray(3.0))) == pytest.approx(0.5 * SCALES.sampling) for one in found)
