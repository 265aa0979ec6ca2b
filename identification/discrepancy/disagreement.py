"""Parameters that will not hold still: what each record would have them be, beside the joint fit."""

import dataclasses

import numpy as np
from scipy.special import chdtrc

from identification.adequacy import OVERALL, chi2_limit
from identification.block_arrow import Equations, covariance, reduce
from identification.discrepancy.diagnosis import Disagreement
from identification.discrepancy.errors import degrees
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.fit import free_unknowns

BY_CHANCE = 1e-6
"""Chance of noise below which a parameter is said to differ between records."""
_WIDE = 10.0
"""Standard deviation of what is known of a parameter without any record, in its internal coordinate."""
_TOLD = 1.0
"""Standard error, likewise, from which a record says nothing of a parameter."""


def disagreements(fitted: Fitted, allowed: Tolerance) -> tuple[Disagreement, ...]:
    """Every estimated parameter that two records or more determine.

    One Gauss-Newton step of a record's own windows, from the joint fit, gives what it alone would estimate, with its error; all other
    parameters, nuisances and initial states are free in it. The scatter of these estimates over their errors is chi-square distributed
    where the model is complete; errors grow with the root of the joint fit's reduced chi-square where that is not noise.
    """
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    equations, active = allowed.evaluator(lambda _: fitted.outcome.equations)(estimate), free_unknowns(prepared).shared
    reduced_chi2 = 2.0 * float(equations.cost.sum()) / degrees(fitted)
    proud = np.sqrt(reduced_chi2) if reduced_chi2 > chi2_limit(degrees(fitted), OVERALL) else 1.0
    steps, sigmas = [], []
    for record in range(len(prepared.experiment.records)):
        step, sigma = _alone(equations, fitted, record)
        steps.append(step)
        sigmas.append(proud * sigma)
    shift, sigma, found = np.array(steps), np.array(sigmas), []
    for index, p in enumerate(prepared.layout.parameters):
        told = np.flatnonzero(sigma[:, index] < _TOLD)
        if not active[index] or len(told) < 2:
            continue
        weight, moved = sigma[told, index] ** -2.0, shift[told, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        own = {}
        for record, one in zip(told, moved, strict=True):
            value = p.to_physical(estimate.shared[index] + one)
            own[prepared.experiment.records[record].file] = value, float(sigma[record, index] * p.slope(value))
        found.append(Disagreement(name=p.name, chi2=chi2, degrees=len(told) - 1, chance=float(chdtrc(len(told) - 1, chi2)), records=own))
    return tuple(found)


def _alone(equations: Equations, fitted: Fitted, record: int) -> tuple[np.ndarray, np.ndarray]:
    """Step of the shared parameters that one record asks for, and its standard errors; internal coordinates."""
    mine, shared = equations.record == record, len(fitted.outcome.estimate.shared)
    part = dataclasses.replace(equations, hessian=equations.hessian * mine[:, None, None], gradient=equations.gradient * mine[:, None])
    normal = reduce(part, fitted.outcome.estimate, free_unknowns(fitted.prepared), 0.0)
    chosen = normal.active
    hessian = normal.hessian + np.diag(np.where(np.arange(len(chosen)) < shared, _WIDE**-2.0, 0.0))
    inverse = np.zeros_like(hessian)
    inverse[np.ix_(chosen, chosen)] = covariance(hessian[np.ix_(chosen, chosen)])
    return -(inverse @ normal.gradient)[:shared], np.sqrt(np.maximum(np.diag(inverse)[:shared], 0.0))
