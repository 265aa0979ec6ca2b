"""Autoregressive reading errors against their covariance written out, and against statsmodels."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from statsmodels.tsa.arima_process import arma_acovf
from statsmodels.tsa.stattools import levinson_durbin

from identification.trajectory.reading_error import ReadingError, estimated, run_lengths, whitening

TWO = ReadingError(coefficients=(0.9, -0.35), innovation=0.7)
SEGMENTS, SAMPLES = 6, 5


def covariance(error: ReadingError, count: int) -> np.ndarray:
    """Of so many values in a row, by statsmodels."""
    lags = arma_acovf([1.0, *(-a for a in error.coefficients)], [1.0], count, sigma2=error.innovation**2)
    return toeplitz(lags[:count])


def drawn(error: ReadingError, count: int, seed: int = 2) -> np.ndarray:
    """Values of the process in its stationary state."""
    noise = error.innovation * np.random.default_rng(seed).standard_normal(count + 500)
    return np.asarray(lfilter([1.0], [1.0, *(-a for a in error.coefficients)], noise))[500:]


@pytest.mark.parametrize("error", [ReadingError(innovation=1.3), ReadingError(coefficients=(0.6,)), TWO])
def test_whitened_records_have_the_likelihood_of_the_stationary_covariance(error):
    """Two records side by side, each beginning in the stationary state."""
    first = np.array([True, False, False, True, False, False])
    values = drawn(error, SEGMENTS * SAMPLES).reshape(SEGMENTS, SAMPLES)
    white = whitening(error, np.ones((SEGMENTS, SAMPLES), bool), first)
    dense = covariance(error, 3 * SAMPLES)
    square = sum(one @ np.linalg.solve(dense, one) for one in (values[:3].ravel(), values[3:].ravel()))
    assert np.sum(white(values) ** 2) == pytest.approx(square, rel=1e-10)
    assert white.log_determinant == pytest.approx(2.0 * np.linalg.slogdet(dense)[1], rel=1e-10)


def test_a_gap_begins_anew_and_counts_nothing_inside():
    counted = np.ones((SEGMENTS, SAMPLES), bool)
    counted[2, 1:4] = False
    first = np.arange(SEGMENTS) == 0
    values = np.where(counted, drawn(TWO, SEGMENTS * SAMPLES).reshape(SEGMENTS, SAMPLES), 1e6)
    white = whitening(TWO, counted, first)
    flat, length = values.ravel(), 2 * SAMPLES + 1
    parts = flat[:length], flat[length + 3 :]
    square = sum(one @ np.linalg.solve(covariance(TWO, len(one)), one) for one in parts)
    assert np.sum(white(values) ** 2) == pytest.approx(square, rel=1e-10)
    assert white.log_determinant == pytest.approx(sum(np.linalg.slogdet(covariance(TWO, len(one)))[1] for one in parts), rel=1e-10)


def test_runs_end_at_gaps_and_at_the_beginning_of_a_record():
    counted = np.array([[True, True, False, True], [True, True, True, True]])
    assert run_lengths(counted, np.array([True, False]), 3).tolist() == [[0, 1, 2, 0], [1, 2, 3, 3]]
    assert run_lengths(counted, np.array([True, True]), 3).tolist() == [[0, 1, 2, 0], [0, 1, 2, 3]]


def test_estimates_solve_the_yule_walker_equations():
    values = drawn(TWO, 4000)
    found = estimated([values.reshape(-1, SAMPLES)], np.ones((800, SAMPLES), bool), np.arange(800) == 0, largest_pole=0.99, highest=2)
    variance, coefficients, *_ = levinson_durbin(values, nlags=2)
    assert found.order == 2
    assert np.allclose(found.coefficients, coefficients, atol=2e-3)
    assert found.innovation == pytest.approx(np.sqrt(variance), rel=2e-3)
    assert np.allclose(found.coefficients, TWO.coefficients, atol=0.05)


def test_white_noise_gets_no_memory():
    values = np.random.default_rng(5).standard_normal((800, SAMPLES))
    found = estimated([values], np.ones_like(values, bool), np.arange(800) == 0, largest_pole=0.99)
    assert found.order == 0
    assert found.std == pytest.approx(1.0, abs=0.03)


def test_no_pole_is_slower_than_the_limit():
    walk = np.cumsum(np.random.default_rng(6).standard_normal(4000)).reshape(-1, SAMPLES)
    found = estimated([walk], np.ones_like(walk, bool), np.arange(800) == 0, largest_pole=0.9)
    assert np.abs(np.roots([1.0, *(-a for a in found.coefficients)])).max() <= 0.9 + 1e-9


def test_unconstrained_numbers_give_the_autoregression_back():
    again = ReadingError.of(TWO.free(0.98), 0.98)
    assert np.allclose(again.coefficients, TWO.coefficients)
    assert again.innovation == pytest.approx(TWO.innovation)
    wild = ReadingError.of(np.array([0.0, 3.0, -2.0, 2.0, 1.0]), 0.95)
    assert np.abs(np.roots([1.0, *(-a for a in wild.coefficients)])).max() <= 0.95


def test_the_deviance_of_sums_of_products_is_that_of_the_values():
    first = np.array([True, False, False, True, False, False])
    values, counted = drawn(TWO, SEGMENTS * SAMPLES).reshape(SEGMENTS, SAMPLES), np.ones((SEGMENTS, SAMPLES), bool)
    white, runs = whitening(TWO, counted, first), run_lengths(counted, first, 3).ravel()
    shifted = np.stack([np.concatenate([np.zeros(lag), values.ravel()[: values.size - lag]]) for lag in range(4)], axis=-1)
    sums = np.stack([np.einsum("ij,il->jl", shifted[runs == run], shifted[runs == run]) for run in range(4)])
    expected = np.sum(white(values) ** 2) + white.log_determinant
    assert TWO.deviance(sums, np.array([np.sum(runs == run) for run in range(4)], float)) == pytest.approx(expected, rel=1e-10)
