"""Random effects: parameters that vary between records about a common mean."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import minimize_scalar
from scipy.special import chdtrc

from identification.least_squares.block_arrow import Equations, covariance, reduce
from identification.least_squares.fit import free_unknowns
from identification.least_squares.priors import without_parameter_priors
from identification.likelihood.fitted import Fitted
from identification.windows.prepare import Prepared

IDENTIFIED = 1.0
"""Largest standard error, in the internal coordinate, at which a record identifies a parameter."""
_WIDE = 10.0
"""Prior standard deviation of a parameter within a single record, in its internal coordinate."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variation:
    """Variation of one parameter between records.

    Attributes:
        name: of the parameter.
        std: of the variation, in the parameter's internal coordinate (relative where that is a logarithm).
        chi2: expected gain in twice the log-likelihood where every record has a value of its own.
        chance: probability that estimation errors alone give as much.
    """

    name: str
    std: float
    chi2: float
    chance: float


def variations(fitted: Fitted) -> tuple[Variation, ...]:
    """Score test of every shared parameter that at least two records identify: that it alone varies between records.

    All other parameters stay shared and free. Those that vary already are left out. The most significant comes first.

    Source: D. Commenges, H. Jacqmin-Gadda, J. R. Stat. Soc. B 59 (1997) 157-171 (score tests of homogeneity).
    """
    layout, active = fitted.prepared.layout, free_unknowns(fitted.prepared).shared
    known_already, records = {name for name, _ in layout.variations}, range(len(fitted.prepared.experiment.records))
    if len(records) < 2:
        return ()
    parts = [_shared_normal(fitted, fitted.posterior.equations, fitted.prepared.record == index) for index in records]
    hessian, gradient = (np.stack(part) for part in zip(*parts, strict=True))
    centred = np.eye(len(records)) - 1.0 / len(records)  # deviations that are the same in all records are the parameter itself
    whole = np.zeros_like(hessian[0])
    whole[np.ix_(active, active)] = covariance(hessian.sum(axis=0)[np.ix_(active, active)])
    found = []
    for index, p in enumerate(layout.parameters):
        if not active[index] or p.name in known_already:
            continue
        coupling = hessian[:, :, index]
        information = np.diag(hessian[:, index, index]) - coupling @ whole @ coupling.T
        score = gradient[:, index] - coupling @ whole @ gradient.sum(axis=0)
        known, directions = (part[..., 1:] for part in np.linalg.eigh(centred @ information @ centred))
        along, identified = directions.T @ score, known > IDENTIFIED**-2.0
        if not identified.any():
            continue
        along, known = along[identified], known[identified]
        chi2 = float(np.sum(along**2 / known))
        found.append(Variation(name=p.name, std=variation_std(along, known), chi2=chi2, chance=float(chdtrc(len(known), chi2))))
    return tuple(sorted(found, key=lambda one: (one.chance, -one.chi2)))


def variation_std(score: Float[np.ndarray, " directions"], information: Float[np.ndarray, " directions"]) -> float:
    """Standard deviation between records by restricted maximum likelihood, from the score and its information along independent directions.

    To second order twice the log-likelihood is sum [score^2 / (information + std^-2) - ln(1 + std^2 information)].

    Source: H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545-554.

    Example:
        >>> round(variation_std(np.array([1e12, -1e12]), np.full(2, 1e12)), 6)
        1.0
    """
    if not score.any():
        return 0.0

    def cost(log_std: float) -> float:
        size = np.exp(2.0 * log_std) * information
        return float(np.sum(np.log1p(size) + score**2 / information / (1.0 + size)))

    # from well below the smallest standard error to beyond the largest deviation; there may be several minima
    low, high = -0.5 * np.log(information.max()) - 3.0, np.log(np.abs(score / information).max()) + 2.0
    trials = np.linspace(low, max(high, low + 1.0), 60)
    best = int(np.argmin([cost(one) for one in trials]))
    near = (trials[max(best - 1, 0)], trials[min(best + 1, len(trials) - 1)])
    found = minimize_scalar(cost, bounds=near, method="bounded", options={"xatol": 1e-9})
    return float(np.exp(found.x)) if found.fun < float(np.sum(score**2 / information)) else 0.0


def with_variation(fitted: Fitted, one: Variation) -> Prepared:
    """The fitted model with a random effect on one parameter: each record's deviation, over its standard deviation, has a unit prior."""
    prepared, estimate = fitted.prepared, fitted.estimate
    place = prepared.layout.without_effects
    layout = dataclasses.replace(prepared.layout, variations=(*prepared.layout.variations, (one.name, one.std)))
    start = dataclasses.replace(estimate, nuisances=np.insert(estimate.nuisances, place, 0.0, axis=1))
    return dataclasses.replace(prepared, layout=layout, start=start)


def record_estimates(fitted: Fitted) -> tuple[Float[np.ndarray, "records parameters"], Float[np.ndarray, "records parameters"]]:
    """Each record's own estimate of every shared parameter, as shift from the joint fit, with standard errors; in internal coordinates.

    One Gauss-Newton step of a record's own windows from the joint fit, with all other parameters, nuisances and initial states free in it.
    A random effect on a parameter is part of the shift, and is not estimated beside it. The error of a fixed parameter is infinite.
    """
    layout = fitted.prepared.layout
    found = [_alone(fitted, fitted.prepared.record == index) for index in range(len(fitted.prepared.experiment.records))]
    shift, sigma = (np.stack(part) for part in zip(*found, strict=True))
    names = [p.name for p in layout.parameters]
    for (name, std), deviations in zip(layout.variations, fitted.estimate.nuisances[:, layout.varying].T, strict=True):
        shift[:, names.index(name)] += std * deviations
    return shift, np.where(free_unknowns(fitted.prepared).shared, sigma, np.inf)


def _alone(fitted: Fitted, mine: Bool[np.ndarray, " windows"]) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Newton step of the shared parameters from some windows alone, without priors, with standard errors; internal coordinates."""
    alone = without_parameter_priors(fitted.posterior.equations, fitted.prepared.layout, fitted.estimate)
    hessian, gradient = _shared_normal(fitted, alone, mine, held=fitted.variation_places())
    chosen = free_unknowns(fitted.prepared).shared
    inverse = np.zeros_like(hessian)
    inverse[np.ix_(chosen, chosen)] = covariance((hessian + _WIDE**-2.0 * np.eye(len(hessian)))[np.ix_(chosen, chosen)])
    return -(inverse @ gradient), np.sqrt(np.maximum(np.diag(inverse), 0.0))


def _shared_normal(
    fitted: Fitted, equations: Equations, mine: Bool[np.ndarray, " windows"], *, held: Int[np.ndarray, " held"] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Hessian and gradient of the shared parameters from some windows alone; nuisances, but for those `held`, and states are eliminated."""
    shared = len(fitted.estimate.shared)
    part = dataclasses.replace(equations, hessian=equations.hessian * mine[:, None, None], gradient=equations.gradient * mine[:, None])
    normal = reduce(part, fitted.estimate, free_unknowns(fitted.prepared), 0.0)
    own = np.setdiff1d(np.flatnonzero(normal.active[shared:]) + shared, np.zeros(0, int) if held is None else held)
    coupling = normal.hessian[:shared, own] @ covariance(normal.hessian[np.ix_(own, own)])
    return normal.hessian[:shared, :shared] - coupling @ normal.hessian[own, :shared], normal.gradient[
        :shared
    ] - coupling @ normal.gradient[own]
