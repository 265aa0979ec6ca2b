"""Marginal likelihood of windows with the random force integrated out, from small matrices of inner products."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from identification.likelihood.linearised import Linearised
from identification.likelihood.noise import Autoregression
from identification.likelihood.random_force import ForceResponse


@dataclasses.dataclass(frozen=True, kw_only=True)
class Grams:
    """Inner products of a window's residual r, its Jacobian J and its response Z to the random force, all whitened by the noise.

    Attributes:
        fit: of (r, J) with itself; (windows, 1 + size, 1 + size).
        force: of Z with itself; (windows, knots, knots).
        cross: of Z with (r, J); (windows, knots, 1 + size).
        samples: that count in each window.
        log_scale: of each window, half the log-determinant of the noise's covariance.
    """

    fit: np.ndarray
    force: np.ndarray
    cross: np.ndarray
    samples: np.ndarray
    log_scale: np.ndarray


def grams(at: Linearised, answer: ForceResponse, noise: Mapping[str, Autoregression], force: np.ndarray | None = None) -> Grams:
    """Inner products of r, J and Z in every window.

    Args:
        at: residuals and Jacobian.
        answer: response Z to the random force.
        noise: by channel.
        force: inner product of Z with itself, if available.
    """
    rows = at.over_noise(np.concatenate([at.residual[:, None], at.jacobian], axis=1), noise)
    rows[~at.finite] = 0.0
    flat, finite = rows.reshape(*rows.shape[:2], -1), at.finite[:, None, None]
    return Grams(
        fit=flat @ flat.transpose(0, 2, 1),
        force=np.where(finite, answer.gram if force is None else force, 0.0),
        cross=answer.products(rows),
        samples=(at.runs > 0).sum(axis=(1, 2)) * at.finite,
        log_scale=sum(noise[name].log_scale(at.runs[:, c]) for c, name in enumerate(at.channels)) * at.finite,
    )


def without_force(of: Grams, force: Float[np.ndarray, "windows knots"]) -> Grams:
    """Inner products with r - Z f in place of r."""
    pushed = (of.force @ force[..., None])[..., 0]
    fit, cross = of.fit.copy(), of.cross.copy()
    lowered = np.einsum("lk,lki->li", force, of.cross)
    fit[:, 0, :] -= lowered
    fit[:, :, 0] -= lowered
    fit[:, 0, 0] += np.sum(force * pushed, axis=1)
    cross[:, :, 0] -= pushed
    return dataclasses.replace(of, fit=fit, cross=cross)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Marginal:
    """Marginal windows with covariance V = R + Z S Z'; S is the covariance of the random force at its knots, R that of the noise.

    Attributes:
        gram: (r, J)' V^-1 (r, J); (windows, 1 + size, 1 + size).
        log_determinant: of V over that of R; (windows,).
        root: lower triangular root of S; (knots, knots).
        factor: lower triangular C with C C' = 1 + root' Z' R^-1 Z root, the 1 larger by the rounding of the rest; (windows, knots, knots).

    Source: M. A. Woodbury, Inverting modified matrices (1950); G. K. Robinson, That BLUP is a good thing, Stat. Sci. 6 (1991) 15-32.
    """

    gram: np.ndarray
    log_determinant: np.ndarray
    root: np.ndarray
    factor: np.ndarray

    @property
    def deviation(self) -> Float[np.ndarray, " windows"]:
        """r' V^-1 r of every window."""
        return self.gram[:, 0, 0]


def marginal(of: Grams, root: Float[np.ndarray, "knots knots"]) -> Marginal:
    """Marginal windows by Woodbury's identity; the cost grows with the cube of the number of knots, not of samples."""
    shown = root.T @ of.force @ root
    rounding = len(root) * np.finfo(float).eps * np.trace(shown, axis1=1, axis2=2)  # of a diverging window, more than the unit matrix
    factor = np.linalg.cholesky((1.0 + rounding)[:, None, None] * np.eye(len(root)) + shown)
    taken = np.linalg.solve(factor, root.T @ of.cross)
    return Marginal(
        gram=of.fit - taken.transpose(0, 2, 1) @ taken,
        log_determinant=2.0 * np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1) - len(root) * np.log1p(rounding),
        root=root,
        factor=factor,
    )


def estimated_force(
    of: Grams, by: Marginal, step: Float[np.ndarray, "windows size"]
) -> tuple[Float[np.ndarray, "windows knots"], Float[np.ndarray, "windows knots knots"]]:
    """Best linear prediction of the force at the knots, N, after a step of the unknowns, and a root of its conditional covariance.

    f = -S Z' V^-1 (r + J step); the covariance (S^-1 + Z' R^-1 Z)^-1 does not include that of the unknowns.
    """
    right = of.cross[..., 0] + (of.cross[..., 1:] @ step[..., None])[..., 0]
    root = by.root @ np.linalg.inv(by.factor).transpose(0, 2, 1)
    return -(root @ (root.transpose(0, 2, 1) @ right[..., None]))[..., 0], root
