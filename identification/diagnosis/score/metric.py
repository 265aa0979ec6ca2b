"""Inner products of residuals and their derivatives by the full covariance of noise and random force."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from identification.likelihood.joint import Point
from identification.likelihood.linearised import Linearised
from identification.likelihood.noise import Autoregression
from identification.likelihood.random_force import ForceResponse


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rows:
    """Rows x of every window, prepared for the inner product w x' V^-1 y, with w the window's weight and V = R + Z S Z' its covariance.

    The product is white . white + sign along . along.

    Attributes:
        white: w^(1/2) R^(-1/2) x; (windows, rows, samples). Where `sign` is 1, without its part along the random force.
        along: its coordinates along the random force; (windows, rows, knots).
        sign: (windows,), -1 or 1.
    """

    white: np.ndarray
    along: np.ndarray
    sign: np.ndarray

    def __getitem__(self, index: slice) -> "Rows":
        """Some of the rows."""
        return dataclasses.replace(self, white=self.white[:, index], along=self.along[:, index])

    def restricted_to(self, chosen: Bool[np.ndarray, " windows"]) -> "Rows":
        """The same rows, zero in all windows but those chosen."""
        return dataclasses.replace(self, white=self.white * chosen[:, None, None], along=self.along * chosen[:, None, None])

    def inner(self, other: "Rows") -> Float[np.ndarray, "windows rows others"]:
        """Inner product of each row with each row of another set, by window."""
        found = self.white @ other.white.transpose(0, 2, 1)
        found += self.sign[:, None, None] * (self.along @ other.along.transpose(0, 2, 1))
        return found

    def total(self, other: "Rows") -> float:
        """Sum of the inner products of equal rows over all windows."""
        return float(np.vdot(self.white, other.white)) + float(np.vdot(self.along * self.sign[:, None, None], other.along))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Metric:
    """Inner product of the likelihood at a point of the fit.

    After R^(-1/2) the covariance is 1 + B B' with B the whitened response Z times a root of S. With B' B = U diag(d^2) U', the coordinates
    along the force are b = diag(1 + d^2)^(-1/2) U' B' x, and x' V^-1 x = x' x - b' b (Woodbury). Where d^2 is so large that this difference
    would lose half of the digits, x is split by an orthonormal basis Q of the columns of B = Q T: x' V^-1 x = |x - Q Q' x|^2 + |b|^2 with
    b = (1 + T T')^(-1/2) Q' x.

    Attributes:
        at: the windows.
        noise: by channel.
        answer: R^(-1/2) Z.
        turned: from (R^(-1/2) Z)' R^(-1/2) x to b, in the windows of `split` from Q' R^(-1/2) x; (windows, knots, knots).
        split: indices of the windows in which x is split.
        basis: Q in these; (split, samples of all channels, knots).
        root_weight: w^(1/2); (windows,).
    """

    at: Linearised
    noise: Mapping[str, Autoregression]
    answer: ForceResponse
    turned: np.ndarray
    split: np.ndarray
    basis: np.ndarray
    root_weight: np.ndarray

    def __call__(self, values: Float[np.ndarray, "windows rows time channels"]) -> Rows:
        """The rows in this metric; samples that do not count are left out."""
        white = self.at.over_noise(values, self.noise)
        white *= self.root_weight[:, None, None, None]
        shown, sign = self.answer.products(white).transpose(0, 2, 1), np.full(len(white), -1.0)
        white = white.reshape(*white.shape[:2], -1)
        if len(self.split):
            sign[self.split] = 1.0
            shown[self.split] = white[self.split] @ self.basis
            white[self.split] -= shown[self.split] @ self.basis.transpose(0, 2, 1)
        along = shown @ self.turned
        return Rows(white=white, along=along, sign=sign)


def metric(point: Point) -> Metric:
    """Inner product of the likelihood at a point of the fit."""
    at, root = point.at, point.variances.root
    values, vectors = np.linalg.eigh(root.T @ point.inner.force @ root)
    turned = root @ vectors / np.sqrt(1.0 + np.maximum(values, 0.0))[:, None]
    split = np.flatnonzero(at.finite & (values[:, -1] > np.finfo(float).eps ** -0.5))  # the difference would lose half of the digits
    dense = point.answer[split].dense
    flat = dense.reshape(*dense.shape[:2], dense.shape[2] * dense.shape[3])
    basis, rest = np.linalg.qr(flat.transpose(0, 2, 1) @ root)
    left, size, _ = np.linalg.svd(rest)
    turned[split] = left / np.sqrt(1.0 + size**2)[:, None]
    return Metric(
        at=at,
        noise=point.variances.noise,
        answer=point.answer,
        turned=turned,
        split=split,
        basis=basis,
        root_weight=np.sqrt(point.weight * at.finite),
    )
