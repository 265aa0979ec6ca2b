"""Errors of the readings: an autoregression for each channel, whitened across knots and gaps of the data.

r_i = sum_j a_j r_(i-j) + s e_i with e white of variance one, r in units of the declared noise.

Source: G. E. P. Box, G. M. Jenkins, Time Series Analysis (1970), ch. 3; J. Durbin, The fitting of time-series models, Rev. Inst. Int.
Stat. 28 (1960) 233-244 (predictors of all orders).
"""

import dataclasses

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_toeplitz, toeplitz

HIGHEST_ORDER = 8
"""Of an autoregression: one that is both quick and slow, as rounding beside an encoder's eccentricity, needs as many at a high rate."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReadingError:
    """A stationary autoregression.

    Attributes:
        coefficients: a_1, a_2, ...; none for white noise.
        innovation: s, over the declared noise.
    """

    coefficients: tuple[float, ...] = ()
    innovation: float = 1.0

    @property
    def order(self) -> int:
        """Count of coefficients."""
        return len(self.coefficients)

    def predictors(self) -> tuple[Float[np.ndarray, "orders lags"], Float[np.ndarray, " orders"]]:
        """Best linear predictors from the last 0, 1, ..., p values: coefficients by order, and standard deviations of their errors.

        Durbin's recursion backwards, from the order p down.
        """
        p = self.order
        table, variance = np.zeros((p + 1, p)), np.zeros(p + 1)
        row, variance[p] = np.array(self.coefficients), self.innovation**2
        for order in range(p, 0, -1):
            table[order, :order] = row
            reflection = row[-1]
            variance[order - 1] = variance[order] / (1.0 - reflection**2)
            row = (row[:-1] + reflection * row[-2::-1]) / (1.0 - reflection**2)
        return table, np.sqrt(variance)

    @classmethod
    def of(cls, free: Float[np.ndarray, " numbers"], largest_pole: float) -> "ReadingError":
        """From unconstrained numbers: log innovation, and inverse hyperbolic tangents of the partial autocorrelations.

        Every choice is stationary, with poles up to `largest_pole`: its powers multiply the coefficients of the partial autocorrelations.
        """
        row = np.zeros(0)
        for reflection in np.tanh(free[1:]):
            row = np.concatenate([row - reflection * row[::-1], [reflection]])
        shrunk = row * largest_pole ** np.arange(1, len(row) + 1)
        return cls(coefficients=tuple(float(a) for a in shrunk), innovation=float(np.exp(free[0])))

    def free(self, largest_pole: float) -> Float[np.ndarray, " numbers"]:
        """The inverse of `of`; poles beyond the limit are drawn in."""
        row, found = np.array(self.coefficients) / largest_pole ** np.arange(1, self.order + 1), np.zeros(self.order)
        for order in range(self.order, 0, -1):
            found[order - 1] = reflection = float(np.clip(row[-1], 1e-6 - 1.0, 1.0 - 1e-6))  # keeps arctanh finite
            row = (row[:-1] + reflection * row[-2::-1]) / (1.0 - reflection**2)
        return np.concatenate([[np.log(self.innovation)], np.arctanh(found)])

    def deviance(self, sums: Float[np.ndarray, "runs lags lags"], counts: Float[np.ndarray, " runs"]) -> float:
        """-2 log likelihood, up to a constant, from sums of r_(i-j) r_(i-l) over samples with 0, 1, ... before them, and their counts."""
        table, std = self.predictors()
        found = 0.0
        for run, (products, count) in enumerate(zip(sums, counts, strict=True)):
            row = np.zeros(len(products))
            used = min(run, self.order)
            row[0], row[1 : used + 1] = 1.0, -table[used, :used]
            found += count * 2.0 * np.log(std[used]) + row @ products @ row / std[used] ** 2
        return float(found)

    @property
    def std(self) -> float:
        """Of the reading error itself, over the declared noise."""
        return float(self.predictors()[1][0])


def run_lengths(counted: np.ndarray, first: np.ndarray, longest: int) -> Int[np.ndarray, "segments samples"]:
    """How many samples in a row count before each sample, within its record and without a gap; at most `longest`.

    Args:
        counted: (segments, samples) bool.
        first: (segments,) bool, the first segment of a record.
        longest: limit.

    Example:
        >>> run_lengths(np.array([[True, True, False, True]]), np.array([True]), 4).tolist()
        [[0, 1, 2, 0]]
    """
    flat = counted.ravel()
    begins = np.zeros(counted.shape, bool)
    begins[first, 0] = True
    places = np.arange(flat.size)
    broken = np.where(~flat, places + 1, 0)  # the run begins behind the last sample that does not count
    broken = np.maximum(broken, np.where(begins.ravel(), places, 0))
    since = np.maximum.accumulate(np.concatenate([[0], broken[:-1]]))
    since = np.maximum(since, np.maximum.accumulate(np.where(begins.ravel(), places, 0)))
    return np.minimum(places - since, longest).reshape(counted.shape)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Whitening:
    """How the residuals of one channel become independent: rows of predictors by sample.

    Attributes:
        lags: coefficient of each earlier sample; (segments, samples, order).
        scale: 1 / standard deviation of the prediction error, 0 where nothing counts; (segments, samples).
    """

    lags: np.ndarray
    scale: np.ndarray

    @property
    def log_determinant(self) -> float:
        """Sum of the logarithms of the variances."""
        return float(-2.0 * np.log(self.scale[self.scale > 0]).sum())

    def applied(self, reach: Float[np.ndarray, "segments reach columns"]) -> Float[np.ndarray, "segments samples columns"]:
        """Whitened values of a segment, from the last `order` ones of the segment before it and its own."""
        segments, samples, order = self.lags.shape
        if not order:
            return reach * self.scale[..., None]
        matrix = np.zeros((segments, samples * (order + samples)))  # by rows; one step right and down is order + samples + 1 places on
        for lag in range(order + 1):
            diagonal = matrix[:, order - lag :: order + samples + 1][:, :samples]
            diagonal[:] = -self.lags[..., lag - 1] * self.scale if lag else self.scale
        return matrix.reshape(segments, samples, -1) @ reach

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Whitened values; (segments, samples, ...)."""
        segments, samples, order = self.lags.shape
        here = values.reshape(segments, samples, -1)
        return self.applied(np.concatenate([tail(here, order), here], axis=1)).reshape(values.shape)


