"""Weak form of an equation of motion: integrals over bumps, so that no record is differentiated, and their robust regression."""

import dataclasses
from functools import cache

import numpy as np
from jaxtyping import Bool, Float
from numpy.lib.stride_tricks import sliding_window_view

from identification.experiment.samples import runs_of

_SUPPORTS = (24, 48, 96, 192, 384, 768, 1536)
"""Lengths of the bumps, samples."""


def weak_integrals(
    signals: Float[np.ndarray, "signals samples"], touching: Bool[np.ndarray, " samples"], dt: float
) -> dict[int, Float[np.ndarray, "bumps curves signals"]]:
    """Integrals of every signal times phi'', phi' and phi (in this order) over every bump in every flight, by the length of the bumps.

    phi = (1 - s^2)^4, s from -1 to 1. All are divided by the standard deviation of the integral of unit white noise times phi''.

    Args:
        signals: SI, one row each.
        touching: where the hammer meets the stop.
        dt: time step, s.
    """
    found: dict[int, list[np.ndarray]] = {}
    flights = _flights(touching)
    samples = np.array([stop - start for start, stop in flights], int)
    # of one bump in each flight of a periodic motion all are the same equation, and in a few flights alone it is wrong where these are long
    # since an impact was not seen: flights with several bumps have to make up most of the time in flight
    lengths = [length for length in _SUPPORTS if 2 * int(samples[samples >= 2 * length].sum()) > int(samples.sum())]
    for start, stop in flights:
        for length in (n for n in lengths if n <= stop - start):
            parts = sliding_window_view(signals[:, start:stop], length, axis=1)[:, :: length // 2]
            found.setdefault(length, []).append((parts @ _curves(length, dt)).transpose(1, 2, 0))
    return {length: np.concatenate(parts) for length, parts in found.items()}


@cache
def _curves(length: int, dt: float) -> Float[np.ndarray, "samples curves"]:
    """phi'', phi' and phi of a bump, weighted."""
    half = 0.5 * (length - 1) * dt
    s = np.linspace(-1, 1, length)
    value, slope, curve = (1 - s**2) ** 4, -8 * s * (1 - s**2) ** 3 / half, (56 * s**2 - 8) * (1 - s**2) ** 2 / half**2
    return np.stack([curve, slope, value], axis=1) / np.sqrt(np.sum(curve**2))


def near_contact(touching: Bool[np.ndarray, " samples"]) -> Bool[np.ndarray, " samples"]:
    """Samples in contact or within four of it."""
    return np.convolve(touching, np.ones(9), "same") > 0


def _flights(touching: Bool[np.ndarray, " samples"]) -> list[tuple[int, int]]:
    """Stretches of flight, a few samples clear of contact: (first, one past the last)."""
    return [(int(first), int(end)) for first, end in zip(*runs_of(~near_contact(touching)), strict=True)]


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
        """The same with so many more unknowns, that it does not determine."""
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
    floor = 1e-12 * float(np.sqrt(np.mean(right**2))) + 1e-300  # rounding
    weight = np.ones(len(right))
    for _ in range(12):
        weighted = matrix * weight[:, None]
        plain = Regression(information=weighted.T @ matrix, score=weighted.T @ right)
        residual = matrix @ plain.estimate - right
        noise = max(1.4826 * float(np.median(np.abs(residual))), floor)
        weight = 1.0 / (1.0 + (residual / noise) ** 2)
    return Regression(information=plain.information / noise**2, score=plain.score / noise**2)
