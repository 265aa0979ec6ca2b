"""Parameters that will not hold still: what each record, or each half of one, would have them be, beside the joint fit."""

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


def disagreements(fitted: Fitted, allowed: Tolerance, *, halves: bool = False) -> tuple[Disagreement, ...]:
    """Every estimated parameter that two records or more determine; with `halves`, two halves of records.

    One Gauss-Newton step of a record's own windows, from the joint fit, gives what it alone would estimate, with its error; all other
    parameters, nuisances and initial states are free in it. The scatter of these estimates over their errors is chi-square distributed
    where the model is complete; errors grow with the root of the joint fit's reduced chi-square where that is not noise.
    """
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    equations, active = allowed.evaluator(lambda _: fitted.outcome.equations)(estimate), free_unknowns(prepared).shared
    reduced_chi2 = 2.0 * float(equations.cost.sum()) / degrees(fitted)
    proud = np.sqrt(reduced_chi2) if reduced_chi2 > chi2_limit(degrees(fitted), OVERALL) else 1.0
    steps, sigmas, parts = [], [], _halves(fitted) if halves else _whole(fitted)
    for mine in parts.values():
        step, sigma = _alone(equations, fitted, mine)
        steps.append(step)
        sigmas.append(proud * sigma)
    shape, found = (len(parts), len(estimate.shared)), []
    shift, sigma = np.reshape(steps, shape), np.reshape(sigmas, shape)
    for index, p in enumerate(prepared.layout.parameters):
        told = np.flatnonzero(sigma[:, index] < _TOLD)
        if not active[index] or len(told) < 2:
            continue
        weight, moved = sigma[told, index] ** -2.0, shift[told, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        own = {}
        for part, one in zip(told, moved, strict=True):
            value = p.to_physical(estimate.shared[index] + one)
            own[list(parts)[part]] = value, float(sigma[part, index] * p.slope(value))
        found.append(Disagreement(name=p.name, chi2=chi2, degrees=len(told) - 1, chance=float(chdtrc(len(told) - 1, chi2)), records=own))
    return tuple(found)


def _whole(fitted: Fitted) -> dict[str, np.ndarray]:
    """Windows of every record, by its file."""
    prepared = fitted.prepared
    return {record.file: prepared.record == index for index, record in enumerate(prepared.experiment.records)}


def _halves(fitted: Fitted) -> dict[str, np.ndarray]:
    """Windows of the halves of every record that has two windows or more."""
    first, found = np.concatenate([group.first for group in fitted.prepared.groups]), {}
    for file, mine in _whole(fitted).items():
        late = mine & (first > np.median(first[mine]))
        if late.any():
            found |= {f"the first half of {file}": mine & ~late, f"the second half of {file}": late}
    return found


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
