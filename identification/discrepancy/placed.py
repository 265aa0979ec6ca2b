"""What a search has placed in time, fitted once more from where the records may tell its place to the last digit."""

import dataclasses

from identification.discrepancy.adequate import adequate
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.tolerant_fit import fit_tolerantly
from identification.prepare import Prepared
from vibrojax.effects import AbstractEffect, Facts
from vibrojax.errors import NoConvergenceError

_BETTER = 8.0
"""Drop of the cost, half chi-square, that a place estimated must bring."""


def better_placed(fitted: Fitted, known: Facts, allowed: Tolerance) -> Fitted:
    """The fit with its newest effect in the best of its `other_places`, now estimated; as it is where none is better."""
    best = fitted
    for effect in fitted.model.effects[-1].other_places(known):
        if adequate(best, allowed):
            break
        limit = allowed.total(best.outcome.equations.cost) - _BETTER
        try:
            found = fit_tolerantly(_set_free(fitted, effect), allowed)
        except NoConvergenceError:
            continue
        if found is not None and allowed.total(found.outcome.equations.cost) < limit:
            best = found
    return best


def _set_free(fitted: Fitted, effect: AbstractEffect) -> Prepared:
    """From where the fit is, but for what had been searched for: that begins where `effect` has it, and is held no more."""
    before, estimate = fitted.prepared, fitted.outcome.estimate
    places = {f"{effect.name}.{p.name}": float(getattr(effect, p.field)) for p in effect.parameters if p.searched}
    shared = before.layout.internal(before.layout.physical(estimate.shared) | places)
    held = {name: value for name, value in before.fixed.items() if name not in places}
    return dataclasses.replace(before, fixed=held, start=dataclasses.replace(estimate, shared=shared))
