"""Random force on the hammer (process noise): a Gaussian process with exponential autocorrelation, given at knots."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float, Int

from identification.likelihood.linearised import Linearised
from identification.likelihood.noise import Autoregression
from identification.likelihood.response import force_responses, passing_forces, state_responses

KNOTS_PER_PERIOD = 28
"""Knots per period of the fastest vibration of the rig."""
MOST_KNOTS = 80
"""Largest number of knots in a window."""
_LEAST_SAMPLES = 4
"""Fewest samples from one knot to the next."""
_AT_ONCE = 2**18
"""Samples about knots that are processed together: some hundred megabytes."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RandomForce:
    """Stationary Gaussian process with covariance std^2 exp(-|t - t'| / memory) (Ornstein-Uhlenbeck, Matern 1/2), linear between knots.

    Attributes:
        std: root mean square, N.
        memory: correlation time, s; the power falls to half at the corner 1 / (2 pi memory), Hz.

    Source: G. E. Uhlenbeck, L. S. Ornstein, Phys. Rev. 36 (1930) 823-841; M. L. Stein, Interpolation of Spatial Data (1999).
    """

    std: float
    memory: float

    def root(self, knots: Float[np.ndarray, " knots"]) -> Float[np.ndarray, "knots knots"]:
        """Lower triangular root of the covariance at the knots, N.

        For an Ornstein-Uhlenbeck process: f_1 = std e_1, f_(k+1) = c_k f_k + std sqrt(1 - c_k^2) e_(k+1), c = exp(-dt / memory).
        """
        steps = np.exp(-np.diff(knots) / self.memory)
        found = np.zeros((len(knots), len(knots)))
        found[0, 0] = self.std
        for k, c in enumerate(steps):
            found[k + 1] = c * found[k]
            found[k + 1, k + 1] = self.std * np.sqrt(1.0 - c**2)
        return found


def knots(ts: Float[np.ndarray, "windows time"], lengths: Int[np.ndarray, " windows"], fastest_hz: float) -> Float[np.ndarray, " knots"]:
    """Knots of the random force, s from the start of a window, the same in all windows; at samples where all are sampled alike.

    Args:
        ts: times of all windows, s, padded.
        lengths: counts of their samples.
        fastest_hz: highest of natural and excitation frequencies.
    """
    dt = float(np.median(np.diff(ts[:, :2], axis=1)))
    last = np.take_along_axis(ts, lengths[:, None] - 1, axis=1)[:, 0]
    span = float((last - ts[:, 0]).max())
    spacing = 1.0 / (KNOTS_PER_PERIOD * fastest_hz) if fastest_hz > 0 else 0.0
    spacing = max(spacing, _LEAST_SAMPLES * dt, span / (MOST_KNOTS - 1))
    spacing = dt * np.ceil(spacing / dt * (1.0 - 1e-12))
    return spacing * np.arange(int(np.ceil(span / spacing * (1.0 - 1e-12))) + 1)


