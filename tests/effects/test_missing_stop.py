import dataclasses

import numpy as np
import pytest

from tests.effects.rig import GAP, K_I, LAMBDA, LAW, N_I, Reference, assert_same, simulate
from tests.effects.scales import SCALES
from vibrojax.contact import NoContact
from vibrojax.effects import MissingStop


def test_agrees_with_an_independent_integration():
    readings, _ = simulate(MissingStop(K_I, N_I, LAMBDA, 2e-4), law=NoContact())
    assert_same(readings, Reference(gap=lambda t, z: (GAP + 2e-4, 0.0)))


def test_stands_where_the_hammer_just_gets_to_if_no_stop_was_stated():
    scales = dataclasses.replace(SCALES, law=NoContact(), gaps={"drop.csv": 1.0, "cart1.csv": 1.0})
    found = [candidate[0] for candidate in MissingStop.probe.candidates(scales)]
    assert all(1.0 + one.gap_offset == pytest.approx(0.98 * scales.amplitude) for one in found)
    stated = dataclasses.replace(scales, gaps={"drop.csv": 0.0, "cart1.csv": 1.0})
    assert all(candidate[0].gap_offset == 0.0 for candidate in MissingStop.probe.candidates(stated))


def test_candidates_scale_with_the_rig():
    """Lengths a tenth and speeds threefold: the indentation of an impact at the largest speed is a tenth too."""
    slow = dataclasses.replace(SCALES, law=NoContact(), gaps={"drop.csv": 0.0})
    fast = dataclasses.replace(slow, amplitude=0.1 * slow.amplitude, speed=3.0 * slow.speed)
    for (one,), (other,) in zip(MissingStop.probe.candidates(slow), MissingStop.probe.candidates(fast), strict=True):
        before, after = (_deepest(stop, scales) for stop, scales in ((one, slow), (other, fast)))
        assert after == pytest.approx(0.1 * before)
        assert before < slow.amplitude


def _deepest(stop: MissingStop, scales) -> float:
    """Where the energy of the largest speed is stored, m."""
    order = stop.impact_exponent + 1.0
    return (0.5 * order * scales.mass * scales.speed**2 / stop.impact_stiffness) ** (1.0 / order)


def test_is_the_nominal_stop_where_that_was_left_out_and_nothing_beside_it():
    stop = MissingStop(K_I, N_I, LAMBDA, 0.0)
    law, gap = stop.stop(NoContact(), GAP)
    assert (law, gap) == (LAW, GAP)
    other = MissingStop(1.0, 1.0, 1.0, 1.0).stop(LAW, GAP)
    assert other == (LAW, GAP)
    assert np.isfinite(gap)
