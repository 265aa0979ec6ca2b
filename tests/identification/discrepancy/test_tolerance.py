import dataclasses

import numpy as np
import pytest

from identification.discrepancy.robust import Tolerance, tolerance

SAMPLES = np.full(4, 100)
NOISE = 50.0
ALLOWED = Tolerance(samples=SAMPLES, cut=25.0)


def test_where_nothing_is_tempered_the_share_is_that_of_chi_square():
    before, after = np.array([250.0, 450.0, 50.0, 40.0]), np.array([150.0, 150.0, 60.0, 45.0])
    total_before, total_after = before.sum() - 4 * NOISE, after.sum() - 4 * NOISE
    assert ALLOWED.explained(before, after) == pytest.approx(1.0 - total_after / total_before)


def test_a_window_far_off_is_not_measured_on_the_logarithm():
    before, after = np.full(4, 100.0 * 1250.0), np.full(4, 0.1 * 100.0 * 1250.0)
    assert ALLOWED.explained(before, after) == pytest.approx(0.9, abs=1e-3)
    assert ALLOWED.total(after) > 0.5 * ALLOWED.total(before)


def test_one_lost_window_neither_makes_nor_spoils_an_explanation():
    before, after = np.array([1000.0, 1000.0, 1000.0, np.inf]), np.array([50.0, 50.0, 50.0, np.inf])
    found = ALLOWED.explained(before, after)
    assert found < 0.2
    regained = ALLOWED.explained(before, np.full(4, 50.0))
    assert regained == pytest.approx(1.0)
    assert ALLOWED.explained(np.full(4, 1000.0), after) < 0.2
    assert ALLOWED.explained(before, np.array([50.0, 50.0, 50.0, 1e9])) < 0.7


def test_a_worse_model_explains_nothing():
    assert ALLOWED.explained(np.full(4, 500.0), np.full(4, 5000.0)) == 0.0
    assert ALLOWED.explained(np.full(4, NOISE), np.full(4, NOISE)) == 0.0


def test_windows_of_free_decays_are_all_orderly(motion):
    """Elsewhere a good part of the windows may have missed an impact, and the others say what is usual."""
    experiment = motion.prepared.experiment
    decays = dataclasses.replace(experiment, records=tuple(dataclasses.replace(one, kind="free-decay") for one in experiment.records))
    samples = np.concatenate([(group.weight > 0).sum(axis=(1, 2)) for group in motion.prepared.groups])
    cost = 0.5 * samples * np.linspace(1.0, 1000.0, len(samples))
    assert tolerance(motion.prepared, cost).cut == pytest.approx(2.0 * 300.7, rel=0.02)
    assert tolerance(dataclasses.replace(motion.prepared, experiment=decays), cost).cut == pytest.approx(2000.0)
