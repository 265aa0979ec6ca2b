"""Score test of all candidates beside one fitted model, in the metric of the whole likelihood."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from identification.diagnosis.calibration import ALPHA
from identification.diagnosis.score.probe_scales import facts
from identification.diagnosis.score.score import Candidate, Projector, projector, score
from identification.diagnosis.score.signature import Course, courses
from identification.likelihood.evidence import chance
from identification.likelihood.fitted import Fitted
from identification.likelihood.linearised import Linearised
from vibrojax.effects import EFFECTS, AbstractEffect, Facts


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scored:
    """All candidates beside one model.

    Attributes:
        fitted: the model.
        known: sizes that the records and the model show.
        by: what the fit explains already.
        courses: the fitted motion along every record.
        found: candidates, the largest expected gain first.
        significant: the best of every kind of effect and channel, where chance hardly gives as much.
    """

    fitted: Fitted
    known: Facts
    by: Projector
    courses: tuple[Course, ...]
    found: list[Candidate]
    significant: dict[str, Candidate]

    @property
    def at(self) -> Linearised:
        """The windows, with residuals as they would be without the random force."""
        return self.by.at


def score_all(fitted: Fitted) -> Scored:
    """Score every listed effect that the model does not have yet."""
    prepared, estimate, at = fitted.prepared, fitted.estimate, fitted.point.at
    along, known, by = courses(prepared, at, estimate), facts(prepared, at, estimate), projector(fitted)
    kinds = [kind for name, kind in EFFECTS.items() if name not in fitted.names]
    candidates = [one for kind in kinds for one in blank(kind).probes(known)]
    found = score(prepared, by, along, candidates, known.mass)
    return Scored(fitted=fitted, known=known, by=by, courses=along, found=found, significant=significant(found))


def blank(kind: type[AbstractEffect]) -> AbstractEffect:
    """An effect with every parameter at its order of magnitude."""
    usual: dict[str, Any] = {p.field: p.start for p in kind.parameters}
    return kind(**usual)


def best_of_each(found: Sequence[Candidate]) -> dict[str, Candidate]:
    """The candidate of every kind of effect, and of every channel, with the largest expected gain; best first."""
    best: dict[str, Candidate] = {}
    for candidate in sorted(found, key=lambda one: -one.gain):
        best.setdefault(f"{candidate.name} {candidate.members[0].channel or ''}".strip(), candidate)
    return best


def trials(found: Sequence[Candidate], name: str) -> int:
    """How many candidates of one kind were scored, each weighed with what had been searched before it was proposed."""
    return sum(max(1, one.members[0].looked_at) for one in found if one.name == name)


def significant(found: Sequence[Candidate]) -> dict[str, Candidate]:
    """The best of each kind whose gain chance would hardly give."""
    best = best_of_each(found)
    return {name: one for name, one in best.items() if chance(one.gain, one.degrees, trials(found, one.name)) < ALPHA}
