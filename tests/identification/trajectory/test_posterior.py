"""Covariances of knots against a dense inverse, and the likelihood's gradient by a reading error against difference quotients."""

import dataclasses

import numpy as np
import pytest

from identification.trajectory import elimination
from identification.trajectory.fit import equations
from identification.trajectory.posterior import expected_products, knots_covariance
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.variances import Variances, likeliest, reweighed
from tests.identification.trajectory.conftest import FORCE, MEMORY

SHAKEN = RandomForce(std=FORCE, memory=MEMORY)
ERROR = ReadingError(coefficients=(0.8, -0.3, 0.1), innovation=0.8)
LIMIT = 0.99


@pytest.fixture(scope="module")
def solved(vibrating):
    return equations(vibrating, vibrating.start, Variances(force=SHAKEN, readings=(ERROR,)))


def test_neighbouring_knots_have_the_covariance_of_a_dense_inverse(solved):
    *_, solution = solved
    count, size = solution.knots.shape
    band, whole = solution.factor, np.zeros((solution.knots.size, solution.knots.size))
    for below in range(len(band)):
        columns = np.arange(solution.knots.size - below)
        whole[columns + below, columns] = band[below, columns]
    inverse, found = np.linalg.inv(whole @ whole.T), knots_covariance(solution)
    for knot in (0, 1, count // 2, count - 3):
        expected = inverse[size * knot : size * (knot + 3), size * knot : size * (knot + 3)]
        assert np.allclose(found[knot], expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(("error", "lost"), [(ERROR, 0.0), (ERROR, 0.1), (ERROR, 0.5), (ReadingError(innovation=0.8), 0.0)])
def test_the_gradient_by_a_reading_error_is_that_of_the_marginal_likelihood(vibrating, error, lost):
    """Also where a share of the samples is lost, so that few have as many before them as the error's order."""
    chains = vibrating.chains
    kept = np.random.default_rng(1).random(chains.weight.shape) >= lost
    problem = dataclasses.replace(vibrating, chains=dataclasses.replace(chains, weight=chains.weight * kept))
    linear, _, solution = equations(problem, problem.start, Variances(force=SHAKEN, readings=(error,)))
    ((sums, counts),) = expected_products(problem.chains, problem.unknowns, problem.border, linear, solution, error.order)
    assert counts.sum() == np.sum(problem.chains.weight > 0)
    free = error.free(LIMIT)

    def marginal(x: np.ndarray) -> float:
        local = reweighed(problem, problem.start, linear, (ReadingError.of(x, LIMIT),))
        return elimination.solved(problem, problem.start, local, SHAKEN).deviance

    for place in range(len(free)):
        step = np.where(np.arange(len(free)) == place, 1e-4, 0.0)
        expected = (marginal(free + step) - marginal(free - step)) / 2e-4
        up, down = (ReadingError.of(free + sign * step, LIMIT).deviance(sums, counts) for sign in (1.0, -1.0))
        assert (up - down) / 2e-4 == pytest.approx(expected, rel=1e-4)


def test_likeliest_variances_are_a_maximum(vibrating, solved):
    linear, *_ = solved
    begin = Variances(force=SHAKEN, readings=(ReadingError(coefficients=(0.1,)),))
    force, readings = likeliest(vibrating, vibrating.start, linear, begin)

    def marginal(std: float, memory: float, reading: ReadingError) -> float:
        local = reweighed(vibrating, vibrating.start, linear, (reading,))
        tried = RandomForce(std=std, memory=memory)
        return elimination.solved(vibrating, vibrating.start, local, tried).deviance

    least = marginal(force.std, force.memory, readings[0])
    (a,) = readings[0].coefficients
    off = [(1.1, 1, 0, 1), (0.9, 1, 0, 1), (1, 1.2, 0, 1), (1, 0.8, 0, 1), (1, 1, 0.08, 1), (1, 1, -0.08, 1), (1, 1, 0, 1.05)]
    for std, memory, coefficient, innovation in off:
        other = ReadingError(coefficients=(a + coefficient,), innovation=innovation * readings[0].innovation)
        assert marginal(std * force.std, memory * force.memory, other) > least
