"""Windows that nothing explains: a multivariate t distribution, by which each has a scale of its own."""

from typing import Any

import numpy as np
from jaxtyping import Float, Real
from scipy.optimize import minimize_scalar
from scipy.special import gammaln

Windows = Float[np.ndarray, " windows"]
_LEAST = 0.02
"""Share of the curvature that a window keeps along its gradient."""
MOST_DEGREES = 1e6
"""Degrees of freedom from which on the distribution is Gaussian."""


def weights(deviation: Windows, samples: Real[np.ndarray, " windows"], degrees: float) -> Windows:
    """(nu + n) / (nu + d): how much each window counts, given r' V^-1 r = d of its n samples; 0 where d is infinite.

    Source: K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, JASA 84 (1989) 881-896.
    """
    return np.where(np.isfinite(deviation), (degrees + samples) / (degrees + np.where(np.isfinite(deviation), deviation, 0.0)), 0.0)


def loss(deviation: Windows, samples: Real[np.ndarray, " windows"], degrees: float) -> Windows:
    """(nu + n) / 2 ln(1 + d / nu), less what it is at d = 0; d / 2 in the limit of many degrees of freedom."""
    return 0.5 * (degrees + samples) * np.log1p(deviation / degrees)


def bend(
    gradient: Float[np.ndarray, "windows size"],
    hessian: Float[np.ndarray, "windows size size"],
    samples: Real[np.ndarray, " windows"],
    degrees: float,
) -> Windows:
    """2 / (nu + n): with g the gradient of a window's loss and H = w J' V^-1 J, the curvature of that loss is H less this times g g'.

    Less where that would leave the window less than `_LEAST` of H along g: what remains is positive.

    Args:
        gradient: g, of the unknowns of each window.
        hessian: H.
        samples: n.
        degrees: nu.

    Source: derivative of `loss` in the unknowns, d = r' V^-1 r, with r linear in them.
    """
    size = np.sqrt(np.maximum(np.diagonal(hessian, axis1=1, axis2=2), 1e-300))
    scaled = hessian / (size[:, :, None] * size[:, None, :]) + 1e-12 * np.eye(size.shape[1])
    along = np.einsum("ws,ws->w", gradient / size, np.linalg.solve(scaled, (gradient / size)[..., None])[..., 0])
    return np.minimum(2.0 / (degrees + samples), (1.0 - _LEAST) / np.maximum(along, 1e-300))


def log_density(deviation: Windows, samples: Real[np.ndarray, " windows"], degrees: float) -> Windows:
    """Of a window with covariance V = 1: up to half the log-determinant of V and constants that know neither d nor nu."""
    constant = gammaln(0.5 * (degrees + samples)) - gammaln(0.5 * degrees) - 0.5 * samples * np.log(0.5 * degrees)
    return constant - loss(deviation, samples, degrees)


def degrees_of_freedom(deviation: Windows, samples: Real[np.ndarray, " windows"]) -> float:
    """The degrees of freedom of greatest likelihood, at least as many as a window has samples; large where all windows are alike.

    With fewer, a window that is fitted badly counts next to nothing however many there are, and a wrong model passes for a right one with
    outliers.
    """
    counted = samples > 0

    def cost(logarithm: float) -> float:
        return -float(np.sum(log_density(deviation[counted], samples[counted], np.exp(logarithm))))

    limits = np.log(np.median(samples[counted])) if counted.any() else 0.0, np.log(MOST_DEGREES)
    found: Any = minimize_scalar(cost, bounds=limits, method="bounded")
    return float(np.exp(found.x))
