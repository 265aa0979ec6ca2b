"""Random effects: parameters that vary between records about a common mean."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import minimize_scalar
from scipy.special import chdtrc

from identification.least_squares.block_arrow import covariance, reduce
from identification.least_squares.fit import free_unknowns
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
        chi2: weighted sum of squared deviations of the records' own estimates, about the possible gain in twice the log-likelihood.
        chance: probability that estimation errors alone scatter them as much.
    """

    name: str
    std: float
    chi2: float
    chance: float


def variations(fitted: Fitted) -> tuple[Variation, ...]:
    """Variation of every shared parameter that at least two records identify, the most significant first."""
    shift, sigma = record_estimates(fitted)
    known_already = {name for name, _ in fitted.prepared.layout.variations}
    found = []
    for index, p in enumerate(fitted.prepared.layout.parameters):
        known = sigma[:, index] < IDENTIFIED
        if known.sum() < 2 or p.name in known_already:
            continue
        value, stderr = shift[known, index], sigma[known, index]
        weight = stderr**-2.0
        chi2 = float(np.sum(weight * (value - np.sum(weight * value) / np.sum(weight)) ** 2))
        chance = float(chdtrc(int(known.sum()) - 1, chi2))
        found.append(Variation(name=p.name, std=variation_std(value, stderr), chi2=chi2, chance=chance))
    return tuple(sorted(found, key=lambda one: one.chance))


def variation_std(value: Float[np.ndarray, " records"], stderr: Float[np.ndarray, " records"]) -> float:
    """Standard deviation between records by restricted maximum likelihood, given each record's estimate and its standard error.

    Source: K. J. Thompson, S. G. Sharp, Stat. Med. 18 (1999) 2693-2708.

    Example:
        >>> round(variation_std(np.array([-1.0, 0.0, 1.0]), np.full(3, 1e-6)), 6)
        1.0
    """
    largest = float(np.ptp(value))
    if largest == 0.0:
        return 0.0

    def cost(std: float) -> float:
        weight = 1.0 / (stderr**2 + std**2)
        mean = np.sum(weight * value) / np.sum(weight)
        return float(0.5 * np.sum(weight * (value - mean) ** 2) - 0.5 * np.sum(np.log(weight)) + 0.5 * np.log(np.sum(weight)))

    best = minimize_scalar(cost, bounds=(0.0, 3.0 * largest), method="bounded", options={"xatol": 1e-6 * largest})
    return float(best.x) if best.fun < cost(0.0) else 0.0


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
    The error of a fixed parameter is infinite.
    """
    found = [_alone(fitted, fitted.prepared.record == index) for index in range(len(fitted.prepared.experiment.records))]
    shift, sigma = (np.stack(part) for part in zip(*found, strict=True))
    return shift, np.where(free_unknowns(fitted.prepared).shared, sigma, np.inf)


def _alone(fitted: Fitted, mine: Bool[np.ndarray, " windows"]) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Newton step of the shared parameters from some windows alone, with standard errors; internal coordinates."""
    equations, shared = fitted.posterior.equations, len(fitted.estimate.shared)
    part = dataclasses.replace(equations, hessian=equations.hessian * mine[:, None, None], gradient=equations.gradient * mine[:, None])
    normal = reduce(part, fitted.estimate, free_unknowns(fitted.prepared), 0.0)
    chosen = normal.active
    hessian = normal.hessian + np.diag(np.where(np.arange(len(chosen)) < shared, _WIDE**-2.0, 0.0))
    inverse = np.zeros_like(hessian)
    inverse[np.ix_(chosen, chosen)] = covariance(hessian[np.ix_(chosen, chosen)])
    return -(inverse @ normal.gradient)[:shared], np.sqrt(np.maximum(np.diag(inverse)[:shared], 0.0))
