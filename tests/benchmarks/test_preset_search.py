"""The search agrees with the closed form of a single motion, and says which facts contradict each other."""

import numpy as np
import pytest

from benchmarks.preset_search import RIGS, Sets, bands, coexists, every_set, label_frequencies, lasting, motion, near, outcome, points
from vibrojax.presets.single_impact import SingleImpact


def one(**numbers: float) -> Sets:
    given = dict(natural_frequency=2.0, restitution=0.75, damping_ratio=0.01, gap_ratio=5.6, power=0.0) | numbers
    return Sets(**{name: np.array([value]) for name, value in given.items()})


def test_arrays_agree_with_the_single_motion():
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(200):
        ratio, clearance, zeta, e = rng.uniform(1.1, 5.0), rng.uniform(0.0, 6.0), rng.uniform(2e-3, 0.05), rng.uniform(0.3, 0.95)
        cycles = int(rng.integers(1, 4))
        single = SingleImpact(damping_ratio=zeta, restitution=e, gap=clearance, cycles=cycles)
        speed, stable = motion(np.array([ratio]), np.array([clearance]), np.array([zeta]), np.array([e]), cycles)
        assert speed[0] == pytest.approx(single.speed(ratio), rel=1e-9, nan_ok=True)
        if np.isfinite(speed[0]):
            assert stable[0] == single.is_stable(ratio)
            seen += bool(stable[0])
    assert seen > 10


@pytest.mark.parametrize("cycles", [1, 2])
def test_bands_are_those_of_the_closed_form(cycles):
    without, gapped = bands(one(), cycles, gap=False), bands(one(), cycles, gap=True)
    assert without.largest[0] == pytest.approx(2.0 * 2.0 * cycles, rel=0.01)
    ideal = SingleImpact(damping_ratio=0.01, restitution=0.75, gap=5.6, cycles=cycles)
    assert gapped.end[0] == pytest.approx(2.0 * ideal.band_end(), rel=5e-3)
    assert 0.95 * gapped.end[0] < gapped.largest[0] <= gapped.end[0]


def test_a_smaller_amplitude_at_high_frequencies_ends_a_band_earlier():
    ends = [bands(one(power=power), 2, gap=True).end[0] for power in (-1.0, 0.0, 1.0)]
    assert ends == sorted(ends) and ends[0] < ends[2] - 0.1


def test_no_set_has_one_impact_a_cycle_at_twice_the_natural_frequency_or_more_beside_no_impact():
    """Eight of the twelve stated points of coexistence lie there: they need a motion of several impacts or cycles."""
    sets = every_set(
        natural_frequency=[2.0], restitution=np.arange(0.05, 1.0, 0.05), damping_ratio=[1e-3, 0.01, 0.05], gap_ratio=[1.0], power=[0.0]
    )
    everywhere = [point for rig in RIGS for point in points(rig)]
    high = [point for point in everywhere if point[0] >= 2.0]
    assert len(everywhere) == 12 and len(high) == 8
    assert not any(coexists(sets, *point).any() for point in high)
    assert all(coexists(sets, *point).any() for point in everywhere if point[0] < 2.0)


def test_facts_that_contradict_each_other_are_named():
    met = {
        "a": np.array([True, True, False, False]),
        "b": np.array([True, False, True, False]),
        "c": np.array([False, True, True, False]),
        "d": np.zeros(4, dtype=bool),
    }
    found = outcome(met)
    assert found.most == 2 and found.best.tolist() == [0, 1, 2]
    assert found.conflicts == [("a", "b", "c")]
    assert found.alone == {"a": True, "b": True, "c": True, "d": False}
    assert found.left_out["a"] == 0.0


def test_a_step_of_the_grid_is_near():
    assert near(np.array([4.5, 4.49, np.nan]), 4.75).tolist() == [True, False, False]


def test_labels_leave_some_natural_frequencies():
    found = label_frequencies([2.7, 3.8, 1.5, 3.3, 4.7, 1.2, 1.4], 1.81, 1.83, 1e-3)
    assert found and 1.818 <= min(found) and max(found) <= 1.829


def test_motion_that_dies_out_does_not_last():
    assert lasting(np.array([[0, 0], [5, 5], [5, 4], [4, 5]])).tolist() == [False, True, False, False]
