"""The closed form that the presets rest on, against the formula written anew for the tests of the continuation."""

import numpy as np
import pytest

from tests.continuation.single_impact_orbit import Oscillator
from vibrojax.presets.single_impact import SingleImpact


@pytest.mark.parametrize(("cycles", "gap", "ratio"), [(1, 0.0, 1.9), (1, 3.0, 1.4), (1, -0.5, 2.2), (2, 0.0, 3.8), (2, 3.0, 3.3)])
def test_speed_and_multipliers(cycles, gap, ratio):
    exact, monodromy, _ = Oscillator(zeta=0.03, f_n=1.0, e=0.7, gap=gap, amplitude=1.0).orbit(ratio, cycles, 1)
    motion = SingleImpact(damping_ratio=0.03, restitution=0.7, gap=gap, cycles=cycles)
    assert motion.speed(ratio) == pytest.approx(exact / (2 * np.pi), rel=1e-10)
    expected = np.sort_complex(np.linalg.eigvals(monodromy).astype(complex))
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(motion.monodromy(ratio)).astype(complex)), expected, rtol=1e-9)


def test_the_band_ends_at_the_fold():
    oscillator = Oscillator(zeta=0.03, f_n=1.0, e=0.7, gap=3.0, amplitude=1.0)
    end = SingleImpact(damping_ratio=0.03, restitution=0.7, gap=3.0, cycles=1).band_end()
    assert end == pytest.approx(oscillator.fold(1.2, 1.99, 1), abs=1e-3)


def test_where_the_stop_is_out_of_reach_there_is_no_motion():
    motion = SingleImpact(damping_ratio=0.03, restitution=0.3, gap=3.0, cycles=1)
    assert np.isnan(motion.speed(1.9))
    assert not motion.is_stable(1.9)
