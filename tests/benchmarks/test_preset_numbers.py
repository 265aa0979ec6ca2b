"""The presets' numbers follow from what is stated, by the equations of docs/presets.md."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import root_scalar

from benchmarks.preset_search import bands, every_set, near
from vibrojax.errors import NoConvergenceError
from vibrojax.presets import read_preset
from vibrojax.presets.facts import fits_labels
from vibrojax.presets.single_impact import SingleImpact


def natural_frequencies(labels: Sequence[float], low: float, high: float, step: float = 2e-4) -> list[tuple[float, float]]:
    """Intervals of f_n, Hz, that `fits_labels` allows.

    Example:
        >>> natural_frequencies([2.0, 4.1], 1.0, 1.4)[0]
        (1.0242, 1.0256)
    """
    trials = np.arange(low, high, step)
    good = np.array([fits_labels(trial, labels) for trial in trials])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
    return [(round(float(trials[a]), 6), round(float(trials[b - 1]), 6)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def least_restitution(points: Sequence[tuple[float, float]], damping_ratio: float) -> float:
    """Least e at which z = 1/1 is stable at every point (Omega/omega, gap/A0): where impact and no impact are said to coexist.

    Raises:
        NoConvergenceError: no e below 0.99 does.
    """
    for restitution in np.arange(0.3, 0.99, 0.01):
        motions = [(SingleImpact(damping_ratio=damping_ratio, restitution=float(restitution), gap=gap, cycles=1), r) for r, gap in points]
        if all(motion.is_stable(ratio) for motion, ratio in motions):
            return round(float(restitution), 2)
    raise NoConvergenceError(f"no restitution below 0.99 makes z = 1/1 stable at {list(points)} with zeta = {damping_ratio:g}")


def gap_ratio(band_end: float, damping_ratio: float, restitution: float) -> float:
    """gap / A0 at which the band z = 1/1 ends at Omega/omega = `band_end`, between 1 and 2.

    Example:
        >>> round(gap_ratio(1.65, 0.01, 0.75), 1)
        5.6
    """

    def miss(gap: float) -> float:
        motion = SingleImpact(damping_ratio=damping_ratio, restitution=restitution, gap=gap, cycles=1)
        end = motion.band_end()
        return (end if np.isfinite(end) else 1.0) - band_end  # far behind a stop there is no band

    return float(root_scalar(miss, bracket=(0.2, 40.0), method="bisect", xtol=1e-3).root)


LABELS = (2.7, 3.8, 1.5, 3.3, 4.7, 1.2, 1.4, 2.7)


def test_labels_of_a_known_frequency_are_recognised():
    labels = [round(k * 0.25 / 1.37, 1) for k in (5, 9, 14, 22)]
    assert fits_labels(1.37, labels)
    assert any(low <= 1.37 <= high for low, high in natural_frequencies(labels, 1.2, 1.5))
    assert not fits_labels(1.37, [*labels, 0.1])


def test_the_wires_natural_frequency_is_the_one_the_labels_allow_nearest_to_a_quarter_of_7_25_hz():
    intervals = natural_frequencies(LABELS, 1.7, 2.1)
    low, high = min(intervals, key=lambda interval: abs(np.mean(interval) - 7.25 / 4))
    assert low <= read_preset("wires")["natural_frequency_hz"] <= high


def test_period_doubling_at_gap_zero_hardly_depends_on_what_is_assumed():
    for damping, restitution in ((0.005, 0.9), (0.05, 0.4), (0.01, 0.75)):
        motion = SingleImpact(damping_ratio=damping, restitution=restitution, gap=0.0, cycles=1)
        last = max(ratio for ratio in np.arange(2.5, 2.8, 0.005) if motion.is_stable(ratio))
        assert last == pytest.approx(2.65, abs=0.035)


def test_restitution_and_amplitude_of_the_wires():
    preset = read_preset("wires")
    zeta, f_n = preset["damping_ratio"], preset["natural_frequency_hz"]
    least = least_restitution([(1.75, 2.5), (1.75, 3.5)], zeta)
    assert least <= preset["restitution"]
    assert preset["base_amplitude"] == pytest.approx(1e-3 / gap_ratio(3.00 / f_n, zeta, preset["restitution"]), rel=0.01)


def test_amplitude_and_frequency_of_the_beams():
    wide, middle, narrow = (read_preset(name) for name in ("beam_170", "beam_150", "beam_135"))
    sets = every_set(
        natural_frequency=np.arange(4.3, 4.8, 0.01),
        restitution=[wide["restitution"]],
        damping_ratio=[wide["damping_ratio"]],
        gap_ratio=[1.0],
        power=[0.0],
    )
    found = bands(sets, 1, gap=False)
    both = sets.natural_frequency[near(found.largest, 9.00) & near(found.end, 12.25)]
    assert both.min() < wide["natural_frequency_hz"] < both.max()
    assert middle["natural_frequency_hz"] == 12.00 / 2
    power = math.log(6.0 / 4.57) / math.log(150 / 170)
    assert narrow["natural_frequency_hz"] == pytest.approx(4.57 * (135 / 170) ** power, abs=0.03)
    expected = 1e-3 / gap_ratio(9.25 / 6.0, middle["damping_ratio"], middle["restitution"])
    assert middle["base_amplitude"] == pytest.approx(expected, rel=0.01)


def test_a_stop_too_far_for_a_band_does_not_stop_the_search_for_the_gap():
    assert gap_ratio(9.25 / 6.0, 0.02, 0.6) == pytest.approx(4.63, abs=0.05)


def test_no_restitution_reaches_too_far_a_stop():
    with pytest.raises(NoConvergenceError, match="no restitution below 0.99"):
        least_restitution([(1.95, 20.0)], 0.1)
