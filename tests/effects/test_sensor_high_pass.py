import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.simulator.faults import HighPass
from tests.effects.scales import SCALES
from tests.effects.sensor import continued, shown, unheard
from vibrojax.effects import SensorHighPass

DISCHARGE = SensorHighPass(0.05, "impact_force")


@pytest.mark.parametrize("channel", ["impact_force", "hammer_acceleration"])
def test_is_the_recursive_high_pass_of_first_order(channel):
    reading, value, ts = shown(SensorHighPass(0.05, channel))
    a = np.exp(-(ts[1] - ts[0]) / 0.05)
    expected = lfilter([a, -a], [1, -a], value, zi=[(1 - a) * value[0]])[0]
    np.testing.assert_allclose(reading, expected, atol=1e-12 * np.abs(value).max())
    assert unheard(SensorHighPass(0.05, channel))


def test_agrees_with_the_independent_simulator():
    """Which begins before the record: the memory at the first sample says so."""
    reading, force, ts = shown(DISCHARGE)
    np.testing.assert_allclose(
        reading, HighPass(channel="impact_force", time_constant=0.05).distort("", ts, force), atol=1e-12 * force.max()
    )
    assert force[0] == 0.0


def test_reads_below_zero_after_an_impact_by_the_impulse_over_the_time_constant():
    reading, force, ts = shown(SensorHighPass(10.0, "impact_force"))
    after = np.flatnonzero(np.diff((force > 0).astype(int)) == -1)[0] + 1
    np.testing.assert_allclose(reading[after], -np.trapezoid(force[: after + 1], ts[: after + 1]) / 10.0, rtol=1e-2)
    assert reading[after] < 0 == force[after]


def test_memory_obeys_its_recursion():
    reading, force, ts = shown(DISCHARGE)
    d, a = reading - force, np.exp(-np.diff(ts) / 0.05)
    np.testing.assert_allclose(d[1:], a * d[:-1] + (a - 1) * force[1:], atol=1e-12 * force.max())


@pytest.mark.parametrize("cut", [1, 90, 400])
def test_a_stretch_can_begin_anywhere(cut):
    in_one, in_two, moved = continued(DISCHARGE, cut)
    assert moved > 1e-6
    np.testing.assert_allclose(in_two, in_one, atol=1e-12, rtol=0)


def test_off_it_never_discharges_and_twice_as_strong_it_does_so_in_half_the_time():
    reading, force, _ = shown(DISCHARGE.scaled(0.0))
    np.testing.assert_allclose(reading, force, atol=1e-12 * force.max())
    assert float(DISCHARGE.scaled(2.0).time_constant) == pytest.approx(0.025)
    assert jnp.isfinite(DISCHARGE.scaled(jnp.asarray(0.0)).time_constant)


def test_candidates_are_force_cells_and_accelerometers_from_contacts_to_records():
    scales = dataclasses.replace(SCALES, channels=("hammer_displacement", "impact_force", "hammer_acceleration"))
    found = [one for (one,) in SensorHighPass.probe.candidates(scales)]
    assert {one.of_channel for one in found} == {"impact_force", "hammer_acceleration"}
    constants = [one.time_constant for one in found if one.of_channel == "impact_force"]
    assert (constants[0], constants[-1]) == (pytest.approx(3 * scales.contact_time), pytest.approx(9.0))
    assert max(np.diff(np.log(constants))) <= np.log(3.0)
