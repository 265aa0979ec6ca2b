"""Alternatives of one search step: the candidates with the largest expected gain, refitted with all other parameters."""

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from identification.diagnosis.calibration import WITHIN_CHANCE
from identification.diagnosis.free_form.free_form import Learned
from identification.diagnosis.refit import extended
from identification.diagnosis.relevance import residual_share
from identification.diagnosis.score.lags import is_recorded
from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.scored import Scored
from identification.diagnosis.search.attempts import Progress, attempt, by_least_squares
from identification.diagnosis.search.from_loops import from_loops
from identification.least_squares.fit import integrator_for
from identification.likelihood.fitted import Fitted
from identification.likelihood.linearised import linearised
from identification.windows.prepare import Prepared

_SHORT_LIST = 5
"""Largest number of kinds of candidates refitted in one search step, besides those that the score test does not apply to."""
_WORTH_A_FIT = 0.1
"""Share of the largest gain, expected and obtained, above which a candidate is refitted."""
_CLOSE, _LITTLE = 0.4, 0.1
"""The same share once a candidate has obtained its expected gain; residual share of the misfit below which that candidate explains it."""
_STOPS = 3
"""Candidates without a derivative that are refitted."""
_BAD = 0.02
"""Share of the windows with little weight above which such candidates are refitted."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Alternative:
    """An alternative: one candidate refitted with all other parameters, to convergence, or for one round if it cannot become the best."""

    candidate: Candidate
    fitted: Fitted
    gain: float
    """Twice the log-likelihood gain over the model without it."""

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.candidate.name


def fitted_in_full(scored: Scored, line: Learned | None, deadline: float, progress: Progress) -> tuple[list[Alternative], bool]:
    """Alternatives: the candidates with the largest expected gain, each refitted with all other parameters, by decreasing evidence.

    None is refitted where a free-form line, with a larger expected gain, explains nearly all of the misfit. After the `deadline`
    (`time.monotonic()`) no further one is refitted, and only the best so far is refitted to convergence.

    Returns:
        The alternatives, and whether the deadline cut their number.
    """
    if line is not None and residual_share(line.fitted, scored.fitted) < _LITTLE:
        return [], False
    queue, cut = _queue(scored), False
    alternatives: list[Alternative] = []
    best = scored.largest_gain
    with ThreadPoolExecutor(1) as ahead:
        for index, (candidate, prepared) in enumerate(queue):
            if cut := bool(alternatives) and time.monotonic() > deadline:
                break
            if _is_hopeless(candidate, scored, alternatives, best):
                continue
            for _, following in queue[index + 1 : index + 2]:
                ahead.submit(_compiled, following, scored.fitted)
            progress(f"fitting {candidate.name} {candidate.members[0].channel or ''} beside {scored.fitted.title}")
            alternatives += _tried(candidate, prepared, scored.fitted)
    alternatives.sort(key=lambda alternative: alternative.fitted.criterion)
    return _finished(alternatives, scored.fitted, deadline, progress), cut


def _is_hopeless(candidate: Candidate, scored: Scored, alternatives: list[Alternative], best: float) -> bool:
    """Whether a candidate's expected gain is far below the best expected and obtained ones; never where the score test does not apply."""
    effect = candidate.members[0]
    if not alternatives or effect.probe.is_stop or effect.probe.kink or is_recorded(effect, scored.scales):
        return False
    gained = min(best, max(0.0, *(alternative.gain for alternative in alternatives)))
    done = any(_explains(alternative, scored.fitted) for alternative in alternatives)
    return candidate.gain < (_CLOSE if done else _WORTH_A_FIT) * gained


def _finished(alternatives: list[Alternative], beside: Fitted, deadline: float, progress: Progress) -> list[Alternative]:
    """Alternatives refitted to convergence where their BIC may come within `WITHIN_CHANCE` of the best, by decreasing evidence."""
    found, best = [], beside.criterion
    for alternative in alternatives:
        if found and time.monotonic() > deadline:
            found.append(alternative)
            continue
        if alternative.fitted.criterion - 2.0 * alternative.fitted.to_go < best + WITHIN_CHANCE:
            progress(f"fitting {alternative.fitted.title} to the end")
            finished = attempt(alternative.fitted.continued, alternative.fitted.variances, rounds=2)
            if finished is not None and not finished.converged and time.monotonic() < deadline:
                finished = by_least_squares(finished, progress)
            if finished is not None:
                alternative = _alternative(alternative.candidate, finished, beside)
                best = min(best, finished.criterion)
        found.append(alternative)
    return sorted(found, key=lambda alternative: alternative.fitted.criterion)


def _alternative(candidate: Candidate, found: Fitted, beside: Fitted) -> Alternative:
    return Alternative(candidate=candidate, fitted=found.lightened(), gain=2.0 * (found.log_likelihood - beside.log_likelihood))


def _explains(alternative: Alternative, beside: Fitted) -> bool:
    """Whether an alternative has obtained its expected gain and explains nearly all of the misfit."""
    return alternative.gain >= alternative.candidate.gain > 0 and residual_share(alternative.fitted, beside) < _LITTLE


def _tried(candidate: Candidate, prepared: Prepared, beside: Fitted) -> list[Alternative]:
    """The candidate after one round of its refit; empty where the refit fails."""
    found = attempt(prepared, beside.variances, rounds=1)
    return [] if found is None else [_alternative(candidate, found, beside)]


def _queue(scored: Scored) -> list[tuple[Candidate, Prepared]]:
    """Candidates to be refitted, with their windows and start values."""
    short = [one for candidate in list(scored.significant.values())[:_SHORT_LIST] for one in _starts(candidate, scored)]
    weight = scored.fitted.variances.weight
    resist = float(np.mean(weight < 0.2 * np.median(weight))) >= _BAD
    listed = {one.name for one in short}
    stops = [one for one in scored.found if one.members[0].probe.is_stop and one.name not in listed][:_STOPS] if resist else []
    shown = [one for one in scored.found if is_recorded(one.members[0], scored.scales) and one.name not in listed]
    begun = [(one, started(one, scored)) for one in [*short, *stops, *shown]]
    return [*begun, *(from_loops(scored) if resist or stops else [])]


def _starts(candidate: Candidate, scored: Scored) -> list[Candidate]:
    """The candidate, and further candidates of its effect as alternative starts, as many as its probe has `starts`."""
    others = [one for one in scored.found if one.name == candidate.name and 0.0 < one.gain < candidate.gain]
    return [candidate, *others[: candidate.members[0].probe.starts - 1]]


def started(candidate: Candidate, scored: Scored) -> Prepared:
    """Windows with the candidate at the strength of the score test.

    A stop, and a delay that the records show, starts as proposed: along a motion without it the score gives no strength.
    """
    effect = candidate.members[0]
    if not (effect.probe.is_stop or is_recorded(effect, scored.scales)):
        return extended(scored.fitted, candidate, scored.courses)
    as_proposed = dataclasses.replace(candidate, factors=np.ones(len(candidate.members)))
    return extended(scored.fitted, as_proposed, scored.courses, is_small=False)


def _compiled(prepared: Prepared, beside: Fitted) -> None:
    """Compile the candidate's program ahead of its refit: one core compiles while the other fits."""
    linearised(prepared, integrator_for(prepared), prepared.start, beside.variances.places)
