"""Whitening of residuals and their derivatives by the full covariance of noise and random force."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from identification.likelihood.joint import Point
from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import over_noise
from identification.likelihood.noise import Autoregression


@dataclasses.dataclass(frozen=True, kw_only=True)
class Metric:
    """Whitening x -> w^(1/2) V^(-1/2) x of every window, with V = R + Z S Z' its covariance and w its weight.

    After R^(-1/2) the covariance is 1 + B B' with B B' = U diag(d^2) U', so that V^(-1/2) = 1 - U diag(1 - 1 / sqrt(1 + d^2)) U'.

    Attributes:
        at: the windows.
        noise: by channel.
        turned: B times the eigenvectors of B' B; (windows, samples of all channels, knots).
        shrink: (1 - 1 / sqrt(1 + d^2)) / d^2; (windows, knots).
        root_weight: (windows,).
    """

    at: Linearised
    noise: Mapping[str, Autoregression]
    turned: np.ndarray
    shrink: np.ndarray
    root_weight: np.ndarray

    def __call__(self, values: Float[np.ndarray, "windows *rows time channels"]) -> Float[np.ndarray, "windows *rows time channels"]:
        """Whitened rows; zero where samples do not count."""
        white = over_noise(values, self.at, self.noise)
        flat = white.reshape(len(white), -1, white.shape[-2] * white.shape[-1])
        along = (flat @ self.turned) * self.shrink[:, None]
        flat = flat - along @ self.turned.transpose(0, 2, 1)
        return np.moveaxis((flat * self.root_weight[:, None, None]).reshape(white.shape), -2, -1)


def metric(point: Point) -> Metric:
    """Whitening of the likelihood at a point of the fit."""
    at, root = point.at, point.variances.root
    values, vectors = np.linalg.eigh(root.T @ point.inner.force @ root)
    size = np.maximum(values, 1e-12 * np.maximum(values[:, -1:], 1e-300))
    return Metric(
        at=at,
        noise=point.variances.noise,
        turned=point.answer.transpose(0, 2, 1) @ (root @ vectors),
        shrink=(1.0 - 1.0 / np.sqrt(1.0 + size)) / size,
        root_weight=np.sqrt(point.weight * at.finite),
    )


def in_metric(at: Linearised, by: Metric) -> Linearised:
    """Windows with whitened residual and Jacobian."""
    return dataclasses.replace(at, residual=by(at.residual), jacobian=by(at.jacobian))
