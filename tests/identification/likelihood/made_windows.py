"""Windows made by hand, and the matrices of the textbook that they stand for: every sample in one vector, every covariance written out."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import grams
from identification.likelihood.noise import Autoregression, autoregression
from identification.likelihood.random_force import ForceResponse, RandomForce

CHANNELS = ("hammer_displacement", "impact_force")
RECORD = np.array([0, 0, 1, 1, 1])
DT = 1e-3
PLACES = 5e-3 * np.arange(8)
"""Knots, s."""
FORCE = RandomForce(std=2.0, memory=0.012)


def autocovariance(coefficients: np.ndarray, innovation: float, lags: int) -> np.ndarray:
    """Of an autoregression at lags 0, 1, ... lags - 1, from its answer to one impulse."""
    impulse = innovation * lfilter([1.0], [1.0, *-coefficients], np.eye(1, 4000)[0])
    return np.array([impulse[lag:] @ impulse[: len(impulse) - lag] for lag in range(lags)])


NOISE = {
    CHANNELS[0]: autoregression(autocovariance(np.array([1.1, -0.3]), 0.4, 3)),
    CHANNELS[1]: autoregression(autocovariance(np.array([0.5, 0.2, -0.3]), 1.3, 4)),
}


def made_windows(size: int, *, channels: tuple[str, ...] = CHANNELS, samples: int = 36, seed: int = 0) -> Linearised:
    """Random residuals and Jacobians of five windows in two records, with breaks in the channels and windows that end early."""
    rng = np.random.default_rng(seed)
    windows, shape = len(RECORD), (len(RECORD), samples, len(channels))
    lengths = samples - np.arange(windows)
    counts = rng.uniform(size=shape) < 0.9
    counts &= np.arange(samples)[:, None] < lengths[:, None, None]
    return blank(
        record=RECORD,
        lengths=lengths,
        ts=DT * np.broadcast_to(np.arange(samples), shape[:2]),
        weight=counts.astype(float),
        channels=channels,
        residual=3.0 * rng.normal(size=shape) * counts,
        jacobian=rng.normal(size=(windows, size, *shape[1:])) * counts[:, None],
        finite=np.ones(windows, bool),
    )


def blank(**given) -> Linearised:
    """Windows of which only this is known; all else is zero."""
    windows, time, _ = given["residual"].shape
    nothing, record = np.zeros((windows, time)), given.get("record", np.zeros(windows, int))
    zero = {
        "record": record,
        "first": np.zeros(windows, int),
        "in_contact": np.zeros((windows, time), bool),
        "own": np.zeros((windows, time, 0)),
        **dict.fromkeys(("fundamental", "cart_by", "flow"), np.zeros((windows, time, 2, 2))),
        **dict.fromkeys(("push_by", "restoring", "kick"), np.zeros((windows, time, 2))),
        **dict.fromkeys(("u", "v", "acceleration", "push", "approach_speed"), nothing),
    }
    return Linearised(**zero | given)


def made_answer(at: Linearised, knots: int = len(PLACES), seed: int = 1) -> np.ndarray:
    """Z of random numbers, (windows, knots, time, channels)."""
    windows, time, channels = at.residual.shape
    return np.random.default_rng(seed).normal(size=(windows, knots, time, channels)) * (at.weight > 0)[:, None]


def made_grams(at: Linearised, answer: np.ndarray, noise: Mapping[str, Autoregression] = NOISE):
    """As the package forms them."""
    return grams(at, ForceResponse.whole(at.over_noise(answer, noise)), noise)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Dense:
    """One window over the samples that count."""

    residual: np.ndarray
    jacobian: np.ndarray
    answer: np.ndarray
    noise: np.ndarray
    """Covariance R of the noise."""

    def covariance(self, force: np.ndarray) -> np.ndarray:
        """V = R + Z S Z', with `force` the covariance S at the knots."""
        return self.noise + self.answer @ force @ self.answer.T

    @property
    def columns(self) -> np.ndarray:
        """(r, J)."""
        return np.column_stack([self.residual, self.jacobian])


def dense(at: Linearised, answer: np.ndarray, noise: Mapping[str, Autoregression] = NOISE) -> list[Dense]:
    """Every window; its noise is Toeplitz in each stretch of a channel and independent between stretches."""
    found = []
    for window in range(len(at.record)):
        counts = at.weight[window] > 0
        blocks = [noise_covariance(noise[name], counts[:, c]) for c, name in enumerate(at.channels)]
        covariance = np.zeros((counts.sum(), counts.sum()))
        begin = 0
        for block in blocks:
            covariance[begin : begin + len(block), begin : begin + len(block)] = block
            begin += len(block)

        def rows(values, counts=counts):
            return np.concatenate([values[..., counts[:, c], c] for c in range(counts.shape[1])], axis=-1).T

        found.append(
            Dense(residual=rows(at.residual[window]), jacobian=rows(at.jacobian[window]), answer=rows(answer[window]), noise=covariance)
        )
    return found


def noise_covariance(noise: Autoregression, valid: np.ndarray) -> np.ndarray:
    """Of the valid samples of one channel: none across a break."""
    stretch = np.cumsum(~valid)[valid]
    covariance = toeplitz(autocovariance(noise.coefficients[-1], float(noise.innovation[-1]), len(valid)))[np.ix_(valid, valid)]
    return np.where(stretch[:, None] == stretch, covariance, 0.0)


def force_covariance(force: RandomForce, places: np.ndarray = PLACES) -> np.ndarray:
    """S, written out."""
    return force.std**2 * np.exp(-np.abs(places[:, None] - places) / force.memory)
