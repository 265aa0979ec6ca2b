"""Forward search: score all candidates, refit the best few, add the one with the greatest evidence, and score again."""

import dataclasses
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from identification.diagnosis.calibration import ALPHA, MOST_EFFECTS, RELEVANT, WITHIN_CHANCE
from identification.diagnosis.free_form.free_form import Learned, learn, strongest_line
from identification.diagnosis.from_loops import from_loops
from identification.diagnosis.refit import extended, lengthened, without
from identification.diagnosis.relevance import residual_share, share_added
from identification.diagnosis.score.lags import is_recorded
from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.scored import Scored, score_all, trials
from identification.estimation.nominal import is_near
from identification.least_squares.fit import bounds, evaluator, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import LevenbergMarquardt
from identification.likelihood.evidence import chance
from identification.likelihood.fitted import Fitted, fitted
from identification.likelihood.joint import point
from identification.likelihood.linearised import linearised
from identification.likelihood.random_effects import Variation, variations, with_variation
from identification.likelihood.variances import Variances
from identification.windows.prepare import Prepared
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
COMPLETE, MOST, BUDGET, FAILED = "no further effect is significant", "as many effects as are fitted together", "budget", "failed fit"
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


@dataclasses.dataclass(frozen=True, kw_only=True)
class Step:
    """One search step: scored candidates and refitted alternatives."""

    scored: Scored
    alternatives: tuple[Alternative, ...]
    """By decreasing evidence."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Search:
    """Result of the forward search: its steps, the final model, and the reason for its end.

    Attributes:
        steps: those that added an effect.
        last: score test of all candidates beside the final model.
        refused: candidates refitted beside the final model, without sufficient gain.
        ended: `COMPLETE`, `MOST`, `BUDGET` or `FAILED`.
        learned: a free-form term beside the final model with more evidence than any listed effect.
    """

    steps: tuple[Step, ...]
    last: Scored
    refused: tuple[Alternative, ...]
    ended: str
    learned: Learned | None = None

    @property
    def fitted(self) -> Fitted:
        """The final model."""
        return self.last.fitted

    @property
    def first(self) -> Scored:
        """Score test of all candidates beside the nominal model."""
        return self.steps[0].scored if self.steps else self.last


def search(start: Fitted, *, deadline: float, progress: Progress = lambda stage: None) -> Search:
    """Forward search: add effects to a model until no candidate is significant and relevant, or there are `MOST_EFFECTS`.

    Args:
        start: the nominal model, fitted.
        deadline: `time.monotonic()` after which no further step begins.
        progress: called with a line of text at each stage.
    """
    steps: list[Step] = []
    model = start
    while True:
        progress(f"scoring all candidates beside {model.title}")
        scored = score_all(model)
        if len(model.names) >= MOST_EFFECTS:
            return Search(steps=tuple(steps), last=scored, refused=(), ended=MOST)
        if time.monotonic() > deadline:
            return Search(steps=tuple(steps), last=scored, refused=(), ended=BUDGET)
        varying = _varying(model)
        if varying is not None and varying.chi2 >= max(_expected(scored), strongest_line(scored)):
            varied, varying = _with_variation(model, varying, progress), None
            if varied is not None:
                model = varied
                continue
        line = _line(scored, deadline, progress)
        alternatives = _fitted_in_full(scored, line, progress)
        if line is not None and not (alternatives and alternatives[0].fitted.criterion < line.fitted.criterion):
            return Search(steps=tuple(steps), last=scored, refused=tuple(alternatives), ended=COMPLETE, learned=line)
        if varying is not None and varying.chi2 >= (alternatives[0].gain if alternatives else 0.0):
            varied = _with_variation(model, varying, progress)
            if varied is not None and not (alternatives and alternatives[0].fitted.criterion < varied.criterion):
                model = varied
                continue
        again = _led_by(model, alternatives, progress)
        alternatives = [
            dataclasses.replace(one, gain=one.gain - 2.0 * (again.log_likelihood - model.log_likelihood)) for one in alternatives
        ]
        if again is not model and not _has_evidence(alternatives[0], again, scored):
            model = again
            continue
        if (
            not alternatives
            or not _has_evidence(alternatives[0], model, scored)
            or share_added(start, model, alternatives[0].fitted) < RELEVANT
        ):
            return Search(steps=tuple(steps), last=scored, refused=tuple(alternatives), ended=COMPLETE)
        progress(f"fitting {alternatives[0].fitted.title} to the end")
        best = _to_the_end(alternatives[0].fitted)
        if best is None:
            return Search(steps=tuple(steps), last=scored, refused=tuple(alternatives), ended=FAILED)
        steps.append(_kept(scored, alternatives))
        model = _lessened(best, start, progress)


def _expected(scored: Scored) -> float:
    """Largest expected gain of the significant candidates."""
    return max((candidate.gain for candidate in scored.significant.values()), default=0.0)


def _line(scored: Scored, deadline: float, progress: Progress) -> Learned | None:
    """A free-form term, where a sinusoidal force has a larger expected gain than any listed effect.

    An undamped mode with a phase of its own in every window resembles such a line.
    """
    return learn(scored, deadline=deadline, progress=progress) if strongest_line(scored) > _expected(scored) else None


def _varying(model: Fitted) -> Variation | None:
    """The parameter that varies most significantly between records; None where none does."""
    level = ALPHA / len(model.prepared.layout.parameters)
    return next((one for one in variations(model) if one.chance < level and one.std > 0.0), None)


def _with_variation(model: Fitted, one: Variation, progress: Progress) -> Fitted | None:
    """The model with a random effect on a parameter; None where the fit does not lower the BIC."""
    progress(f"fitting {one.name} that varies between records beside {model.title}")
    found = _attempt(with_variation(model, one), model.variances, rounds=3)
    return found if found is not None and found.criterion < model.criterion else None


def _lessened(model: Fitted, nominal: Fitted, progress: Progress) -> Fitted:
    """The model after backward elimination of the earlier effects that the last one makes superfluous."""
    for name in model.names[:-1]:
        progress(f"fitting {model.title} without {name}")
        less = _attempt(without(model, name), model.variances, rounds=3)
        if less is None:
            continue
        gain, numbers = 2.0 * (model.log_likelihood - less.log_likelihood), max(model.unknowns - less.unknowns, 1)
        needed = chance(gain, numbers, 1) < ALPHA and model.criterion < less.criterion
        if not needed or share_added(nominal, less, model) < RELEVANT:
            model = less
    return model


def _has_evidence(best: Alternative, beside: Fitted, scored: Scored) -> bool:
    """Whether the gain of an alternative is significant and lowers the BIC."""
    numbers = max(best.fitted.unknowns - beside.unknowns, 1)
    by_chance = chance(best.gain, numbers, trials(scored.found, best.name))
    return by_chance < ALPHA and best.fitted.criterion < beside.criterion


def _kept(scored: Scored, alternatives: list[Alternative]) -> Step:
    """A search step without its large arrays."""
    return Step(
        scored=dataclasses.replace(scored, fitted=scored.fitted.lightened(), by=scored.by.lightened()), alternatives=tuple(alternatives)
    )


def _led_by(model: Fitted, alternatives: list[Alternative], progress: Progress) -> Fitted:
    """The model, or a better fit of it that starts from the parameters of the best alternative.

    A fit that has diverged to a wrong motion may recover with any effect; that recovery is no evidence for the effect. A converged fit near
    the recorded motion stays as it is.
    """
    if not alternatives or (model.converged and is_near(model)):
        return model
    progress(f"fitting {model.title} again")
    there, prepared = alternatives[0].fitted.estimate, model.prepared
    values = alternatives[0].fitted.prepared.layout.physical(there.shared)
    start = dataclasses.replace(
        model.estimate,
        shared=prepared.layout.internal({p.name: values[p.name] for p in prepared.layout.parameters}),
        nuisances=there.nuisances[:, : model.estimate.nuisances.shape[1]],
        states=there.states[:, : model.estimate.states.shape[1]],
    )
    again = _attempt(dataclasses.replace(prepared, start=start), model.variances, rounds=1, iterations=6, settle=False)
    return model if again is None or again.log_likelihood < model.log_likelihood - 0.5 * np.log(ALPHA) else again


def _fitted_in_full(scored: Scored, line: Learned | None, progress: Progress) -> list[Alternative]:
    """Alternatives: the candidates with the largest expected gain, each refitted with all other parameters, by decreasing evidence.

    None is refitted where a free-form line, with a larger expected gain, explains nearly all of the misfit.
    """
    if line is not None and residual_share(line.fitted, scored.fitted) < _LITTLE:
        return []
    queue = _queue(scored)
    alternatives: list[Alternative] = []
    best = _expected(scored)
    with ThreadPoolExecutor(1) as ahead:
        for index, (candidate, prepared) in enumerate(queue):
            if _is_hopeless(candidate, scored, alternatives, best):
                continue
            for _, following in queue[index + 1 : index + 2]:
                ahead.submit(_compiled, following, scored.fitted)
            progress(f"fitting {candidate.name} {candidate.members[0].channel or ''} beside {scored.fitted.title}")
            alternatives += _tried(candidate, prepared, scored.fitted)
    return _finished(sorted(alternatives, key=lambda alternative: alternative.fitted.criterion), scored.fitted, progress)


def _is_hopeless(candidate: Candidate, scored: Scored, alternatives: list[Alternative], best: float) -> bool:
    """Whether a candidate's expected gain is far below the best expected and obtained ones; never where the score test does not apply."""
    effect = candidate.members[0]
    if not alternatives or effect.probe.is_stop or effect.probe.kink or is_recorded(effect, scored.scales):
        return False
    gained = min(best, max(0.0, *(alternative.gain for alternative in alternatives)))
    done = any(_explains(alternative, scored.fitted) for alternative in alternatives)
    return candidate.gain < (_CLOSE if done else _WORTH_A_FIT) * gained


