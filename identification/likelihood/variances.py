"""What the likelihood supposes of noise and random force, and its estimation by restricted maximum likelihood."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from scipy.ndimage import maximum_filter1d
from scipy.optimize import minimize

from identification.least_squares import block_arrow
from identification.least_squares.block_arrow import Equations
from identification.least_squares.fit import with_prior
from identification.likelihood import noise as sensor
from identification.likelihood import robust
from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import Grams, Marginal, estimated_force, marginal
from identification.likelihood.noise import Autoregression
from identification.likelihood.random_force import RandomForce
from identification.windows.layout import Active, Estimate, Layout

_EVALUATIONS = 24
_OF_THE_VIBRATION = 4.0
"""Frequency over that of the fastest vibration of the rig from which on residuals may be noise alone."""
_NOTHING = 1e-4
"""Expected squares of all residuals of a window by a force that is none, over their noise."""
_FAR_WORSE = 3.0
"""Median weight over that of a window from which it does not count in the size of the force: it has settled wrongly."""
_SIZES, _MEMORIES = (-2.5, 0.0, 2.5), 4
"""Of a coarse grid: logarithms of sizes over that at the start, and count of memories."""
_LONGEST_MEMORY = 2.0
"""Of the force, over the longest window: slower ones are constants."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variances:
    """Noise and random force.

    Attributes:
        noise: by channel, in units of what was declared or read off the record.
        force: of most windows.
        places: of its knots from the begin of a window, s.
        weight: precision of each window over that of all; (windows,).
        degrees: of freedom of the t distribution of the windows.
    """

    noise: Mapping[str, Autoregression]
    force: RandomForce
    places: np.ndarray
    weight: np.ndarray
    degrees: float

    @property
    def root(self) -> Float[np.ndarray, "knots knots"]:
        """Lower triangular root of the covariance of the force at its knots, N."""
        return self.force.root(self.places)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Linear:
    """The model of all windows to first order: r + J step + Z f, with r the residual where the force is zero.

    Attributes:
        layout: of a window's vector.
        estimate: where it is linearised.
        active: what is estimated.
        at: windows, with r and J.
    """

    layout: Layout
    estimate: Estimate
    active: Active
    at: Linearised


@dataclasses.dataclass(frozen=True, kw_only=True)
class Posterior:
    """What the linear model and its variances say.

    Attributes:
        marginal: windows, their force integrated out.
        equations: their normal equations, weighted, with priors.
        reduced: the same with the windows' states eliminated.
        step: mode of every window's vector less where it is linearised; (windows, size).
        force: mode of the force at its knots, N; (windows, knots).
    """

    marginal: Marginal
    equations: Equations
    reduced: block_arrow.Reduced
    step: np.ndarray
    force: np.ndarray

    def deviation(self) -> Float[np.ndarray, " windows"]:
        """r' V^-1 r of every window at the mode."""
        moved = np.concatenate([np.ones((len(self.step), 1)), self.step], axis=1)
        return np.einsum("li,lij,lj->l", moved, self.marginal.gram, moved)


def equations(
    of: Linear, by: Marginal, weight: Float[np.ndarray, " windows"], bend: Float[np.ndarray, " windows"] | None = None
) -> Equations:
    """Normal equations of the windows in the metric of the whole likelihood; `bend` is that of `robust.bend`, for Newton's."""
    gradient = by.gram[:, 1:, 0] * weight[:, None]
    hessian = by.gram[:, 1:, 1:] * weight[:, None, None]
    if bend is not None:
        hessian -= bend[:, None, None] * gradient[:, :, None] * gradient[:, None, :]
    plain = Equations(hessian=hessian, gradient=gradient, cost=0.5 * by.gram[:, 0, 0] * weight, record=of.at.record)
    return with_prior(plain, of.layout, of.estimate)


def posterior(of: Linear, inner: Grams, variances: Variances) -> Posterior:
    """Mode of everything in the linear model, given the variances."""
    by, weight = marginal(inner, variances.root), variances.weight * of.at.finite
    found = equations(of, by, weight)
    reduced = block_arrow.reduce(found, of.estimate, of.active, 0.0)
    shared, nuisances, states = block_arrow.solve(reduced, found, of.estimate)
    step = np.concatenate([np.broadcast_to(shared, (len(weight), len(shared))), nuisances[of.at.record], states], axis=1)
    force, _ = estimated_force(inner, by, step)
    return Posterior(marginal=by, equations=found, reduced=reduced, step=step, force=force)


def restricted_likelihood(of: Linear, inner: Grams, variances: Variances) -> float:
    """Logarithm of the likelihood of the variances, with parameters, states and force integrated out.

    log L = -1/2 (r' P r + sum of log |V| + log |J' V^-1 J|), P r = V^-1 (r + J step).

    Source: H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545-554; D. A. Harville, JASA 72 (1977) 320-338.
    """
    by, weight = marginal(inner, variances.root), variances.weight * of.at.finite
    found = equations(of, by, weight)
    reduced = block_arrow.reduce(found, of.estimate, of.active, 0.0)
    count, counted = of.layout.size - of.layout.states, weight > 0
    determinants = by.log_determinant[counted].sum() + log_determinant(found.hessian[counted][:, count:, count:]).sum()
    determinants += log_determinant(reduced.hessian[np.ix_(reduced.active, reduced.active)])
    quadratic = 2.0 * found.total(of.estimate) - block_arrow.newton_decrement(reduced, found)
    scales = np.sum(inner.log_scale[counted] - 0.5 * inner.samples[counted] * np.log(weight[counted]))
    return float(-0.5 * (quadratic + determinants) - scales)


