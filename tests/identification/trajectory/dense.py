"""Generalised least squares with whole matrices: what the chain's equations are compared with."""

import numpy as np
from scipy.linalg import toeplitz
from statsmodels.tsa.arima_process import arma_acovf

from identification.trajectory.fit import equations
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.start import Problem
from identification.trajectory.variances import Variances
from tests.identification.trajectory.conftest import MASS

WHITE = ReadingError()


def solved(problem: Problem, force: RandomForce, error: ReadingError = WHITE):
    return equations(problem, problem.start, Variances(force=force, readings=(error,)))


def dense(problem: Problem, force: RandomForce, error: ReadingError) -> tuple[float, np.ndarray, np.ndarray]:
    """-2 log restricted likelihood, estimate and covariance of knots and border: generalised least squares with whole matrices."""
    linear, _, _ = solved(problem, force, error)
    chains, scales = problem.chains, problem.scales
    knots, states, free = chains.knot_count, 2, int(problem.border.shared.sum())
    size = 3 * knots + free
    rows, off, prior = np.zeros((linear.residual.size, size)), linear.residual.ravel(), np.zeros((size, size))
    for segment, left in enumerate(chains.left):
        for sample in range(chains.samples):
            row = rows[segment * chains.samples + sample]
            by = linear.by[segment, sample, 0]
            row[3 * left : 3 * left + 2], row[3 * left + 2], row[3 * left + 5] = by[:2], by[2], by[3]
            row[3 * knots :] = by[4 : 4 + free]
    length = chains.samples * (chains.of_record(0).stop - chains.of_record(0).start)
    lags = arma_acovf([1.0, *(-a for a in error.coefficients)], [1.0], length, sigma2=error.innovation**2)
    noise = np.kron(np.eye(len(chains.files)), toeplitz(lags[:length]))
    constants, logs = np.zeros(size), np.linalg.slogdet(noise)[1]
    square = off @ np.linalg.solve(noise, off)
    for segment, left in enumerate(chains.left):
        covariance = force.bridge(chains.duration[segment : segment + 1], MASS)[0] + np.diag(scales.floor**2)
        defect = np.zeros((states, size))
        by = linear.end_by[segment]
        defect[:, 3 * left : 3 * left + 3], defect[:, 3 * left + 5] = -by[:, :3], -by[:, 3]
        defect[:, 3 * left + 3 : 3 * left + 5] = np.eye(2)
        defect[:, 3 * knots :] = -by[:, 4 : 4 + free]
        gap = problem.start.states[left + 1] - linear.end[segment]
        prior += defect.T @ np.linalg.solve(covariance, defect)
        constants += defect.T @ np.linalg.solve(covariance, gap)
        square += gap @ np.linalg.solve(covariance, gap)
        logs += np.linalg.slogdet(covariance)[1]
    for one in chains.knots:
        place = np.arange(one.start, one.stop)
        times = np.concatenate([[0.0], np.cumsum(chains.duration[: len(place) - 1])])
        covariance = force.std**2 * np.exp(-np.abs(np.subtract.outer(times, times)) / force.memory)
        prior[np.ix_(3 * place + 2, 3 * place + 2)] += np.linalg.inv(covariance)
        logs += np.linalg.slogdet(covariance)[1]
        for which, std in enumerate((10 * scales.displacement, 10 * scales.velocity)):
            prior[3 * one.start + which, 3 * one.start + which] += std**-2.0
    hessian = rows.T @ np.linalg.solve(noise, rows) + prior
    gradient = rows.T @ np.linalg.solve(noise, off) + constants
    step = -np.linalg.solve(hessian, gradient)
    deviance = square + gradient @ step + logs + np.linalg.slogdet(hessian)[1]
    return deviance, step, np.linalg.inv(hessian)
