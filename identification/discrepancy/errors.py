"""Errors of a fitted model, its windows counting as the fit let them."""

import numpy as np

from identification.adequacy import OVERALL, chi2_limit
from identification.discrepancy.diagnosis import Number
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.estimate import degrees_of_freedom
from identification.fit import bounds, free_unknowns
from identification.uncertainty import Uncertainty, uncertainty


def degrees(fitted: Fitted) -> int:
    """Samples that count, less estimated numbers; at least 1."""
    return max(degrees_of_freedom(fitted.prepared, free_unknowns(fitted.prepared)), 1)


def errors(fitted: Fitted, allowed: Tolerance) -> Uncertainty:
    """Covariance of everything that was estimated, under the tolerance of the fit."""
    equations = allowed.evaluator(lambda _: fitted.outcome.equations)(fitted.outcome.estimate)
    reduced_chi2 = 2.0 * float(np.sum(equations.cost)) / degrees(fitted)
    limit = chi2_limit(degrees(fitted), OVERALL)
    return uncertainty(equations, fitted.outcome.estimate, free_unknowns(fitted.prepared), reduced_chi2, adequate_below=limit)


def numbers(fitted: Fitted, allowed: Tolerance) -> tuple[Number, ...]:
    """Every shared parameter with its standard error; None where it is held, not identifiable, or stopped at the edge of its range."""
    prepared, outcome = fitted.prepared, fitted.outcome
    active, spread, (low, high) = free_unknowns(prepared), errors(fitted, allowed), bounds(prepared)
    found = []
    for index, p in enumerate(prepared.layout.parameters):
        internal = outcome.estimate.shared[index]
        value = p.to_physical(internal)
        known = bool(active.shared[index] and spread.identifiable[index] and low[index] < internal < high[index])
        stderr = float(np.hypot(spread.stderr[index] * p.slope(value), p.resolution)) if known else None
        found.append(Number(name=p.name, symbol=p.symbol, unit=p.unit, value=float(value), stderr=stderr))
    return tuple(found)
