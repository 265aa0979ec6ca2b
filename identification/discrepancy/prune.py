"""Backward elimination: an effect that a later one has made needless leaves the model again."""

import dataclasses

import numpy as np

from identification.discrepancy.continuity import whole_cost
from identification.discrepancy.refit import Fitted, with_model
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.tolerant_fit import fit_tolerantly
from identification.layout import STATES
from vibrojax.errors import NoConvergenceError

_NEEDED = 12.0
"""Rise of the cost (half chi-square) from which an effect is needed."""


def pruned(fitted: Fitted, allowed: Tolerance) -> Fitted:
    """The model without those of its effects whose removal costs next to nothing."""
    for effect in fitted.prepared.model.effects[:-1]:
        cost = whole_cost(fitted, allowed)
        try:
            without = fit_tolerantly(without_effect(fitted, effect.name).prepared, allowed, give_up_above=1.5 * cost + 1000.0)
        except NoConvergenceError:
            continue
        if without is not None and whole_cost(without, allowed) < cost + _NEEDED:
            fitted = without
    return fitted


def without_effect(fitted: Fitted, name: str) -> Fitted:
    """The same windows and numbers, one effect taken out; not fitted again."""
    before, estimate, model = fitted.prepared, fitted.outcome.estimate, fitted.model
    of_record = [not p.name.startswith(f"{name}.") for p in before.layout.record_parameters]
    owners = [effect.name for effect in model.effects for _ in effect.own_states]
    of_window = [owners[index] != name for index in before.layout.free_own]
    nuisances = estimate.nuisances[:, np.array([True] * before.layout.without_effects + of_record)]
    states = estimate.states[:, np.array([True] * len(STATES) + of_window)]
    less = dataclasses.replace(model, effects=tuple(effect for effect in model.effects if effect.name != name))
    kept = {key: value for key, value in before.fixed.items() if not key.startswith(f"{name}.")}
    prepared = with_model(dataclasses.replace(before, fixed=kept), less, nuisances, states)
    return Fitted(prepared=prepared, outcome=fitted.outcome)
