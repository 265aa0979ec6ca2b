"""Variance components: noise, random force and window weights, and their restricted maximum likelihood."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from scipy.ndimage import maximum_filter1d
from scipy.optimize import minimize

from identification.least_squares import block_arrow
from identification.least_squares.block_arrow import Equations
from identification.least_squares.priors import with_prior
from identification.likelihood import noise as sensor
from identification.likelihood import robust
from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import Grams, Marginal, estimated_force, marginal
from identification.likelihood.noise import Autoregression
from identification.likelihood.random_force import RandomForce
from identification.windows.layout import Active, Estimate, Layout

_EVALUATIONS = 24
_OF_THE_VIBRATION = 4.0
"""Frequency over that of the fastest vibration above which residuals may be noise alone."""
_NOTHING = 1e-4
"""Expected sum of squares due to the smallest random force, over the noise, in a window."""
_FAR_WORSE = 3.0
"""Median weight over that of a window above which the window has diverged and does not enter the size of the force."""
_SIZES, _MEMORIES = (-2.5, 0.0, 2.5), 4
"""Coarse grid: log sizes relative to the start, and number of correlation times."""
_LONGEST_MEMORY = 2.0
"""Longest correlation time of the force, over the longest window: slower forces are constants."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variances:
    """Variance components of the likelihood: sensor noise, random force and window weights.

    Attributes:
        noise: by channel, relative to the noise as declared or estimated from the record.
        force: random force of windows with weight 1.
        places: its knots from the start of a window, s.
        weight: precision of each window relative to the common one; (windows,).
        degrees: degrees of freedom of the t distribution of the windows.
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
    """Linearised model of all windows: r + J step + Z f, with r the residual at zero random force.

    Attributes:
        layout: of a window's vector.
        estimate: where it is linearised.
        active: unknowns that are estimated.
        at: windows, with r and J.
    """

    layout: Layout
    estimate: Estimate
    active: Active
    at: Linearised


@dataclasses.dataclass(frozen=True, kw_only=True)
class Posterior:
    """Posterior of the linearised model at given variances.

    Attributes:
        marginal: windows with the random force integrated out.
        equations: their normal equations, weighted, with priors.
        reduced: the same with the windows' states eliminated.
        step: mode of every window's vector relative to the point of linearisation; (windows, size).
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
    of: Linear, by: Marginal, weight: Float[np.ndarray, " windows"], curvature: Float[np.ndarray, " windows"] | None = None
) -> Equations:
    """Normal equations of the windows under the full likelihood; `curvature`, of the t loss, turns the Gauss-Newton into a Newton step."""
    gradient = by.gram[:, 1:, 0] * weight[:, None]
    hessian = by.gram[:, 1:, 1:] * weight[:, None, None]
    if curvature is not None:
        hessian -= curvature[:, None, None] * gradient[:, :, None] * gradient[:, None, :]
    plain = Equations(hessian=hessian, gradient=gradient, cost=0.5 * by.gram[:, 0, 0] * weight, record=of.at.record)
    return with_prior(plain, of.layout, of.estimate)


def posterior(of: Linear, inner: Grams, variances: Variances) -> Posterior:
    """Mode of all unknowns of the linearised model at given variances."""
    by, weight = marginal(inner, variances.root), variances.weight * of.at.finite
    found = equations(of, by, weight)
    reduced = block_arrow.reduce(found, of.estimate, of.active, 0.0)
    shared, nuisances, states = block_arrow.solve(reduced, found, of.estimate)
    step = np.concatenate([np.broadcast_to(shared, (len(weight), len(shared))), nuisances[of.at.record], states], axis=1)
    force, _ = estimated_force(inner, by, step)
    return Posterior(marginal=by, equations=found, reduced=reduced, step=step, force=force)


def restricted_likelihood(of: Linear, inner: Grams, variances: Variances) -> float:
    """Restricted log-likelihood of the variances, with parameters, states and force integrated out.

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
    """Log-determinant of positive semi-definite matrices; directions that are not identifiable count as 1e-12 of their diagonal."""
    scale = np.sqrt(np.maximum(np.diagonal(matrices, axis1=-2, axis2=-1), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    values = np.linalg.eigvalsh(matrices / (scale[..., :, None] * scale[..., None, :]))
    return np.asarray(np.log(np.maximum(values, 1e-12)).sum(axis=-1) + 2.0 * np.log(scale).sum(axis=-1))


def measured_noise(at: Linearised, spacing: float, fastest: float, declared: frozenset[str] = frozenset()) -> dict[str, Autoregression]:
    """Noise of every channel, estimated in flight at frequencies above those that a force between the knots can have.

    White, of the size declared or read off the record, where flights are too short, or where knots are too far apart to separate noise
    from vibration.

    Args:
        at: windows with residuals of the present model.
        spacing: from knot to knot, s.
        fastest: highest of natural and excitation frequencies, Hz.
        declared: channels whose noise was declared.
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
    """Random force and window weights by restricted maximum likelihood, at fixed sensor noise.

    Size and correlation time of the force are estimated together from the windows that have not diverged; the weights follow. `coarse`:
    whether a coarse grid precedes the simplex, since the likelihood may have several maxima.
    """
    found = start
    for turn in range(rounds):
        found = _weighed(found, inner, posterior(of, inner, found), of)
        found = dataclasses.replace(found, force=_force(of, inner, found, coarse=coarse and turn == 0))
    found = _weighed(found, inner, posterior(of, inner, found), of)
    return found, posterior(of, inner, found)


def _weighed(before: Variances, inner: Grams, at: Posterior, of: Linear) -> Variances:
    """The variances with updated window weights and degrees of freedom."""
    deviation = np.where(of.at.finite, at.deviation(), np.inf)
    degrees = robust.degrees_of_freedom(np.where(of.at.finite, deviation, 0.0), inner.samples)
    return dataclasses.replace(before, weight=robust.weights(deviation, inner.samples, degrees), degrees=degrees)


def orderly(of: Variances) -> Variances:
    """The variances without diverged windows, which hold no information on the random force."""
    return dataclasses.replace(of, weight=np.where(of.weight >= np.median(of.weight) / _FAR_WORSE, of.weight, 0.0))


def _force(of: Linear, inner: Grams, at: Variances, *, coarse: bool) -> RandomForce:
    """Size and correlation time of the random force with the greatest restricted likelihood, by a simplex."""
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