def _finished(alternatives: list[Alternative], beside: Fitted, progress: Progress) -> list[Alternative]:
    """Alternatives refitted to convergence where their BIC may come within `WITHIN_CHANCE` of the best, by decreasing evidence."""
    found, best = [], beside.criterion
    for alternative in alternatives:
        if alternative.fitted.criterion - 2.0 * alternative.fitted.to_go < best + WITHIN_CHANCE:
            progress(f"fitting {alternative.fitted.title} to the end")
            finished = _attempt(alternative.fitted.continued, alternative.fitted.variances, rounds=2)
            if finished is not None and not finished.converged:
                finished = _by_least_squares(finished, progress)
            if finished is not None:
                alternative = _alternative(alternative.candidate, finished, beside)
                best = min(best, finished.criterion)
        found.append(alternative)
    return sorted(found, key=lambda alternative: alternative.fitted.criterion)


def _by_least_squares(found: Fitted, progress: Progress) -> Fitted:
    """The better, by BIC, of a fit that has not converged and of one that starts from least squares.

    An estimated random force stands in for an effect that starts far from its place, and then holds it there.
    """
    progress(f"fitting {found.title} by least squares")
    prepared = found.prepared
    start = dataclasses.replace(found.estimate, force=np.zeros_like(found.estimate.force))
    try:
        outcome = LevenbergMarquardt()(evaluator(prepared, integrator_for(prepared)), start, free_unknowns(prepared), bounds(prepared))
    except (NoConvergenceError, np.linalg.LinAlgError):
        return found
    other = _attempt(dataclasses.replace(prepared, start=outcome.estimate), found.variances, rounds=3)
    return other if other is not None and other.criterion < found.criterion else found


