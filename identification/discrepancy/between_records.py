"""Parameters record by record: what each would estimate alone, and how much they vary beyond their errors."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.special import chdtrc

from identification.block_arrow import Equations, covariance, reduce
from identification.discrepancy.diagnosis import Disagreement
from identification.fit import free_unknowns
from identification.likelihood.fitted import Fitted
from vibrojax.parameters import Parameter

_WIDE = 10.0
"""Standard deviation of what is known of a parameter without any record, in its internal coordinate."""
_IDENTIFIED = 1.0
"""Standard error in the internal coordinate up to which a record determines a parameter."""


def disagreements(fitted: Fitted) -> tuple[Disagreement, ...]:
    """Every estimated parameter that two records or more determine.

    The scatter of the records' own estimates over their errors is chi-square distributed where the parameter is the same in all.
    """
    layout, shared, files = fitted.prepared.layout, fitted.estimate.shared, [r.file for r in fitted.prepared.experiment.records]
    shift, sigma = _estimates(fitted, [fitted.prepared.record == index for index in range(len(files))])
    found = []
    for index, p in enumerate(layout.parameters):
        known = np.flatnonzero(sigma[:, index] < _IDENTIFIED)
        if len(known) < 2:
            continue
        weight, moved = sigma[known, index] ** -2.0, shift[known, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        own = {files[k]: _estimated(p, shared[index] + shift[k, index], sigma[k, index]) for k in known}
        chance = float(chdtrc(len(known) - 1, chi2))
        found.append(Disagreement(name=p.name, chi2=chi2, degrees=len(known) - 1, chance=chance, records=own))
    return tuple(found)


def _estimates(fitted: Fitted, parts: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """What parts of the records, each a choice of windows, would move every shared parameter by; and the standard errors.

    One Gauss-Newton step of a part's own windows from the joint fit, with all other parameters, nuisances and initial states free in it.
    Both (parts, parameters), in internal coordinates; the error of a parameter that is held is infinite.
    """
    active = free_unknowns(fitted.prepared)
    shift, sigma = np.zeros((2, len(parts), len(active.shared)))
    for part, mine in enumerate(parts):
        shift[part], sigma[part] = _alone(fitted.posterior.equations, fitted, mine)
    return shift, np.where(active.shared, sigma, np.inf)


def _estimated(p: Parameter, internal: float, sigma: float) -> tuple[float, float]:
    """Value and standard error, SI, of a parameter in its internal coordinate."""
    value = p.to_physical(internal)
    return value, float(sigma) * p.slope(value)


def _alone(equations: Equations, fitted: Fitted, mine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Step of the shared parameters that some windows alone ask for, and its standard errors; internal coordinates."""
    shared = len(fitted.estimate.shared)
    part = dataclasses.replace(equations, hessian=equations.hessian * mine[:, None, None], gradient=equations.gradient * mine[:, None])
    normal = reduce(part, fitted.estimate, free_unknowns(fitted.prepared), 0.0)
    chosen = normal.active
    hessian = normal.hessian + np.diag(np.where(np.arange(len(chosen)) < shared, _WIDE**-2.0, 0.0))
    inverse = np.zeros_like(hessian)
    inverse[np.ix_(chosen, chosen)] = covariance(hessian[np.ix_(chosen, chosen)])
    return -(inverse @ normal.gradient)[:shared], np.sqrt(np.maximum(np.diag(inverse)[:shared], 0.0))
