"""Linear regression that a minority of outliers hardly moves, as normal equations that can be added up."""

import dataclasses

import numpy as np
from jaxtyping import Float

_ITERATIONS = 12
_NOISELESS = 1e-12
"""Smallest residual, over the size of the right-hand side: rounding."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Regression:
    """Normal equations in units of the noise: information H of the unknowns, and H times their estimate."""

    information: Float[np.ndarray, "unknowns unknowns"]
    score: Float[np.ndarray, " unknowns"]

    @classmethod
    def nothing(cls, unknowns: int) -> "Regression":
        """No equation."""
        return cls(information=np.zeros((unknowns, unknowns)), score=np.zeros(unknowns))

    @property
    def covariance(self) -> Float[np.ndarray, "unknowns unknowns"]:
        """Of the estimate; directions without information are left out."""
        size = np.sqrt(np.maximum(np.diag(self.information), 0.0))
        size = np.where(size > 0.0, size, 1.0)
        return np.linalg.pinv(self.information / np.outer(size, size), hermitian=True) / np.outer(size, size)

    @property
    def estimate(self) -> Float[np.ndarray, " unknowns"]:
        """Least-squares estimate."""
        return self.covariance @ self.score

    def stderr(self, index: int) -> float:
        """Standard error of one unknown; infinite where nothing shows it."""
        return float(np.sqrt(self.covariance[index, index])) if self.information[index, index] > 0.0 else np.inf

    def __add__(self, other: "Regression") -> "Regression":
        """Both together, from independent equations."""
        return Regression(information=self.information + other.information, score=self.score + other.score)

    def padded(self, own: int) -> "Regression":
        """The same with so many more unknowns, of which it knows nothing."""
        return Regression(information=np.pad(self.information, (0, own)), score=np.pad(self.score, (0, own)))

    def without(self, own: int) -> "Regression":
        """The first unknowns alone: the last `own` are eliminated."""
        count = len(self.score) - own
        rest = Regression(information=self.information[count:, count:], score=self.score[count:])
        coupling = self.information[:count, count:]
        return Regression(
            information=self.information[:count, :count] - coupling @ rest.covariance @ coupling.T,
            score=self.score[:count] - coupling @ rest.estimate,
        )


def robust_regression(matrix: Float[np.ndarray, "equations unknowns"], right: Float[np.ndarray, " equations"]) -> Regression:
    """Regression of `right` on `matrix` by iteratively reweighted least squares with Cauchy's loss.

    The noise is the median absolute residual, which outliers leave alone while they are fewer than half.
    """
    if not right.any():
        return Regression.nothing(matrix.shape[1])
    floor = _NOISELESS * float(np.sqrt(np.mean(right**2))) + 1e-300
    weight = np.ones(len(right))
    for _ in range(_ITERATIONS):
        weighted = matrix * weight[:, None]
        plain = Regression(information=weighted.T @ matrix, score=weighted.T @ right)
        residual = matrix @ plain.estimate - right
        noise = max(1.4826 * float(np.median(np.abs(residual))), floor)
        weight = 1.0 / (1.0 + (residual / noise) ** 2)
    return Regression(information=plain.information / noise**2, score=plain.score / noise**2)