def tail(values: np.ndarray, count: int) -> np.ndarray:
    """The last `count` samples of the segment before each, zeros before those that it has; (segments, count, ...)."""
    found, kept = np.zeros((len(values), count, *values.shape[2:])), min(count, values.shape[1])
    found[1:, count - kept :] = values[:-1, values.shape[1] - kept :]
    return found


def whitening(error: ReadingError, counted: np.ndarray, first: np.ndarray) -> Whitening:
    """Predictors of each sample from as many samples in a row as there are before it, up to the order.

    At the beginning of a record these are the rows of the inverse Cholesky factor of the stationary covariance, so that the likelihood is
    exact; behind a gap they leave the correlation across it out of account.
    """
    table, std = error.predictors()
    runs = run_lengths(counted, first, error.order)
    return Whitening(lags=table[runs], scale=np.where(counted, 1.0 / std[runs], 0.0))


def estimated(
    draws: list[Float[np.ndarray, "segments samples"]],
    counted: np.ndarray,
    first: np.ndarray,
    *,
    largest_pole: float,
    highest: int = HIGHEST_ORDER,
) -> ReadingError:
    """The autoregression of greatest expected likelihood, its order by Schwarz's criterion.

    Args:
        draws: residuals under samples of the posterior of everything else, over the declared noise: an expectation by simulation.
        counted: where a residual counts.
        first: the first segment of each record.
        largest_pole: largest modulus of a pole; below 1.
        highest: order.

    Source: Yule-Walker equations; G. Schwarz, Ann. Stat. 6 (1978) 461-464; G. C. G. Wei, M. A. Tanner, J. Am. Stat. Assoc. 85 (1990)
    699-704 (Monte Carlo EM).
    """
    runs = run_lengths(counted, first, highest).ravel()
    count = int(counted.sum())
    flat = [np.where(counted, one, 0.0).ravel() for one in draws]
    together = [(counted.ravel()) & (runs >= lag) for lag in range(highest + 1)]
    sums = [sum(float(one[lag:][both[lag:]] @ one[: one.size - lag][both[lag:]]) for one in flat) for lag, both in enumerate(together)]
    share = [max(count, 1) / max(int(both.sum()), 1) for both in together]
    covariance = np.array(sums) / (len(draws) * max(count, 1)) * np.minimum(share, 2.0)
    best, lowest = ReadingError(), np.inf
    for order in range(highest + 1):
        a = solve_toeplitz(covariance[:order], covariance[1 : order + 1]) if order else np.zeros(0)
        if order and (pole := np.abs(np.roots(np.r_[1.0, -a])).max()) > largest_pole:
            a = a * (largest_pole / pole) ** np.arange(1, order + 1)
        variance = covariance[0] - 2.0 * a @ covariance[1 : order + 1]
        variance += float(a @ toeplitz(covariance[:order]) @ a) if order else 0.0
        if not variance > 0:
            continue
        criterion = count * np.log(variance) + order * np.log(max(count, 2))
        if criterion < lowest:
            best, lowest = ReadingError(coefficients=tuple(float(one) for one in a), innovation=float(np.sqrt(variance))), criterion
    return best
