"""Autoregressive noise against its covariance written out, and its estimation from noise whose filter is known."""

import numpy as np
import pytest
from scipy.linalg import solve_toeplitz, toeplitz
from scipy.signal import lfilter

from identification.likelihood.noise import HIGHEST_ORDER, autoregression, measured, runs, white
from tests.identification.likelihood.made_windows import autocovariance, noise_covariance

POLE, STRETCH, STRETCHES = 0.7, 1500, 8
SLOW = 0.005
"""Cycles a sample; the filter of two equal poles has its corner at ten times that."""
COEFFICIENTS = np.array([2.0 * POLE, -(POLE**2)])


def some_noise(order: int):
    """Of a few poles, and its autocovariance."""
    coefficients = -np.poly([0.8, 0.4 + 0.5j, 0.4 - 0.5j, -0.3][:order]).real[1:]
    return autoregression(autocovariance(coefficients, 0.7, order + 1)), coefficients


def coloured(seed: int, *, std: float = 1.0) -> list[np.ndarray]:
    """Stretches of noise with two equal poles, of a known standard deviation."""
    rng = np.random.default_rng(seed)
    size = std / np.sqrt(autocovariance(COEFFICIENTS, 1.0, 1)[0])
    return [size * lfilter([1.0], [1.0, *-COEFFICIENTS], rng.standard_normal(STRETCH + 500))[500:] for _ in range(STRETCHES)]


@pytest.fixture
def valid() -> np.ndarray:
    """Two windows of 30 samples with breaks, some stretches shorter than any order."""
    flags = np.ones((2, 30), bool)
    flags[0, [0, 4, 5, 7, 20]] = False
    flags[1, [2, 29]] = False
    return flags


@pytest.mark.parametrize("order", [1, 3, 4])
def test_whitened_products_are_those_of_the_inverse_covariance(valid, order):
    """x' R^-1 y of all rows; what stands in a break does not matter."""
    noise, _ = some_noise(order)
    values = np.random.default_rng(order).normal(size=(2, 3, 30))
    whitened = noise.whitened(np.where(valid[:, None], values, np.nan), runs(valid))
    for window, flags in enumerate(valid):
        x = values[window][:, flags]
        expected = x @ np.linalg.solve(noise_covariance(noise, flags), x.T)
        np.testing.assert_allclose(whitened[window] @ whitened[window].T, expected, rtol=1e-10, atol=1e-10)
        np.testing.assert_array_equal(whitened[window][:, ~flags], 0.0)


