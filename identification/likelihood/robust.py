"""Robust likelihood of windows: a multivariate t distribution, in which each window has its own scale."""

from typing import Any

import numpy as np
from jaxtyping import Float, Real
from scipy.optimize import minimize_scalar
from scipy.special import gammaln

Windows = Float[np.ndarray, " windows"]
_LEAST = 0.02
"""Smallest share of the curvature along its gradient that a window keeps."""
MOST_DEGREES = 1e6
"""Degrees of freedom above which the distribution counts as Gaussian."""


def weights(deviation: Windows, samples: Real[np.ndarray, " windows"], degrees: float) -> Windows:
    """Weight of each window under the t distribution, (nu + n) / (nu + d), given r' V^-1 r = d of its n samples; 0 where d is infinite.

    Source: K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, JASA 84 (1989) 881-896.
    """
    return np.where(np.isfinite(deviation), (degrees + samples) / (degrees + np.where(np.isfinite(deviation), deviation, 0.0)), 0.0)


def loss(deviation: Windows, samples: Real[np.ndarray, " windows"], degrees: float) -> Windows:
    """Robust loss (nu + n) / 2 ln(1 + d / nu), which is 0 at d = 0; d / 2 in the limit of many degrees of freedom."""
    return 0.5 * (degrees + samples) * np.log1p(deviation / degrees)


def curvature(
    gradient: Float[np.ndarray, "windows size"],
    hessian: Float[np.ndarray, "windows size size"],
    samples: Real[np.ndarray, " windows"],
    degrees: float,
) -> Windows:
    """Curvature factor 2 / (nu + n) of a window's loss: its Hessian is H less this times g g', g its gradient, H = w J' V^-1 J.

    The factor is smaller where the window would otherwise keep less than `_LEAST` of H along g: the Hessian stays positive.

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
    """Log density of a window with covariance V = 1, up to half the log-determinant of V and constants independent of d and nu."""
    constant = gammaln(0.5 * (degrees + samples)) - gammaln(0.5 * degrees) - 0.5 * samples * np.log(0.5 * degrees)
    return constant - loss(deviation, samples, degrees)


def degrees_of_freedom(deviation: Windows, samples: Real[np.ndarray, " windows"]) -> float:
    """Maximum-likelihood degrees of freedom, at least the median number of samples of a window; large where all windows are alike.

    With fewer, badly fitted windows have hardly any weight, however many there are, and a wrong model passes as a right one with outliers.
    """
    counted = samples > 0

    def cost(logarithm: float) -> float:
        return -float(np.sum(log_density(deviation[counted], samples[counted], np.exp(logarithm))))

    limits = np.log(np.median(samples[counted])) if counted.any() else 0.0, np.log(MOST_DEGREES)
    found: Any = minimize_scalar(cost, bounds=limits, method="bounded")
    return float(np.exp(found.x))