def _attempt(prepared: Prepared, variances: Variances, *, rounds: int, **options: Any) -> Fitted | None:
    """A fit from the prepared start, with options of `fitted`; None where the integration fails or the likelihood is not finite."""
    try:
        found = fitted(point(prepared, prepared.start, variances), rounds=rounds, measure_noise=False, **options)
    except (NoConvergenceError, np.linalg.LinAlgError):
        return None
    return found if np.isfinite(found.log_likelihood) else None


def _to_the_end(found: Fitted) -> Fitted | None:
    """The chosen fit on windows as long as they may be, converged; None where that fails."""
    try:
        return lengthened(found) or fitted(point(found.prepared, found.estimate, found.variances))
    except (NoConvergenceError, np.linalg.LinAlgError):
        return None


def _alternative(candidate: Candidate, found: Fitted, beside: Fitted) -> Alternative:
    return Alternative(candidate=candidate, fitted=found.lightened(), gain=2.0 * (found.log_likelihood - beside.log_likelihood))


def _explains(alternative: Alternative, beside: Fitted) -> bool:
    """Whether an alternative has obtained its expected gain and explains nearly all of the misfit."""
    return alternative.gain >= alternative.candidate.gain > 0 and residual_share(alternative.fitted, beside) < _LITTLE


def _tried(candidate: Candidate, prepared: Prepared, beside: Fitted) -> list[Alternative]:
    """The candidate after one round of its refit; empty where the refit fails."""
    found = _attempt(prepared, beside.variances, rounds=1)
    return [] if found is None else [_alternative(candidate, found, beside)]


def _queue(scored: Scored) -> list[tuple[Candidate, Prepared]]:
    """Candidates to be refitted, with their windows and start values."""
    short = [one for candidate in list(scored.significant.values())[:_SHORT_LIST] for one in _starts(candidate, scored)]
    weight = scored.fitted.variances.weight
    resist = float(np.mean(weight < 0.2 * np.median(weight))) >= _BAD
    listed = {one.name for one in short}
    stops = [one for one in scored.found if one.members[0].probe.is_stop and one.name not in listed][:_STOPS] if resist else []
    shown = [one for one in scored.found if is_recorded(one.members[0], scored.scales) and one.name not in listed]
    begun = [(one, _extended(one, scored)) for one in [*short, *stops, *shown]]
    return [*begun, *(from_loops(scored) if resist or stops else [])]


def _starts(candidate: Candidate, scored: Scored) -> list[Candidate]:
    """The candidate, and further candidates of its effect as alternative starts, as many as its probe has `starts`."""
    others = [one for one in scored.found if one.name == candidate.name and 0.0 < one.gain < candidate.gain]
    return [candidate, *others[: candidate.members[0].probe.starts - 1]]


def _extended(candidate: Candidate, scored: Scored) -> Prepared:
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