@pytest.mark.parametrize("begin", [5, 6, 8, 21])
@pytest.mark.parametrize("order", [1, 3, 4])
def test_a_part_is_whitened_like_the_whole_that_is_zero_before_it(valid, order, begin):
    """Also where it begins just behind a break."""
    noise, _ = some_noise(order)
    values = np.random.default_rng(order).normal(size=(2, 3, 30))
    values[..., :begin] = 0.0
    whole, part = noise.whitened(values, runs(valid)), noise.whitened(values[..., begin:], runs(valid)[:, begin:])
    np.testing.assert_allclose(part, whole[..., begin:], rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("order", [1, 3, 4])
def test_log_scale_is_half_the_log_determinant(valid, order):
    noise, _ = some_noise(order)
    expected = [0.5 * np.linalg.slogdet(noise_covariance(noise, flags))[1] for flags in valid]
    np.testing.assert_allclose(noise.log_scale(runs(valid)), expected, rtol=1e-10)


def test_white_noise_is_only_scaled(valid):
    values = np.random.default_rng(0).normal(size=(2, 30))
    np.testing.assert_allclose(white(2.5).whitened(values, runs(valid)), np.where(valid, values / 2.5, 0.0), rtol=1e-12)
    np.testing.assert_allclose(white(2.5).log_scale(runs(valid)), valid.sum(axis=1) * np.log(2.5), rtol=1e-12)


def test_autoregressions_of_every_order_solve_the_yule_walker_equations():
    """For an autocovariance that no autoregression of low order has."""
    lag = np.arange(7)
    covariance = 2.3 * (0.6 * 0.9**lag + 0.4 * 0.7**lag * np.cos(0.7 * lag))
    noise = autoregression(covariance)
    assert noise.order == 6
    assert noise.std == pytest.approx(np.sqrt(covariance[0]), rel=1e-12)
    for order in range(1, 7):
        expected = solve_toeplitz(covariance[:order], covariance[1 : order + 1])
        np.testing.assert_allclose(noise.coefficients[order, :order], expected, rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(noise.coefficients[order, order:], 0.0)
        assert noise.innovation[order] ** 2 == pytest.approx(covariance[0] - expected @ covariance[1 : order + 1], rel=1e-10)


@pytest.mark.parametrize("order", [1, 3, 4])
def test_an_autoregression_comes_back_from_its_autocovariance(order):
    noise, coefficients = some_noise(order)
    np.testing.assert_allclose(noise.coefficients[-1], coefficients, rtol=1e-9, atol=1e-10)
    assert noise.innovation[-1] == pytest.approx(0.7, rel=1e-9)


def test_autocorrelation_and_density_are_those_of_the_autocovariance():
    """The autocorrelation beyond the order too; the density is its Fourier sum (Wiener, Khinchin)."""
    noise, coefficients = some_noise(4)
    covariance = autocovariance(coefficients, 0.7, 400)
    np.testing.assert_allclose(noise.autocorrelation(12), covariance[:12] / covariance[0], rtol=1e-9, atol=1e-12)
    frequency = np.linspace(0.0, 0.5, 11)
    expected = covariance[0] + 2.0 * np.cos(2.0 * np.pi * np.outer(frequency, np.arange(1, 400))) @ covariance[1:]
    np.testing.assert_allclose(noise.density(frequency), expected, rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_two_equal_poles_is_measured(seed):
    noise = measured(coloured(seed, std=2.0), slow=SLOW)
    assert noise is not None
    expected = autocovariance(COEFFICIENTS, 1.0, 6)
    assert 2 <= noise.order <= HIGHEST_ORDER
    assert noise.std == pytest.approx(2.0, rel=0.05)
    np.testing.assert_allclose(noise.autocorrelation(6), expected / expected[0], atol=0.04)


@pytest.mark.parametrize("seed", range(3))
def test_a_slow_disturbance_of_three_times_its_size_does_not_matter(seed):
    """A sine slower than `slow`, of another phase in every stretch."""
    rng, time = np.random.default_rng(seed + 100), np.arange(STRETCH)
    quiet = coloured(seed)
    disturbed = [x + 3.0 * np.sin(2.0 * np.pi * 0.3 * SLOW * time + rng.uniform(0.0, 2.0 * np.pi)) for x in quiet]
    alone, found = measured(quiet, slow=SLOW), measured(disturbed, slow=SLOW)
    assert alone is not None and found is not None
    assert found.std == pytest.approx(alone.std, rel=0.01)
    np.testing.assert_allclose(found.autocorrelation(6), alone.autocorrelation(6), atol=0.01)


def test_white_noise_has_no_order():
    segments = list(3.0 * np.random.default_rng(0).standard_normal((STRETCHES, STRETCH)))
    noise = measured(segments, slow=SLOW)
    assert noise is not None and noise.order == 0
    assert noise.std == pytest.approx(3.0, rel=0.02)


def test_a_declared_size_caps_what_is_measured():
    """At one and a half times; the autocorrelation stays, and what is smaller than declared too."""
    free, capped, known = (measured(coloured(1), slow=SLOW, known=size) for size in (None, 0.4, 2.0))
    assert free is not None and capped is not None and known is not None
    assert capped.std == pytest.approx(0.6, rel=1e-12)
    np.testing.assert_allclose(capped.autocorrelation(8), free.autocorrelation(8), rtol=1e-12)
    assert known.std == pytest.approx(free.std, rel=1e-12)


def test_a_loud_stretch_counts_no_more_than_two_others():
    """A hundred times as loud, among seven others."""
    segments = list(np.random.default_rng(2).standard_normal((STRETCHES, STRETCH)))
    loud = measured([100.0 * segments[0], *segments[1:]], slow=SLOW)
    assert loud is not None
    assert loud.std == pytest.approx(np.sqrt(9.0 / 7.0), rel=0.03)


@pytest.mark.parametrize("length", [0, 4 * HIGHEST_ORDER - 1, 100])
def test_in_too_short_stretches_no_noise_is_measured(length):
    """Fewer samples than the orders take, and fewer than four times the slow cosines."""
    assert measured([np.random.default_rng(0).standard_normal(length)] * 3, slow=0.25 if length == 100 else SLOW) is None


def test_without_stretches_or_with_zero_residuals_no_noise_is_measured():
    assert measured([], slow=SLOW) is None
    assert measured([np.zeros(STRETCH)], slow=SLOW) is None


def test_runs_count_from_the_last_break(valid):
    expected = np.zeros(valid.shape, int)
    for window, flags in enumerate(valid):
        for sample, flag in enumerate(flags):
            expected[window, sample] = (expected[window, sample - 1] if sample else 0) + 1 if flag else 0
    np.testing.assert_array_equal(runs(valid), expected)


def test_the_covariance_of_the_tests_is_toeplitz_without_breaks():
    noise, coefficients = some_noise(3)
    np.testing.assert_allclose(noise_covariance(noise, np.ones(9, bool)), toeplitz(autocovariance(coefficients, 0.7, 9)), rtol=1e-9)
