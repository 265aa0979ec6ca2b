"""The multivariate t distribution of windows."""

import numpy as np
import pytest
from scipy.stats import multivariate_t

from identification.likelihood.robust import curvature, degrees_of_freedom, log_density, loss, weights

DEGREES = [1.0, 3.5, 40.0, 1e4]


@pytest.mark.parametrize("degrees", DEGREES)
@pytest.mark.parametrize("samples", [1, 7, 60])
def test_log_density_is_that_of_the_multivariate_t(degrees, samples):
    """Beside n / 2 ln 2 pi, which knows neither the deviation nor the degrees of freedom."""
    x = np.random.default_rng(samples).normal(size=(6, samples)) * np.array([0.0, 0.5, 1.0, 1.0, 3.0, 30.0])[:, None]
    count = np.full(6, float(samples))
    found = log_density(np.sum(x**2, axis=1), count, degrees) - 0.5 * count * np.log(2.0 * np.pi)
    expected = multivariate_t(loc=np.zeros(samples), shape=np.eye(samples), df=degrees).logpdf(x)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("degrees", DEGREES)
def test_loss_is_what_the_log_density_falls_from_its_top(degrees):
    deviation, samples = np.array([0.0, 3.0, 200.0]), np.full(3, 20.0)
    top = log_density(np.zeros(3), samples, degrees)
    np.testing.assert_allclose(loss(deviation, samples, degrees), top - log_density(deviation, samples, degrees), rtol=1e-9, atol=1e-9)


def test_loss_is_half_the_square_where_all_windows_are_alike():
    deviation, samples = np.array([0.0, 3.0, 200.0]), np.full(3, 20.0)
    np.testing.assert_allclose(loss(deviation, samples, 1e9), 0.5 * deviation, rtol=1e-6)


@pytest.mark.parametrize("degrees", [1.0, 4.0, 25.0])
def test_weight_is_the_expected_precision_of_a_window(degrees):
    """Of a Gaussian window whose precision w is gamma distributed with shape and rate nu / 2, given its deviation: by summing over w."""
    deviation, samples = np.array([0.1, 12.0, 300.0]), np.array([4.0, 12.0, 12.0])
    w = np.exp(np.linspace(-14.0, 6.0, 4001))
    for d, n, found in zip(deviation, samples, weights(deviation, samples, degrees), strict=True):
        exponent = 0.5 * (n + degrees) * np.log(w) - 0.5 * w * (degrees + d)  # one power more for the even logarithms
        density = np.exp(exponent - exponent.max())
        assert found == pytest.approx(np.sum(w * density) / np.sum(density), rel=1e-6)


def test_a_window_that_could_not_be_integrated_has_no_weight():
    np.testing.assert_array_equal(weights(np.array([np.inf, 5.0]), np.array([0.0, 5.0]), 4.0), [0.0, 1.0])


@pytest.mark.parametrize("degrees", [60.0, 120.0])
def test_degrees_of_freedom_come_back(degrees):
    """From 600 windows, each of its own precision."""
    rng = np.random.default_rng(7)
    samples = rng.integers(30, 60, 600).astype(float)
    deviation = rng.chisquare(samples) / (rng.gamma(0.5 * degrees, 2.0 / degrees, 600))
    assert degrees_of_freedom(deviation, samples) == pytest.approx(degrees, rel=0.15)


def test_gaussian_windows_have_many_degrees_of_freedom_and_count_alike():
    rng = np.random.default_rng(8)
    samples = rng.integers(30, 60, 600).astype(float)
    deviation = rng.chisquare(samples)
    found = degrees_of_freedom(deviation, samples)
    assert found > 300.0
    np.testing.assert_allclose(weights(deviation, samples, found), 1.0, atol=0.2)


def test_windows_without_samples_do_not_count():
    rng = np.random.default_rng(9)
    samples = np.full(50, 40.0)
    deviation = rng.chisquare(samples) / rng.gamma(2.0, 0.5, 50)
    more = degrees_of_freedom(np.append(deviation, 1e9), np.append(samples, 0.0))
    assert more == pytest.approx(degrees_of_freedom(deviation, samples), rel=1e-9)


def test_at_least_as_many_as_a_window_has_samples():
    deviation = np.where(np.arange(20) % 2 == 0, 1e-3, 1e9)
    assert degrees_of_freedom(deviation, np.full(20, 40.0)) == pytest.approx(40.0, rel=0.01)


@pytest.mark.parametrize("degrees", [5.0, 100.0])
@pytest.mark.parametrize("scale", [0.3, 2.0])
def test_curvature_makes_the_hessian_that_of_the_loss(degrees, scale):
    """By second differences, of residuals linear in three unknowns; a third of each window's misfit can be explained."""
    rng, samples, step = np.random.default_rng(1), 30, 1e-4
    jacobian = rng.normal(size=(2, samples, 3))
    residual = scale * (rng.normal(size=(2, samples)) + np.einsum("wsi,i->ws", jacobian, [0.3, -0.2, 0.1]))
    count = np.full(2, float(samples))

    def cost(x: np.ndarray) -> np.ndarray:
        return loss(np.sum((residual + jacobian @ x) ** 2, axis=1), count, degrees)

    unit = step * np.eye(3)
    expected = np.array(
        [[cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b) for b in unit] for a in unit],
    ).transpose(2, 0, 1) / (4.0 * step**2)
    weight = weights(np.sum(residual**2, axis=1), count, degrees)
    gradient = weight[:, None] * np.einsum("wsi,ws->wi", jacobian, residual)
    hessian = weight[:, None, None] * jacobian.transpose(0, 2, 1) @ jacobian
    found = hessian - curvature(gradient, hessian, count, degrees)[:, None, None] * gradient[:, :, None] * gradient[:, None, :]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_the_hessian_stays_positive_where_one_unknown_explains_a_whole_window():
    """All of its misfit lies along its unknown, where the loss has negative curvature."""
    jacobian, samples = np.ones((1, 20)), np.array([20.0])
    residual = 100.0 * jacobian
    weight = weights(np.sum(residual**2, axis=1), samples, 3.0)
    gradient, hessian = weight[:, None] * (residual @ jacobian.T), weight[:, None, None] * np.array([[[20.0]]])
    assert 2.0 / (3.0 + 20.0) * gradient[0, 0] ** 2 > hessian[0, 0, 0]
    left = hessian[0, 0, 0] - curvature(gradient, hessian, samples, 3.0)[0] * gradient[0, 0] ** 2
    assert left == pytest.approx(0.02 * hessian[0, 0, 0], rel=1e-6)
