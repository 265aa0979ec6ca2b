"""Inner products of residuals and their derivatives by the full covariance of noise and random force."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from identification.likelihood.joint import Point
from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import over_noise
from identification.likelihood.noise import Autoregression


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rows:
    """Rows x of every window, prepared for the inner product w x' V^-1 y, with w the window's weight and V = R + Z S Z' its covariance.

    Attributes:
        white: w^(1/2) R^(-1/2) x; (windows, rows, samples).
        along: its coordinates b along the random force, so that the product is white . white - along . along; (windows, rows, knots).
    """

    white: np.ndarray
    along: np.ndarray

    def __getitem__(self, index: slice) -> "Rows":
        """Some of the rows."""
        return Rows(white=self.white[:, index], along=self.along[:, index])

    def of(self, chosen: np.ndarray) -> "Rows":
        """The same rows, zero in all windows but those chosen, (windows,)."""
        return Rows(white=self.white * chosen[:, None, None], along=self.along * chosen[:, None, None])

    def inner(self, other: "Rows") -> Float[np.ndarray, "windows rows others"]:
        """Inner product of each row with each row of another set, by window."""
        found = self.white @ other.white.transpose(0, 2, 1)
        found -= self.along @ other.along.transpose(0, 2, 1)
        return found

    def total(self, other: "Rows") -> float:
        """Sum of the inner products of equal rows over all windows."""
        return float(np.vdot(self.white, other.white)) - float(np.vdot(self.along, other.along))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Metric:
    """Inner product of the likelihood at a point of the fit.

    After R^(-1/2) the covariance is 1 + B B' with B the whitened response Z times a root of S. With B' B = U diag(d^2) U', the coordinates
    along the force are b = diag(1 + d^2)^(-1/2) U' B' x (Woodbury).

    Attributes:
        at: the windows.
        noise: by channel.
        turned: B U diag(1 + d^2)^(-1/2); (windows, samples of all channels, knots).
        root_weight: w^(1/2); (windows,).
    """

    at: Linearised
    noise: Mapping[str, Autoregression]
    turned: np.ndarray
    root_weight: np.ndarray

    def __call__(self, values: Float[np.ndarray, "windows rows time channels"]) -> Rows:
        """The rows in this metric; samples that do not count are left out."""
        white = over_noise(values, self.at, self.noise)
        white *= self.root_weight[:, None, None, None]
        white = white.reshape(*white.shape[:2], -1)
        return Rows(white=white, along=white @ self.turned)


def metric(point: Point) -> Metric:
    """Inner product of the likelihood at a point of the fit."""
    at, root = point.at, point.variances.root
    values, vectors = np.linalg.eigh(root.T @ point.inner.force @ root)
    return Metric(
        at=at,
        noise=point.variances.noise,
        turned=point.answer.transpose(0, 2, 1) @ (root @ vectors / np.sqrt(1.0 + np.maximum(values, 0.0))[:, None]),
        root_weight=np.sqrt(point.weight * at.finite),
    )
