"""Forward search: score all candidates, refit the best few, add the one with the greatest evidence, and score again."""

import dataclasses
import time
from collections.abc import Collection

import numpy as np

from identification.diagnosis.calibration import ALPHA, MOST_EFFECTS, RELEVANT
from identification.diagnosis.free_form.free_form import Learned, learn, strongest_line
from identification.diagnosis.refit import without
from identification.diagnosis.relevance import share_added
from identification.diagnosis.score.scored import Scored, score_all, trials
from identification.diagnosis.search.alternatives import Alternative, fitted_in_full
from identification.diagnosis.search.among import SEARCHED
from identification.diagnosis.search.attempts import Progress, attempt, to_the_end
from identification.estimation.nominal import is_near
from identification.likelihood.evidence import chance
from identification.likelihood.fitted import Fitted
from identification.likelihood.random_effects import Variation, variations, with_variation

COMPLETE, MOST, BUDGET, FAILED = "no further effect is significant", "as many effects as are fitted together", "budget", "failed fit"


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


def search(start: Fitted, *, deadline: float, among: Collection[str] = SEARCHED, progress: Progress = lambda stage: None) -> Search:
    """Forward search: add effects to a model until no candidate is significant and relevant, or there are `MOST_EFFECTS`.

    Args:
        start: the nominal model, fitted.
        deadline: `time.monotonic()` after which no further step begins, and no further candidate is fitted.
        among: names of the effects that may be added.
        progress: called with a line of text at each stage.
    """
    steps: list[Step] = []
    model = start
    while True:
        progress(f"scoring all candidates beside {model.title}")
        scored = score_all(model, among)
        if len(model.names) >= MOST_EFFECTS:
            return Search(steps=tuple(steps), last=scored, refused=(), ended=MOST)
        if time.monotonic() > deadline:
            return Search(steps=tuple(steps), last=scored, refused=(), ended=BUDGET)
        varying, line_gain = _varying(model), strongest_line(scored)
        if varying is not None and varying.chi2 >= max(scored.largest_gain, line_gain):
            varied, varying = _with_variation(model, varying, progress), None
            if varied is not None:
                model = varied
                continue
        # an undamped mode with a phase of its own in every window resembles a sinusoidal force at a free frequency
        line = learn(scored, deadline=deadline, progress=progress) if line_gain > scored.largest_gain else None
        alternatives, cut = fitted_in_full(scored, line, deadline, progress)
        without_more = BUDGET if cut else COMPLETE
        if line is not None and not (alternatives and alternatives[0].fitted.criterion < line.fitted.criterion):
            return Search(steps=tuple(steps), last=scored, refused=tuple(alternatives), ended=without_more, learned=line)
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
            return Search(steps=tuple(steps), last=scored, refused=tuple(alternatives), ended=without_more)
        progress(f"fitting {alternatives[0].fitted.title} to the end")
        best = to_the_end(alternatives[0].fitted)
        if best is None:
            return Search(steps=tuple(steps), last=scored, refused=tuple(alternatives), ended=FAILED)
        steps.append(_kept(scored, alternatives))
        model = _lessened(best, start, deadline, progress)


def _varying(model: Fitted) -> Variation | None:
    """The parameter that varies most significantly between records; None where none does."""
    level = ALPHA / max(len(model.prepared.layout.parameters), 1)
    return next((one for one in variations(model) if one.chance < level and one.std > 0.0), None)


def _with_variation(model: Fitted, one: Variation, progress: Progress) -> Fitted | None:
    """The model with a random effect on a parameter; None where the fit does not lower the BIC."""
    progress(f"fitting {one.name} that varies between records beside {model.title}")
    found = attempt(with_variation(model, one), model.variances, rounds=3)
    if found is not None and not found.converged:
        found = attempt(found.continued, found.variances, rounds=3) or found
    return found if found is not None and found.criterion < model.criterion else None


def _lessened(model: Fitted, nominal: Fitted, deadline: float, progress: Progress) -> Fitted:
    """The model after backward elimination, until the deadline, of the earlier effects that the last one makes superfluous."""
    for name in model.names[:-1]:
        if time.monotonic() > deadline:
            break
        progress(f"fitting {model.title} without {name}")
        less = attempt(without(model, name), model.variances, rounds=3)
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
    again = attempt(dataclasses.replace(prepared, start=start), model.variances, rounds=1, iterations=6, settle=False)
    return model if again is None or again.log_likelihood < model.log_likelihood - 0.5 * np.log(ALPHA) else again