def hats(at: Linearised, places: Float[np.ndarray, " knots"], chosen: slice = slice(None)) -> Float[np.ndarray, "windows chosen time"]:
    """Forces of 1 N at each of some knots, falling linearly to 0 at the next ones."""
    since, spacing = at.ts - at.ts[:, :1], places[1] - places[0]
    return np.clip(1.0 - np.abs(since[:, None] - places[chosen][:, None]) / spacing, 0.0, None)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ForceResponse:
    """First-order response Z of the residuals to 1 N at each knot (`hats`), whitened by the noise.

    Once the force at a knot has acted, the motion is that of another initial state. So Z is kept sample by sample up to there, and by that
    state afterwards: where all windows are sampled alike and none sticks, memory grows with the number of samples, not with samples times
    knots.

    Attributes:
        near: while the force acts; (windows, knots, width, channels), zero from `last` on.
        first: sample of the window at which that begins; (windows, knots).
        last: sample from which the response is that of the state; (windows, knots).
        state: change of the initial state with the same later motion; (windows, knots, states).
        by_state: whitened response to each initial value; (windows, states, channels, time). No states: Z is kept as a whole in `near`.
    """

    near: np.ndarray
    first: np.ndarray
    last: np.ndarray
    state: np.ndarray
    by_state: np.ndarray

    @classmethod
    def whole(cls, values: Float[np.ndarray, "windows knots channels time"]) -> "ForceResponse":
        """All of Z, sample by sample."""
        windows, knots, channels, time = values.shape
        begin, none = np.zeros((windows, knots), int), np.zeros((windows, 0, channels, time))
        near = np.ascontiguousarray(values.transpose(0, 1, 3, 2))
        return cls(near=near, first=begin, last=begin + time, state=np.zeros((windows, knots, 0)), by_state=none)

    def __getitem__(self, chosen: np.ndarray) -> "ForceResponse":
        """Some of the windows."""
        return ForceResponse(**{field.name: getattr(self, field.name)[chosen] for field in dataclasses.fields(self)})

    @property
    def dense(self) -> Float[np.ndarray, "windows knots channels time"]:
        """All of Z, sample by sample."""
        width, time = self.near.shape[2], np.arange(self.by_state.shape[-1])
        since = time - self.first[..., None]
        near = np.take_along_axis(self.near, np.clip(since, 0, width - 1)[..., None], axis=2)
        near = np.where(((since >= 0) & (since < width))[..., None], near, 0.0)
        later = np.einsum("lks,lsct->lkct", self.state, self.by_state)
        return near.transpose(0, 1, 3, 2) + np.where((time >= self.last[..., None])[:, :, None], later, 0.0)

    def products(self, rows: Float[np.ndarray, "windows rows channels time"]) -> Float[np.ndarray, "windows knots rows"]:
        """Inner product of each knot's response with each of several whitened rows."""
        if self.is_whole:
            return np.asarray(_flat(self.near) @ rows.transpose(0, 3, 2, 1).reshape(len(rows), -1, rows.shape[1]))
        later = _suffix_sums(np.einsum("lsct,lrct->lsrt", self.by_state, rows), self.last)
        return self._near_products(rows) + np.einsum("lks,lksr->lkr", self.state, later)

    @property
    def is_whole(self) -> bool:
        """Whether all of Z is in `near`."""
        return self.by_state.shape[1] == 0

    @property
    def gram(self) -> Float[np.ndarray, "windows knots knots"]:
        """Inner product of each knot's response with that of each other.

        For knots k <= m it is that over the samples where m acts, and c_k' S c_m later, with c their states and S the products of
        `by_state`. Where k does not act any more when m begins, its response is that of its state there as well. In a window that diverges
        the terms of c_k' S c_m cancel: the diagonal is larger by their rounding, so that the matrix stays positive semi-definite.
        """
        if self.is_whole:
            flat = _flat(self.near)
            return np.asarray(flat @ flat.transpose(0, 2, 1))
        knots, width = self.near.shape[1:3]
        later = _suffix_sums(np.einsum("lsct,lrct->lsrt", self.by_state, self.by_state), self.last)
        after = np.einsum("lksr,lkr->lks", later, self.state)
        found = self.state @ (self._near_products(self.by_state) + after).transpose(0, 2, 1)
        lane, at = np.arange(len(self.near))[:, None, None], self.first[..., None] + np.arange(width)
        by_state = self.by_state.transpose(0, 3, 2, 1)[lane, np.minimum(at, self.by_state.shape[-1] - 1)]
        together = int(np.max(np.sum(self.first[:, None] < self.last[..., None], axis=-1) - np.arange(knots), initial=1))
        for apart in range(min(together, knots)):
            k, m = slice(0, knots - apart), slice(apart, knots)
            since = at[:, m] - self.first[:, k, None]
            earlier = self.near[lane, np.arange(knots - apart)[:, None], np.minimum(since, width - 1)]
            passed = (by_state[:, m] @ self.state[:, k, None, :, None])[..., 0]
            seen = np.where((at[:, m] < self.last[:, k, None])[..., None], earlier, passed)
            exact = np.einsum("lkwc,lkwc->lk", self.near[:, m], seen) + np.einsum("lks,lks->lk", self.state[:, k], after[:, m])
            found[:, np.arange(knots - apart), np.arange(apart, knots)] = exact
        terms = np.sum(np.abs(self.state) * np.sqrt(np.einsum("lkss->lks", later)), axis=-1) ** 2
        rounding = knots * np.finfo(float).eps * terms[..., None] * np.eye(knots)
        return np.triu(found) + np.triu(found, 1).transpose(0, 2, 1) + rounding

    def _near_products(self, rows: Float[np.ndarray, "windows rows channels time"]) -> Float[np.ndarray, "windows knots rows"]:
        """The part of `products` from the samples where each knot acts; window by window, which fits the processor's cache."""
        windows, count, _, time = rows.shape
        knots, found = self.near.shape[1], np.empty((windows, self.near.shape[1], count))
        samples = np.minimum(self.first[..., None] + np.arange(self.near.shape[2]), time - 1)
        for window in range(windows):
            there = np.ascontiguousarray(rows[window].T)[samples[window]].reshape(knots, -1, count)
            found[window] = (self.near[window].reshape(knots, 1, -1) @ there)[:, 0]
        return found


