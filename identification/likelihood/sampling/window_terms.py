"""What the density needs of every window beside its records: whitening, random force, and where its states go with the parameters."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from identification.likelihood.fitted import Fitted
from identification.likelihood.noise import Autoregression, runs
from identification.windows.windows import Hosted, Windows

_NEGLIGIBLE = 1e-6
"""Share of the random force in the variance along a component of its response below which the component is left out."""


class WindowTerms(eqx.Module):
    """Windows of one group in chunks: the first axis is the chunk, the second the window; without the first, one chunk."""

    windows: Windows
    counted: Hosted
    """False for a repetition that fills up a chunk, and for a window that the fit could not integrate."""
    whitening: Hosted
    """Weights of a sample and of those before it in the whitened one, 1; (..., lag, time, channels)."""
    projection: Hosted
    """Whitened response to the random force, such that gram = R R' - (R P')(R P')'; (..., components, time, channels)."""
    components: Hosted
    """Weights of the force at its knots, 1/N, in P; (..., components, knots)."""
    samples: Hosted
    """Number of samples that count."""
    mode: Hosted
    """Vector of every window at the mode of the fit."""
    follow: Hosted
    """First-order change of the states' optimum with all else; (..., states, other)."""
    force: Hosted
    """Random force at its knots at the mode, N; (..., knots)."""
    force_follow: Hosted
    """First-order change of the force's optimum with the vector of the window; (..., knots, size)."""

    def force_at(self, vector: Float[Array, "lanes size"]) -> Float[Array, "lanes knots"]:
        """Optimum of the random force, N, to first order."""
        return self.force + jnp.einsum("lks,ls->lk", self.force_follow, vector - self.mode)

    def gram(self, rows: Float[Array, "lanes rows time channels"], force: Float[Array, "lanes knots"]) -> Float[Array, "lanes rows rows"]:
        """Products of residual (first row), less the effect of the force, and Jacobian in the metric of noise and random force."""
        white = jnp.zeros_like(rows)
        for lag in range(self.whitening.shape[1]):
            shifted = jnp.pad(rows, ((0, 0), (0, 0), (lag, 0), (0, 0)))[:, :, : rows.shape[2]]
            white = white + self.whitening[:, None, lag] * shifted
        flat = white.reshape(*white.shape[:2], -1)
        projection = self.projection.reshape(*self.projection.shape[:2], flat.shape[-1])
        flat = flat.at[:, 0].add(-jnp.einsum("lmk,lk,lmt->lt", self.components, force, projection))
        forced = jnp.einsum("lrt,lkt->lrk", flat, projection)
        return jnp.einsum("lit,ljt->lij", flat, flat) - jnp.einsum("lik,ljk->lij", forced, forced)


def window_terms(of: Fitted, groups: tuple[Windows, ...], size: int) -> tuple[WindowTerms, ...]:
    """Terms of the windows of a fit, group by group, in chunks of `size`.

    Args:
        of: the fit.
        groups: its windows, under the estimated random force.
        size: windows that are integrated side by side.
    """
    found, begin = [], 0
    for group in groups:
        lanes = np.arange(begin, begin + len(group.record))
        begin += len(lanes)
        whole = _of_group(of, group, lanes)
        order = np.argsort(group.lengths, kind="stable")
        count = -(-len(order) // size)
        places = np.resize(order, count * size)
        is_new = np.arange(count * size) < len(order)
        parts = jax.tree.map(lambda leaf, places=places, count=count: leaf[places].reshape(count, size, *leaf.shape[1:]), whole)
        parts = eqx.tree_at(lambda one: one.counted, parts, parts.counted & is_new.reshape(count, size))
        found.append(jax.tree.map(jnp.asarray, parts))
    return tuple(found)


def _of_group(of: Fitted, group: Windows, lanes: np.ndarray) -> WindowTerms:
    """Terms of one group, (windows, ...), as NumPy arrays."""
    at, layout, variances = of.point.at, of.prepared.layout, of.variances
    samples, columns = group.weight.shape[1], [at.channels.index(name) for name in group.channels]
    length = runs((group.weight > 0).transpose(0, 2, 1)).transpose(0, 2, 1)
    noises = [variances.noise[name] for name in group.channels]
    lags = 1 + max(noise.order for noise in noises)
    whitening = np.stack([_weights(noise, length[..., c], lags) for c, noise in enumerate(noises)], axis=-1)
    answer = of.point.answer[lanes].dense[:, :, columns].transpose(0, 1, 3, 2)
    answer = np.pad(answer, [(0, 0), (0, 0), (0, samples - answer.shape[2]), (0, 0)])
    marginal = of.point.marginal
    flat = answer.reshape(*answer.shape[:2], -1)
    factor = marginal.factor[lanes]
    projection = np.linalg.solve(factor, marginal.root.T @ flat)
    axes = principal_axes(projection)
    inverse, coupling = (part[lanes] for part in of.posterior.reduced.eliminated)
    conditional = marginal.root @ np.linalg.inv(factor).transpose(0, 2, 1)
    return WindowTerms(
        windows=group,
        counted=at.finite[lanes],
        whitening=whitening,
        projection=(axes.transpose(0, 2, 1) @ projection).reshape(len(lanes), -1, *answer.shape[2:]),
        components=(factor @ axes).transpose(0, 2, 1) @ np.linalg.inv(marginal.root),
        samples=(group.weight > 0).sum(axis=(1, 2)).astype(float),
        mode=of.estimate.local(of.prepared.record)[lanes][:, : layout.size],
        follow=-inverse @ coupling,
        force=of.estimate.force[lanes],
        force_follow=-conditional @ (conditional.transpose(0, 2, 1) @ of.point.inner.cross[lanes, :, 1:]),
    )


def principal_axes(projection: Float[np.ndarray, "windows knots samples"]) -> Float[np.ndarray, "windows knots components"]:
    """Principal axes of the response to the random force: as many as matter in any of the windows."""
    shares, axes = np.linalg.eigh(projection @ projection.transpose(0, 2, 1))
    kept = int((shares > _NEGLIGIBLE).sum(axis=1).max(initial=0))
    return axes[:, :, shares.shape[1] - kept :]


def _weights(noise: Autoregression, run: np.ndarray, lags: int) -> np.ndarray:
    """(windows, lags, time) weights with which a sample and those before it make the whitened one."""
    order = np.clip(run - 1, 0, noise.order)
    found = np.zeros((len(run), lags, run.shape[1]))
    found[:, 0] = (run > 0) / noise.innovation[order]
    for lag in range(1, noise.order + 1):
        found[:, lag] = np.where(run > lag, -noise.coefficients[order, lag - 1] / noise.innovation[order], 0.0)
    return found
