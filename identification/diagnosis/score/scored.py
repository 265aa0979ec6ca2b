"""Score test of all candidates beside one fitted model, under its full likelihood."""

import dataclasses
from collections.abc import Collection, Sequence

from identification.diagnosis.calibration import ALPHA
from identification.diagnosis.score.probe_scales import probe_scales
from identification.diagnosis.score.profiled import profiled
from identification.diagnosis.score.score import Candidate, Projector, projector, score
from identification.diagnosis.score.signature import Course, courses
from identification.likelihood.evidence import chance
from identification.likelihood.fitted import Fitted
from identification.likelihood.linearised import Linearised
from vibrojax.effects import EFFECTS, ProbeScales


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scored:
    """Score-test results of all candidates beside one model.

    Attributes:
        fitted: the model.
        scales: probe scales from the records and the model.
        by: projection orthogonal to the fitted unknowns.
        courses: fitted motion along every record.
        found: candidates by decreasing expected gain.
        significant: the best candidate of every kind of effect and channel, if its gain is significant.
    """

    fitted: Fitted
    scales: ProbeScales
    by: Projector
    courses: tuple[Course, ...]
    found: list[Candidate]
    significant: dict[str, Candidate]

    @property
    def at(self) -> Linearised:
        """The windows, with residuals as without the random force."""
        return self.by.at

    @property
    def largest_gain(self) -> float:
        """Largest expected gain of the significant candidates."""
        return max((candidate.gain for candidate in self.significant.values()), default=0.0)


def score_all(fitted: Fitted, among: Collection[str] = EFFECTS) -> Scored:
    """Score every listed effect, or those named in `among`, that the model does not contain."""
    prepared, estimate, at = fitted.prepared, fitted.estimate, fitted.point.at
    along, scales, by = courses(prepared, at, estimate), probe_scales(prepared, at, estimate), projector(fitted)
    probes = [kind.probe for name, kind in EFFECTS.items() if name in among and name not in fitted.names]
    candidates = [one for probe in probes for one in probe.candidates(scales)]
    found = score(prepared, by, along, candidates, scales.mass)
    best = best_of_each(found)
    others = [one for one in found if not any(one is each for each in best.values())]
    found = sorted([*profiled(fitted, along, best).values(), *others], key=lambda one: -one.gain)
    return Scored(fitted=fitted, scales=scales, by=by, courses=along, found=found, significant=significant(found))


def best_of_each(found: Sequence[Candidate]) -> dict[str, Candidate]:
    """Candidate with the largest expected gain of every kind of effect and channel, best first."""
    best: dict[str, Candidate] = {}
    for candidate in sorted(found, key=lambda one: -one.gain):
        best.setdefault(f"{candidate.name} {candidate.members[0].channel or ''}".strip(), candidate)
    return best


def trials(found: Sequence[Candidate], name: str) -> int:
    """Number of tests for one kind of effect: the possibilities searched for its candidates."""
    return sum(one.members[0].probe.searched for one in found if one.name == name)


def significant(found: Sequence[Candidate]) -> dict[str, Candidate]:
    """Best candidate of each kind whose gain noise alone gives with a probability below `ALPHA`."""
    best = best_of_each(found)
    return {name: one for name, one in best.items() if chance(one.gain, one.degrees, trials(found, one.name)) < ALPHA}
