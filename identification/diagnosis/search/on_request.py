"""Effects added on request, whether or not the records give evidence of them."""

import dataclasses
import math
from collections.abc import Callable, Sequence

from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.scored import Scored, score_all, trials
from identification.diagnosis.search.alternatives import started
from identification.diagnosis.search.among import among_effects
from identification.diagnosis.search.attempts import Progress, attempt, by_least_squares, to_the_end
from identification.likelihood.evidence import chance
from identification.likelihood.fitted import Fitted
from identification.result.result import Added
from identification.wording.numbers import joined
from vibrojax.errors import InputError, NoConvergenceError

_NOTHING = 1e-3
"""Strength, over that of the score test, from which a fit starts anew that has become worse with the effect."""


def extension(names: Sequence[str]) -> Callable[[Fitted, Progress], tuple[Fitted, Added]] | None:
    """From the fitted nominal model to one with these effects, fitted, and what they gain; None without a name.

    Raises:
        InputError: an unknown name, or a single text in place of several names.
    """
    among_effects(only=names)
    known = tuple(dict.fromkeys(names))
    return (lambda model, progress: with_effects(model, known, progress)) if known else None


def with_effects(nominal: Fitted, names: Sequence[str], progress: Progress = lambda stage: None) -> tuple[Fitted, Added]:
    """The fitted model with effects, added in the order of `names`, each refitted with all other parameters, and what they gain.

    Of the candidates of an effect (frequencies, channels, records), that with the largest expected gain is the start. The gain compares
    fits on the same windows; the final fit may be on longer ones.

    Raises:
        InputError: an effect has nothing to act on in these records.
        NoConvergenceError: the model cannot be fitted with the effects.
    """
    model, possibilities, places = nominal, 1, []
    for name in names:
        progress(f"fitting {name} beside {model.title}")
        scored = score_all(model, (name,))
        if not scored.found:
            raise InputError(f"{name} has nothing to act on in these records, which hold {joined(model.point.at.channels)}: leave it out")
        best = max(scored.found, key=lambda one: one.gain)
        places.append(best.members[0].channel or best.members[0].record or "")
        possibilities *= trials(scored.found, name)
        model = _fitted(best, scored, progress)
    progress(f"fitting {model.title} to the end")
    final = to_the_end(model)
    if final is None:
        raise NoConvergenceError(f"the model with {joined(names)} diverges on windows of ordinary length: leave an effect out")
    gain, numbers = model.log_likelihood - nominal.log_likelihood, max(model.unknowns - nominal.unknowns, 1)
    added = Added(
        names=tuple(names),
        places=tuple(places),
        gain=gain,
        chance=chance(2.0 * gain, numbers, possibilities),
        bic=model.criterion - nominal.criterion,
        held_back=None,
    )
    return final, added


def _fitted(candidate: Candidate, scored: Scored, progress: Progress) -> Fitted:
    """The model with one more effect; where that is less likely than without, also from nearly no strength, and the better of both."""
    found = attempt(started(candidate, scored), scored.fitted.variances, rounds=3)
    if found is not None and not found.converged:
        found = by_least_squares(found, progress)
    if found is None or found.log_likelihood < scored.fitted.log_likelihood:
        weak = dataclasses.replace(candidate, factors=_NOTHING * candidate.factors)
        again = attempt(started(weak, scored), scored.fitted.variances, rounds=3)
        fits = [one for one in (found, again) if one is not None and math.isfinite(one.log_likelihood)]
        found = max(fits, key=lambda one: one.log_likelihood, default=None)
    if found is None:
        raise NoConvergenceError(f"the model cannot be fitted with {candidate.name}: leave it out, or fit fewer effects")
    return found
