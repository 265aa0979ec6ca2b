"""One look at all candidates from one fitted model."""

import dataclasses
from typing import Any

from identification.discrepancy.evidence import significant
from identification.discrepancy.facts import facts
from identification.discrepancy.linearised import Linearised, linearised
from identification.discrepancy.memory import give_back
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.score import Candidate, projector, score
from identification.discrepancy.signature import Course, courses
from identification.fit import free_unknowns, integrator_for
from vibrojax.effects import EFFECTS, AbstractEffect, Facts


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scored:
    """What a look at all candidates showed."""

    fitted: Fitted
    known: Facts
    at: Linearised
    courses: tuple[Course, ...]
    found: list[Candidate]
    significant: dict[str, Candidate]


def look(fitted: Fitted, allowed: Tolerance, *, without: tuple[str, ...] = ()) -> Scored:
    """Score every candidate that the model does not have yet, but for those that are not to be tried."""
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    at = linearised(prepared, integrator_for(prepared), estimate)
    along, known = courses(prepared, at, estimate), facts(prepared, at, estimate)
    weights = allowed.weights(fitted.outcome.equations.cost) * at.finite
    by = projector(prepared, at, estimate, free_unknowns(prepared), weights)
    kinds = [kind for name, kind in EFFECTS.items() if name not in (*fitted.names, *without)]
    candidates = [one for kind in kinds for one in blank(kind).probes(known)]
    found = score(prepared, by, along, candidates, known.mass)
    give_back()
    return Scored(fitted=fitted, known=known, at=at, courses=along, found=found, significant=significant(found))


def blank(kind: type[AbstractEffect]) -> AbstractEffect:
    """An effect with every parameter at its order of magnitude."""
    usual: dict[str, Any] = {p.field: p.start for p in kind.parameters}
    return kind(**usual)
