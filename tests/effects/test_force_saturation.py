import dataclasses

import numpy as np
import pytest

from tests.effects.rig import Reference, assert_same, simulate
from tests.effects.scales import SCALES
from vibrojax.effects import ForceSaturation


@pytest.mark.parametrize(("force", "threshold"), [(0.4, 5e-4), (2.0, 3e-3)])
def test_agrees_with_an_independent_integration(force, threshold):
    readings, _ = simulate(ForceSaturation(force, threshold))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -force * np.clip(u / threshold, -1.0, 1.0)))


def test_within_a_threshold_out_of_reach_it_is_a_linear_spring():
    readings, _ = simulate(ForceSaturation(30.0, 0.1))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -300.0 * u))


def test_thresholds_lie_within_the_motion():
    found = [candidate[0] for candidate in ForceSaturation.probe.candidates(SCALES)]
    assert all(0.0 < one.threshold < SCALES.amplitude for one in found)
    assert len({one.threshold for one in found}) == len(found)
    assert ForceSaturation.probe.candidates(dataclasses.replace(SCALES, amplitude=0.0)) == ()