def log_determinant(matrices: Float[np.ndarray, "*stack n n"]) -> Float[np.ndarray, "*stack"]:
    """Of positive semi-definite matrices; directions that nothing determines count as 1e-12 of their diagonal."""
    scale = np.sqrt(np.maximum(np.diagonal(matrices, axis1=-2, axis2=-1), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    values = np.linalg.eigvalsh(matrices / (scale[..., :, None] * scale[..., None, :]))
    return np.asarray(np.log(np.maximum(values, 1e-12)).sum(axis=-1) + 2.0 * np.log(scale).sum(axis=-1))


def measured_noise(at: Linearised, spacing: float, fastest: float, declared: frozenset[str] = frozenset()) -> dict[str, Autoregression]:
    """Noise of every channel from the flights, faster than any force between knots so far apart.

    White as stated where flights are too short, or knots too far apart for what is faster to be noise.

    Args:
        at: windows with residuals of the model as it is.
        spacing: from knot to knot, s.
        fastest: highest of natural and excitation frequencies, Hz.
        declared: channels of which the size was declared.
    """
    dt = float(np.median(np.diff(at.ts[:, :2], axis=1)))
    margin = max(2, round(0.5 * spacing / dt))
    contact = maximum_filter1d(at.in_contact.astype(int), 2 * margin + 1, axis=1) > 0
    found = {}
    for channel, name in enumerate(at.channels):
        flying = (at.weight[..., channel] > 0) & ~contact & at.finite[:, None]
        segments = [at.residual[w, a:b, channel] for w in range(len(flying)) for a, b in _stretches(flying[w])]
        resolved = _OF_THE_VIBRATION * fastest * spacing < 0.5
        noise = sensor.measured(segments, slow=0.5 * dt / spacing, known=1.0 if name in declared else None) if resolved else None
        found[name] = sensor.white() if noise is None else noise
    return found


def _stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def estimated(of: Linear, inner: Grams, start: Variances, *, rounds: int = 2, coarse: bool = True) -> tuple[Variances, Posterior]:
    """Random force and weights of the windows by restricted maximum likelihood, at the noise as it is.

    Size and memory of the force are found together from the windows that are not far worse than most; the weights follow. `coarse`:
    whether a coarse grid is tried first, since the likelihood may have several maxima.
    """
    found = start
    for turn in range(rounds):
        found = _weighed(found, inner, posterior(of, inner, found), of)
        found = dataclasses.replace(found, force=_force(of, inner, found, coarse=coarse and turn == 0))
    found = _weighed(found, inner, posterior(of, inner, found), of)
    return found, posterior(of, inner, found)


def _weighed(before: Variances, inner: Grams, at: Posterior, of: Linear) -> Variances:
    """With the weights of the windows as they are fitted, and the degrees of freedom."""
    deviation = np.where(of.at.finite, at.deviation(), np.inf)
    degrees = robust.degrees_of_freedom(np.where(of.at.finite, deviation, 0.0), inner.samples)
    return dataclasses.replace(before, weight=robust.weights(deviation, inner.samples, degrees), degrees=degrees)


def orderly(of: Variances) -> Variances:
    """Without the windows that are far worse than most: they have settled wrongly, and say nothing of the force."""
    return dataclasses.replace(of, weight=np.where(of.weight >= np.median(of.weight) / _FAR_WORSE, of.weight, 0.0))


def _force(of: Linear, inner: Grams, at: Variances, *, coarse: bool) -> RandomForce:
    """Size and memory of greatest restricted likelihood, by a simplex."""
    at = orderly(at)
    low, high = np.log(at.places[1] / 3.0), np.log(_LONGEST_MEMORY * at.places[-1])
    least = 0.5 * float(np.log(_NOTHING / max(float(np.max(np.trace(inner.force, axis1=1, axis2=2))), _NOTHING)))

    def cost(logarithms: np.ndarray) -> float:
        force = RandomForce(std=float(np.exp(logarithms[0])), memory=float(np.exp(logarithms[1])))
        return -restricted_likelihood(of, inner, dataclasses.replace(at, force=force))

    here = np.array([max(np.log(at.force.std), least), np.clip(np.log(at.force.memory), low + 0.1, high - 0.1)])
    others = [] if not coarse else [(here[0] + size, memory) for size in _SIZES for memory in np.linspace(low, high, _MEMORIES + 2)[1:-1]]
    start = min([here, *map(np.array, others)], key=cost) if others else here
    start[0] = max(start[0], least)
    simplex = np.stack([start, start + [0.7, 0.0], start + [0.0, 0.7 if start[1] + 0.7 < high else -0.7]])
    limits = [(least, None), (low, high)]
    options = {"maxfev": _EVALUATIONS, "xatol": 0.02, "fatol": 0.05, "initial_simplex": simplex}
    best = minimize(cost, start, method="Nelder-Mead", bounds=limits, options=options).x
    return RandomForce(std=float(np.exp(best[0])), memory=float(np.exp(best[1])))
