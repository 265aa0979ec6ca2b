"""Hertz: nothing lost, depth and duration in closed form."""

import numpy as np
import pytest
from scipy.special import gamma

from tests.contact.single_impact import single_impact
from vibrojax.contact import Hertz

MASS, SPEED = 0.4, 0.3


@pytest.mark.parametrize("n", [0.8, 1.0, 1.5, 2.0, 4.0])
def test_depth_duration_force_and_energy(n):
    law = Hertz(impact_stiffness=2e7, impact_exponent=n)
    impact = single_impact(law, MASS, SPEED)
    deepest = ((n + 1) * MASS * SPEED**2 / (2 * 2e7)) ** (1 / (n + 1))
    duration = 2 * np.sqrt(np.pi) * gamma(1 + 1 / (n + 1)) / gamma(0.5 + 1 / (n + 1)) * deepest / SPEED
    assert impact.restitution == pytest.approx(1.0, abs=1e-9)
    assert impact.deepest == pytest.approx(deepest, rel=1e-9)
    assert impact.largest_force == pytest.approx(2e7 * deepest**n, rel=1e-9)
    assert impact.duration == pytest.approx(duration, rel=1e-8)
    assert abs(impact.loop_area) < 1e-8 * MASS * SPEED**2


def test_hertz_own_factor():
    # 2.94 delta_max / v0 for spheres, in every textbook
    impact = single_impact(Hertz(impact_stiffness=1e9, impact_exponent=1.5), MASS, SPEED)
    assert impact.duration * SPEED / impact.deepest == pytest.approx(2.9432, abs=1e-4)
