"""Elimination of the window states against the dense system that it stands for."""

import dataclasses

import numpy as np
import pytest

from identification.least_squares.block_arrow import Equations, covariance, newton_decrement, reduce, solve
from identification.windows.layout import GAP_PRIOR_STD, Active, Estimate

SHARED, RECORDS, WINDOWS, LOCAL = 3, 2, 5, 8
RECORD = np.array([0, 0, 1, 1, 1])


@pytest.fixture
def problem():
    """Random residual Jacobians of five windows in two records, and a point."""
    rng = np.random.default_rng(3)
    jacobian = rng.normal(size=(WINDOWS, 30, LOCAL))
    residual = rng.normal(size=(WINDOWS, 30))
    equations = Equations(
        hessian=np.einsum("lsi,lsj->lij", jacobian, jacobian),
        gradient=np.einsum("lsi,ls->li", jacobian, residual),
        cost=0.5 * np.sum(residual**2, axis=1),
        record=RECORD,
    )
    estimate = Estimate(
        shared=rng.normal(size=SHARED), nuisances=1e-3 * rng.normal(size=(RECORDS, 3)), states=rng.normal(size=(WINDOWS, 2))
    )
    active = Active(shared=np.array([True, False, True]), nuisances=np.array([[True, True, True], [True, False, True]]))
    return jacobian, equations, estimate, active


def dense(jacobian, equations, estimate):
    """Hessian and gradient over (shared, nuisances, states) without any elimination."""
    size = SHARED + 3 * RECORDS + 2 * WINDOWS
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    for window, record in enumerate(RECORD):
        place = [*range(SHARED), *range(SHARED + 3 * record, SHARED + 3 * record + 3)]
        place += [SHARED + 3 * RECORDS + 2 * window, SHARED + 3 * RECORDS + 2 * window + 1]
        hessian[np.ix_(place, place)] += equations.hessian[window]
        gradient[place] += equations.gradient[window]
    for record in range(RECORDS):
        gap = SHARED + 3 * record + 2
        hessian[gap, gap] += GAP_PRIOR_STD**-2
        gradient[gap] += estimate.nuisances[record, 2] / GAP_PRIOR_STD**2
    return hessian, gradient


def test_step_is_that_of_the_dense_system(problem):
    """Every unknown moves as in the full normal equations; what is not active stays."""
    jacobian, equations, estimate, active = problem
    hessian, gradient = dense(jacobian, equations, estimate)
    free = np.concatenate([active.shared, active.nuisances.ravel(), np.ones(2 * WINDOWS, bool)])
    expected = np.zeros(len(gradient))
    expected[free] = -np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
    shared, nuisances, states = solve(reduce(equations, estimate, active, 0.0), equations, estimate)
    found = np.concatenate([shared, nuisances.ravel(), states.ravel()])
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-12)


def test_a_parameter_that_would_go_too_far_is_held_and_the_others_follow(problem):
    """As in the full normal equations with that step given; nothing else is cut."""
    jacobian, equations, estimate, active = problem
    reduced = reduce(equations, estimate, active, 0.0)
    whole = solve(reduced, equations, estimate)[0]
    longest = 0.8 * np.abs(whole).max()
    far = int(np.argmax(np.abs(whole)))
    hessian, gradient = dense(jacobian, equations, estimate)
    free = np.concatenate([active.shared, active.nuisances.ravel(), np.ones(2 * WINDOWS, bool)])
    free[far] = False
    expected = np.zeros(len(gradient))
    expected[far] = np.copysign(longest, whole[far])
    expected[free] = -np.linalg.solve(hessian[np.ix_(free, free)], gradient[free] + hessian[free, far] * expected[far])
    shared, nuisances, states = solve(reduced, equations, estimate, longest=longest)
    assert np.abs(expected[:SHARED]).max() <= longest
    np.testing.assert_allclose(np.concatenate([shared, nuisances.ravel(), states.ravel()]), expected, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("longest", [0.5, np.inf])
def test_a_step_that_is_not_finite_stays_visible(problem, longest):
    _, equations, estimate, active = problem
    broken = dataclasses.replace(equations, gradient=np.full_like(equations.gradient, np.nan))
    shared, _, _ = solve(reduce(broken, estimate, active, 0.0), broken, estimate, longest=longest)
    assert np.isnan(shared[active.shared]).all()
    np.testing.assert_array_equal(shared[~active.shared], 0.0)


def test_no_shared_step_is_longer_than_allowed(problem):
    _, equations, estimate, active = problem
    reduced = reduce(equations, estimate, active, 0.0)
    for longest in (1e-3, 1e-2, 0.1):
        assert np.abs(solve(reduced, equations, estimate, longest=longest)[0]).max() <= longest


def test_covariance_is_the_block_of_the_dense_inverse(problem):
    """The inverse of the reduced matrix is the marginal covariance of what it keeps."""
    jacobian, equations, estimate, active = problem
    hessian, _ = dense(jacobian, equations, estimate)
    free = np.concatenate([active.shared, active.nuisances.ravel(), np.ones(2 * WINDOWS, bool)])
    full = np.linalg.inv(hessian[np.ix_(free, free)])
    kept = int(active.shared.sum() + active.nuisances.sum())
    reduced = reduce(equations, estimate, active, 0.0)
    found = covariance(reduced.hessian[np.ix_(reduced.active, reduced.active)])
    np.testing.assert_allclose(found, full[:kept, :kept], rtol=1e-7, atol=1e-14)


def test_scores_sum_to_the_gradient_without_the_prior(problem):
    """Windows' scores are what the sandwich is filled with: together they are the gradient."""
    _, equations, estimate, active = problem
    still = Estimate(shared=estimate.shared, nuisances=0 * estimate.nuisances, states=estimate.states)
    reduced = reduce(equations, still, active, 0.0)
    np.testing.assert_allclose(reduced.scores.sum(axis=0), reduced.gradient, rtol=1e-12)


def test_decrement_is_twice_the_predicted_fall(problem):
    """g' H^-1 g of the full normal equations, window states included."""
    jacobian, equations, estimate, active = problem
    hessian, gradient = dense(jacobian, equations, estimate)
    free = np.concatenate([active.shared, active.nuisances.ravel(), np.ones(2 * WINDOWS, bool)])
    expected = gradient[free] @ np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
    assert newton_decrement(reduce(equations, estimate, active, 0.0), equations) == pytest.approx(expected, rel=1e-8)
