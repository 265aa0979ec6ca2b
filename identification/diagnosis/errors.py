"""Standard errors of a fitted model under the full likelihood (noise and random force)."""

import numpy as np

from identification.diagnosis.diagnosis import Number
from identification.least_squares.fit import bounds, free_unknowns
from identification.least_squares.uncertainty import Uncertainty, uncertainty
from identification.likelihood.fitted import Fitted


def errors(fitted: Fitted) -> Uncertainty:
    """Covariance of all estimated parameters and nuisances (generalised least squares)."""
    return uncertainty(fitted.posterior.equations, fitted.estimate, free_unknowns(fitted.prepared))


def numbers(fitted: Fitted) -> tuple[Number, ...]:
    """Every shared parameter with its standard error; None where it is fixed, not identifiable, or at a bound."""
    prepared, estimate = fitted.prepared, fitted.estimate
    active, spread, (low, high) = free_unknowns(prepared), errors(fitted), bounds(prepared)
    found = []
    for index, p in enumerate(prepared.layout.parameters):
        internal = estimate.shared[index]
        value = p.to_physical(internal)
        known = bool(active.shared[index] and spread.identifiable[index] and low[index] < internal < high[index])
        stderr = float(np.hypot(spread.stderr[index] * p.slope(value), p.resolution)) if known else None
        found.append(Number(name=p.name, symbol=p.symbol, unit=p.unit, value=float(value), stderr=stderr))
    return tuple(found)
