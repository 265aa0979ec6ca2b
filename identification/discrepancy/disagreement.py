"""Parameters that will not hold still: what each record would have them be, beside the joint fit."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.special import chdtrc

from identification.adequacy import OVERALL, chi2_limit
from identification.block_arrow import Equations, covariance, reduce
from identification.discrepancy.diagnosis import Disagreement
from identification.discrepancy.errors import degrees
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.fit import free_unknowns
from vibrojax.parameters import Parameter

BY_CHANCE = 1e-6
"""Chance of noise below which a parameter is said to differ between records."""
_WIDE = 10.0
"""Standard deviation of what is known of a parameter without any record, in its internal coordinate."""
TOLD = 1.0
"""Standard error, likewise, from which a part of the records says nothing of a parameter."""


def disagreements(fitted: Fitted, allowed: Tolerance) -> tuple[Disagreement, ...]:
    """Every estimated parameter that two records or more determine.

    The scatter of the records' own estimates over their errors is chi-square distributed where the model is complete.
    """
    layout, shared, files = fitted.prepared.layout, fitted.outcome.estimate.shared, [r.file for r in fitted.prepared.experiment.records]
    shift, sigma = estimates(fitted, allowed, [fitted.prepared.record == index for index in range(len(files))])
    sigma, found = sigma * pride(fitted, allowed), []
    for index, p in enumerate(layout.parameters):
        told = np.flatnonzero(sigma[:, index] < TOLD)
        if len(told) < 2:
            continue
        weight, moved = sigma[told, index] ** -2.0, shift[told, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        own = {files[k]: estimated(p, shared[index] + shift[k, index], sigma[k, index]) for k in told}
        found.append(Disagreement(name=p.name, chi2=chi2, degrees=len(told) - 1, chance=float(chdtrc(len(told) - 1, chi2)), records=own))
    return tuple(found)


def estimates(fitted: Fitted, allowed: Tolerance, parts: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """What parts of the records, each a choice of windows, would move every shared parameter by; and the standard errors.

    One Gauss-Newton step of a part's own windows from the joint fit, with all other parameters, nuisances and initial states free in it.
    Both (parts, parameters), in internal coordinates; the error of a parameter that is held is infinite.
    """
    equations, active = allowed.evaluator(lambda _: fitted.outcome.equations)(fitted.outcome.estimate), free_unknowns(fitted.prepared)
    shift, sigma = np.zeros((2, len(parts), len(active.shared)))
    for part, mine in enumerate(parts):
        shift[part], sigma[part] = _alone(equations, fitted, mine)
    return shift, np.where(active.shared, sigma, np.inf)


def estimated(p: Parameter, internal: float, sigma: float) -> tuple[float, float]:
    """Value and standard error, SI, of a parameter in its internal coordinate."""
    value = p.to_physical(internal)
    return value, float(sigma) * p.slope(value)


def pride(fitted: Fitted, allowed: Tolerance) -> float:
    """Factor by which errors grow where more than noise is left: the root of reduced chi-square; 1 where it is noise."""
    count, cost = degrees(fitted), allowed.total(fitted.outcome.equations.cost)
    reduced_chi2 = 2.0 * cost / count
    return float(np.sqrt(reduced_chi2)) if reduced_chi2 > chi2_limit(count, OVERALL) else 1.0


def _alone(equations: Equations, fitted: Fitted, mine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Step of the shared parameters that some windows alone ask for, and its standard errors; internal coordinates."""
    shared = len(fitted.outcome.estimate.shared)
    part = dataclasses.replace(equations, hessian=equations.hessian * mine[:, None, None], gradient=equations.gradient * mine[:, None])
    normal = reduce(part, fitted.outcome.estimate, free_unknowns(fitted.prepared), 0.0)
    chosen = normal.active
    hessian = normal.hessian + np.diag(np.where(np.arange(len(chosen)) < shared, _WIDE**-2.0, 0.0))
    inverse = np.zeros_like(hessian)
    inverse[np.ix_(chosen, chosen)] = covariance(hessian[np.ix_(chosen, chosen)])
    return -(inverse @ normal.gradient)[:shared], np.sqrt(np.maximum(np.diag(inverse)[:shared], 0.0))
