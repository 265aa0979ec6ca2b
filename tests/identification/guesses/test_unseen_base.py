"""Carts without a sensor: amplitude and phase of their sine from the hammer alone, before any fit."""

import numpy as np
import pytest

from benchmarks.complete.rigs import Job, write_awkward
from identification.experiment import load_experiment
from identification.guesses.weak_form import Regression, robust_regression
from identification.trajectory.start import problem_of


@pytest.mark.parametrize("index", [0, 5], ids=["one cart, soft rig", "both carts, stiff rig"])
def test_the_sine_of_an_unseen_cart_is_read_from_the_flights(index, tmp_path):
    """Also the suspension, though the drop test's impacts are weak and its flights short."""
    drawn = write_awkward(tmp_path, Job(seed=1, index=index))
    problem = problem_of(load_experiment(tmp_path))
    found = problem.values(problem.start)
    assert found["f_n"] == pytest.approx(drawn.rig.f_n, rel=0.002)
    assert found["zeta"] == pytest.approx(drawn.rig.zeta, rel=0.2)
    assert drawn.unseen
    for plan, (sine, cosine, _), motion in zip(drawn.plans, problem.start.own, problem.motions, strict=True):
        assert motion is not None
        if plan.file in drawn.unseen:
            off = sine + 1j * cosine - drawn.rig.base_amplitude * np.exp(1j * plan.base_phase)
            assert abs(off) < 0.03 * drawn.rig.base_amplitude
            assert motion.touching.any()


def test_outliers_hardly_move_a_regression():
    """Forty per cent of the equations are off by a thousand standard deviations, on one side."""
    draws = np.random.default_rng(0)
    matrix = draws.standard_normal((200, 2))
    right = matrix @ [2.0, -1.0] + 0.1 * draws.standard_normal(200)
    right[:80] += 100.0
    found = robust_regression(matrix, right)
    assert np.all(np.abs(found.estimate - [2.0, -1.0]) < 4.0 * np.sqrt(np.diag(found.covariance)))
    assert 1.0 < found.stderr(0) / (0.1 / np.sqrt(120)) < 3.0  # the median counts outliers as large residuals


def test_regressions_add_up_and_unknowns_of_one_alone_are_eliminated():
    draws = np.random.default_rng(1)
    (one, other), truth = draws.standard_normal((2, 40, 3)), np.array([2.0, -1.0, 0.5])
    parts = [Regression(information=m.T @ m, score=m.T @ (m @ truth)) for m in (one, other)]
    together = parts[0].without(1) + parts[1].without(1)
    np.testing.assert_allclose(together.estimate, truth[:2])
    np.testing.assert_allclose(together.covariance, np.linalg.inv(sum(np.linalg.inv(np.linalg.inv(p.information)[:2, :2]) for p in parts)))
    assert (parts[0].padded(2) + Regression.nothing(5)).stderr(4) == np.inf
