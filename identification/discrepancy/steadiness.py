"""Effects that will not hold still, or leave another parameter that does not, are not the cause."""

import dataclasses
from collections.abc import Callable

from identification.discrepancy.adequate import adequate
from identification.discrepancy.constancy import unsteady, vague
from identification.discrepancy.disagreement import BY_CHANCE
from identification.discrepancy.drift import MUCH, Drift, drifts
from identification.discrepancy.free_form import Learned, learn
from identification.discrepancy.look import Scored
from identification.discrepancy.prune import pruned
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import BUDGET, LEARNED, MOST_EFFECTS, MOSTLY, Search, reopened, search
from identification.discrepancy.tried import Tried

_BEFORE_A_TERM = 2
"""Effects that are tried before a learned term is asked for."""
ADDS = 0.05
"""Share of the first misfit that an effect must add to be asserted although more than noise is left."""
_AT_REST = 0.5
"""Its change beside the effects over that in the nominal model below which they explain it."""


def steady_search(start: Fitted, allowed: Tolerance, deadline: float, progress: Callable[[str], None] = lambda stage: None) -> Search:
    """The search, and a learned term where effects do not explain all; where that does not do so either, the search goes on.

    Only then is a third effect tried: what two do not explain, and one term does, is on no list.
    """
    term, tried = _Term(allowed, deadline, progress), Tried()
    found = _weighed(search(start, allowed, deadline, progress, most_effects=_BEFORE_A_TERM, tried=tried), allowed)
    if not found.explained and not _explains_all(term.beside(found.first), allowed):
        found = _further(found, allowed, deadline, progress, tried)
    elif found.ended == MOST_EFFECTS:
        found = dataclasses.replace(found, ended=LEARNED)
    if found.fitted.names:
        found = dataclasses.replace(found, mimics=mimicked(found, allowed))
    if found.explained:
        return found
    return dataclasses.replace(found, learned=term.beside(found.first), nearest=found.nearest or found.doubted)


class _Term:
    """A term learned beside the nominal model, once for each fit of that."""

    def __init__(self, allowed: Tolerance, deadline: float, progress: Callable[[str], None]) -> None:
        self._options = {"allowed": allowed, "deadline": deadline, "progress": progress}
        self._fitted: Fitted | None = None
        self._learned: Learned | None = None

    def beside(self, first: Scored) -> Learned | None:
        """None where none is significant."""
        if self._fitted is not first.fitted:
            self._fitted, self._learned = first.fitted, learn(first, **self._options)
        return self._learned


def _explains_all(learned: Learned | None, allowed: Tolerance) -> bool:
    return learned is not None and adequate(learned.fitted, allowed)


def _further(found: Search, allowed: Tolerance, deadline: float, progress: Callable[[str], None], tried: Tried) -> Search:
    """Another effect; where steady ones do not explain most of the misfit, the search again and again without one that is none.

    What stands in for a cause that is not in the model fits each record by another strength. A real rig never repeats itself exactly
    either, so that small differences, however sure, say nothing.
    """
    if found.ended == MOST_EFFECTS:
        found = _weighed(search(found.first.fitted, allowed, deadline, progress, begun=found.rounds, tried=tried), allowed)
    without: tuple[str, ...] = ()
    nearest = found.doubted
    while _doubtful(found, allowed) and (loose := _loose(found, allowed)):
        progress(f"{loose} has no strength that holds for all records; searching without it")
        without = (*without, loose)
        step = found.fitted.names.index(loose)
        begun = (*found.rounds[:step], *reopened(found.rounds[step], allowed, without=without))
        new = search(found.first.fitted, allowed, deadline, progress, begun=begun, without=without, tried=tried)
        again = _weighed(new, allowed)
        if again.ended == BUDGET:
            return dataclasses.replace(found, cut_short=True, nearest=nearest)
        found, nearest = again, nearest or again.doubted
    return dataclasses.replace(found, nearest=nearest)


def mimicked(found: Search, allowed: Tolerance) -> Drift | None:
    """A parameter of the nominal model, as that has it, for which the effects that were found only stand in; None where there is none.

    It changes in the course of records, which alone explains much of the misfit, and the effects have not brought it to rest.
    """
    misfit = 2.0 * (found.rounds[0].cost - allowed.noise)
    after = {one.name: one for one in drifts(found.fitted, allowed)}
    for before in drifts(found.first.fitted, allowed):
        beside = after.get(before.name)
        restless = beside is not None and beside.chance < BY_CHANCE and beside.change > _AT_REST * before.change
        if restless and before.gain > MUCH * misfit:
            return before
    return None


def _doubtful(found: Search, allowed: Tolerance) -> bool:
    """Whether another search may find what this one, which had its time, has not."""
    if found.doubted is not None:
        return True
    return not found.explained and found.ended != BUDGET and bool(steadily(found, allowed)[1] < MOSTLY)


def _loose(found: Search, allowed: Tolerance) -> str:
    """The effect to do without: the first that has not held still since it came in, else the last that does not; empty where all do."""
    loose, came_in = unsteady(found.fitted, allowed), zip(found.fitted.names, found.stages, strict=True)
    never = [name for name, stage in came_in if name in loose and name in unsteady(stage, allowed)]
    return next(iter([*never, *loose[::-1]]), "")


def _weighed(found: Search, allowed: Tolerance) -> Search:
    """The search, doubted where it takes several effects to explain all, of which one does not hold still, or one that records hardly tell.

    One effect that does so alone is the cause, if it is told; several may do so by turns, each a part of what none of them is. What is not
    told explains by the states that each window may choose.
    """
    if not found.explained or not _loosely(found.fitted, allowed):
        return found
    needed = pruned(found.fitted, allowed)
    return dataclasses.replace(found, doubted=needed if _loosely(needed, allowed) else None)


def _loosely(fitted: Fitted, allowed: Tolerance) -> tuple[str, ...]:
    """Effects for which a model that explains all is doubted."""
    return (unsteady if len(fitted.names) > 1 else vague)(fitted, allowed)


def steadily(found: Search, allowed: Tolerance) -> tuple[Fitted | None, float]:
    """The last model of the search that explains a fair share more than those before it, and the share; its effects hold still.

    Trifles are not told from what is left. A part of the cause alone may not hold still; it counts once the model has all of it.
    """
    most, explained = None, 0.0
    for fitted in found.stages if found.mimics is None else ():
        share = found.share(fitted, allowed)
        if share - explained >= ADDS and not unsteady(fitted, allowed):
            most, explained = fitted, share
    return most, explained