def force_response(at: Linearised, mass: float, places: Float[np.ndarray, " knots"], noise: Mapping[str, Autoregression]) -> ForceResponse:
    """Response of the residuals to the random force at its knots.

    Args:
        at: all windows.
        mass: of the hammer, kg.
        places: knots from the start of a window, s.
        noise: by channel.
    """
    if len(at.forgetful[0]):  # what acts later does not follow from the initial state
        parts = (at.over_noise(force_responses(at, mass, hats(at, places, slice(k, k + 1))), noise) for k in range(len(places)))
        return ForceResponse.whole(np.concatenate(list(parts), axis=1))
    since, time, spacing = at.ts - at.ts[:, :1], at.ts.shape[1], places[1] - places[0]
    first = np.stack([np.searchsorted(one, places - spacing) for one in since])
    last = np.stack([np.searchsorted(one, places + spacing) for one in since]) + max(one.order for one in noise.values())
    first, last = np.clip(first - 1, 0, time - 1), np.minimum(last, time)
    widths = (last - first).max(axis=1) + 1  # the state takes in the step that ends at `last`
    width = int(widths.max())
    near = np.zeros((*first.shape, width, len(at.channels)))
    state = np.zeros((*first.shape, at.fundamental.shape[-1]))
    order = np.argsort(widths, kind="stable")
    while len(order):
        some = order[: max(1, int(_AT_ONCE / (len(places) * widths[order[0]])))]
        samples = np.minimum(first[some][..., None] + np.arange(int(widths[some].max())), time - 1)
        away = np.abs(np.take_along_axis(since[some], samples.reshape(len(some), -1), axis=1).reshape(samples.shape) - places[:, None])
        acting = np.clip(1.0 - away / spacing, 0.0, None)
        pieces = at.pieces(some, samples)
        residual, left = passing_forces(pieces, mass, acting.reshape(-1, 1, acting.shape[-1]))
        near[some, :, : samples.shape[-1]] = pieces.over_noise(residual, noise)[:, 0].transpose(0, 2, 1).reshape(*samples.shape, -1)
        state[some] = left.reshape(*acting.shape[:2], -1)
        order = order[len(some) :]
    acts = first[..., None] + np.arange(width) < last[..., None]
    return ForceResponse(
        near=near * acts[..., None],
        first=first,
        last=last,
        state=state,
        by_state=at.over_noise(state_responses(at, mass), noise),
    )


def _flat(values: Float[np.ndarray, "windows rows time channels"]) -> Float[np.ndarray, "windows rows samples"]:
    return values.reshape(*values.shape[:2], -1)


def _suffix_sums(values: Float[np.ndarray, "windows i j time"], begin: Int[np.ndarray, "windows knots"]) -> np.ndarray:
    """Sums from a sample on, for each of several; (windows, knots, i, j)."""
    sums = np.cumsum(values[..., ::-1], axis=-1)[..., ::-1]
    sums = np.concatenate([sums, np.zeros((*values.shape[:-1], 1))], axis=-1)
    return np.take_along_axis(sums, begin[:, None, None], axis=-1).transpose(0, 3, 1, 2)
