"""Effects that will not hold still from record to record are not the cause; the search then begins again without them."""

from collections.abc import Callable

import numpy as np

from identification.discrepancy.diagnosis import Disagreement
from identification.discrepancy.disagreement import BY_CHANCE, disagreements
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import BUDGET, Search, reopened, search

ADDS = 0.05
"""Share of the first misfit that an effect must add to be asserted although more than noise is left."""
MOSTLY = 0.75
"""Share of the misfit that listed effects must explain to be asserted although more than noise is left."""
_NO_CONSTANT = 0.25
"""Scatter between records, beyond their errors and relative to the value, from which a strength is none."""


def steady_search(start: Fitted, allowed: Tolerance, deadline: float, progress: Callable[[str], None] = lambda stage: None) -> Search:
    """The search; where effects that hold still do not explain most of the misfit in the end, once more without one that does not.

    What stands in for a cause that is not in the model fits each record by another strength. A real rig never repeats itself exactly
    either, so that small differences, however sure, say nothing.
    """
    found, without = search(start, allowed, deadline, progress), ()
    while _doubtful(found, allowed) and (loose := unsteady(found.fitted, allowed)):
        progress(f"{loose[0]} will not hold still from record to record; searching without it")
        without = (*without, loose[0])
        place = found.fitted.names.index(loose[0])
        begun = (*found.rounds[:place], *reopened(found.rounds[place], allowed, without=without))
        again = search(start, allowed, deadline, progress, begun=begun, without=without)
        if again.ended == BUDGET:
            break
        found = again
    return found


def _doubtful(found: Search, allowed: Tolerance) -> bool:
    """Whether another search may find what this one, which had its time, has not."""
    return not found.explained and found.ended != BUDGET and bool(steadily(found, allowed)[1] < MOSTLY)


def steadily(found: Search, allowed: Tolerance) -> tuple[Fitted | None, float]:
    """The last model of the search that explains a fair share more than those before it, and the share; its effects hold still.

    Trifles are not told from what is left. A part of the cause alone may not hold still; it counts once the model has all of it.
    """
    most, explained = None, 0.0
    for fitted in found.stages:
        share = found.share(fitted, allowed)
        if share - explained >= ADDS and not unsteady(fitted, allowed):
            most, explained = fitted, share
    return most, explained


def unsteady(fitted: Fitted, allowed: Tolerance) -> tuple[str, ...]:
    """Names of the model's effects with a parameter that is another one from record to record, in the order in which they were found."""
    differ = [one for one in disagreements(fitted, allowed) if one.chance < BY_CHANCE]
    return tuple(name for name in fitted.names if any(_is_no_constant(one, fitted) for one in differ if one.name.startswith(f"{name}.")))


def _is_no_constant(one: Disagreement, fitted: Fitted) -> bool:
    """Whether a parameter's scatter, by the method of moments (DerSimonian and Laird 1986), is large beside its value."""
    weight = np.array([stderr**-2.0 for _, stderr in one.records.values()])
    scatter = np.sqrt((one.chi2 - one.degrees) / (weight.sum() - (weight**2).sum() / weight.sum()))
    return bool(scatter > _NO_CONSTANT * abs(float(fitted.model.values()[one.name])))
