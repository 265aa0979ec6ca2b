import dataclasses

import numpy as np
from scipy.signal import lfilter

from tests.effects.scales import SCALES, is_recorded
from tests.effects.sensor import continued, shown, unheard
from vibrojax.effects import ForceLag


def test_is_the_recursive_filter_of_first_order():
    reading, force, ts = shown(ForceLag(1.5e-3))
    a = np.exp(-(ts[1] - ts[0]) / 1.5e-3)
    np.testing.assert_allclose(reading, lfilter([1 - a], [1, -a], force), atol=1e-12 * force.max())
    assert unheard(ForceLag(1.5e-3))


def test_keeps_the_impulse_and_comes_late_by_the_time_constant_less_half_a_sample():
    reading, force, ts = shown(ForceLag(1.5e-3))
    one = slice(0, int(np.flatnonzero(force)[0]) + 100)
    reading, force, ts = reading[one], force[one], ts[one]
    dt = ts[1] - ts[0]
    np.testing.assert_allclose(reading.sum(), force.sum(), rtol=1e-6)
    late = (reading @ ts) / reading.sum() - (force @ ts) / force.sum()
    np.testing.assert_allclose(late, dt / np.expm1(dt / 1.5e-3), rtol=1e-4)
    np.testing.assert_allclose(late, 1.5e-3 - dt / 2, rtol=0.02)


def test_a_lag_of_zero_is_the_ideal_channel():
    reading, force, _ = shown(ForceLag(0.0))
    np.testing.assert_array_equal(reading, force)


def test_a_stretch_can_begin_anywhere():
    in_one, in_two, moved = continued(ForceLag(8e-3), 341)
    assert moved > 1e-6
    np.testing.assert_allclose(in_two, in_one, atol=1e-12, rtol=0)


def test_begins_where_the_records_show_a_delay_but_never_comes_early():
    late, early = (dataclasses.replace(SCALES, lags={"impact_force": delay}) for delay in (1.7e-3, -1.7e-3))
    assert [one.lag for (one,) in ForceLag.probe.candidates(late) if is_recorded(one, late)] == [1.7e-3]
    assert not any(is_recorded(one, early) or one.lag < 0 for (one,) in ForceLag.probe.candidates(early))
