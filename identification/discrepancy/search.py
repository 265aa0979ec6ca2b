"""The search: score everything, refit a short list, keep the best, and look again."""

import dataclasses
import time

import numpy as np

from identification.discrepancy.adequate import adequate
from identification.discrepancy.colour import overstatement
from identification.discrepancy.constancy import unsteady
from identification.discrepancy.continuity import states_cost, whole_cost
from identification.discrepancy.disagreement import BY_CHANCE
from identification.discrepancy.drift import MUCH, Drift, drifts
from identification.discrepancy.driven import rings_by_itself
from identification.discrepancy.evidence import FALSE_ALARM, chance, trials
from identification.discrepancy.free_form import Learned
from identification.discrepancy.linearised import linearised
from identification.discrepancy.look import Scored, look
from identification.discrepancy.placed import better_placed
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.short_list import HELPS, Progress, Rival, beyond_scores, rival_of, short_listed
from identification.discrepancy.tolerant_fit import fit_tolerantly, fitted_from, settled_like
from identification.discrepancy.tried import Tried
from identification.fit import integrator_for

EXPLAINED, HELPLESS, MOST_EFFECTS, BUDGET = "explained", "no further effect helps", "as many effects as are tried", "budget"
RESTLESS, DRIFTING, LEARNED = "the first effect will not hold still", "a parameter drifts", "a learned term explains all"
"""Why a search ended."""
_MOST_EFFECTS = 3
MOSTLY = 0.75
"""Share of the first misfit that effects must explain to be asserted, unless they leave noise exactly as stated."""
_AS_STATED = 0.01
"""Chance of noise as stated being found more than noise."""
_BETTER = 8.0
"""Drop of the cost, half chi-square, below which a model fitted anew is no other."""
_FAR_MORE = 4.0
"""What a drift explains over what any candidate promises from which none of them is tried."""
_REST, _TOO_LITTLE = 0.01, 0.001
"""Shares of the first misfit: what may be left, because an effect is never modelled to the last digit, and what is put down to that."""
_PLAIN, _OF_IT, _NEARLY = 0.5, 0.5, 0.05
"""What is left over noise, and the share of that which an effect must promise, to be tried however little it is beside the first misfit;
and the share that it may leave."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Round:
    """One step of the forward search."""

    scored: Scored
    cost: float
    rivals: tuple[Rival, ...]
    """Best first."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Search:
    """What the search went through, and where it ended."""

    rounds: tuple[Round, ...]
    fitted: Fitted
    last: Scored
    ended: str
    """`EXPLAINED`, `HELPLESS`, `MOST_EFFECTS`, `RESTLESS`, `DRIFTING`, `LEARNED` or `BUDGET`."""
    without: tuple[str, ...] = ()
    """Names of effects that were not to be tried."""
    cut_short: bool = False
    """Whether the budget ended another search, for what may stand in the place of what this one found."""
    mimics: Drift | None = None
    """A parameter that changes in the course of records, which is what the effects stand in for, or would."""
    doubted: Fitted | None = None
    """The several effects that it takes to explain all, where one of them does not hold still."""
    nearest: Fitted | None = None
    """The first such ones that were met."""
    learned: Learned | None = None
    """A term free in its form, beside the first model, where the effects do not explain all."""

    @property
    def first(self) -> Scored:
        """The look at the nominal model."""
        return self.rounds[0].scored if self.rounds else self.last

    @property
    def explained(self) -> bool:
        """Whether nothing but noise is left, or a trifle beside what has been explained, and by a cause."""
        return self.ended == EXPLAINED and self.mimics is None and self.doubted is None

    @property
    def stages(self) -> tuple[Fitted, ...]:
        """The model after each round; the last as it was fitted in the end."""
        return (*(one.rivals[0].fitted for one in self.rounds[:-1]), self.fitted) if self.rounds else ()

    def share(self, fitted: Fitted, allowed: Tolerance) -> float:
        """Of the first misfit beyond noise, what the effects of one of the stages explain; there is one at least."""
        first = self.rounds[0]
        torn = states_cost(fitted) / max(first.cost - allowed.noise, 1e-300)
        return max(allowed.explained(first.scored.fitted.outcome.equations.cost, fitted.outcome.equations.cost) - torn, 0.0)

    def dispersion(self, allowed: Tolerance) -> float:
        """What is left over what noise alone would leave, 1 where all is explained: differences of cost count so much less."""
        return 1.0 if self.explained else max(1.0, whole_cost(self.fitted, allowed) / allowed.noise)


def search(
    start: Fitted,
    allowed: Tolerance,
    deadline: float,
    progress: Progress = lambda stage: None,
    *,
    begun: tuple[Round, ...] = (),
    without: tuple[str, ...] = (),
    most_effects: int = _MOST_EFFECTS,
    tried: Tried | None = None,
) -> Search:
    """Add effects to a model until nothing but noise is left, or none of them helps any more.

    Goes on from the rounds that have `begun`, does not try the effects that it is to do `without`, and does not fit again what has been
    `tried`.
    """
    tried = Tried() if tried is None else tried
    rounds = list(begun)
    fitted = rounds[-1].rivals[0].fitted if rounds else start
    while True:
        progress(f"scoring all candidates beside {fitted.title}")
        scored = look(fitted, allowed, without=without)
        cost = whole_cost(fitted, allowed)
        ended = why_ended(scored, allowed, rounds, deadline, most_effects=most_effects)
        mimics = None if ended or rounds or scored.known.lags else drifting(scored, cost - allowed.noise, allowed)
        ended = ended or (DRIFTING if mimics else "")
        trifle = ended == EXPLAINED and _trifle(scored, allowed, rounds, deadline, most_effects)
        rivals = [] if ended and not trifle else short_listed(scored, allowed, progress, tried)
        anew = fitted_from(fitted, rivals[0].fitted, allowed) if rivals else fitted
        if anew is not fitted and cost - whole_cost(anew, allowed) >= max(HELPS * (cost - allowed.noise), _BETTER):
            fitted = anew
            continue
        if rivals and (settled := settled_like(fitted, rivals[0].fitted)) is not fitted:
            fitted, cost = settled, min(cost, whole_cost(settled, allowed))
            at = linearised(fitted.prepared, integrator_for(fitted.prepared), fitted.outcome.estimate)
            scored = dataclasses.replace(scored, fitted=fitted, at=at)
        helps = bool(rivals) and _helps(rivals[0], cost, scored, allowed)
        if not ended and not helps:
            ended = EXPLAINED if leaves_noise(fitted, allowed, rounds) else HELPLESS
        if ended and not (trifle and helps and _completes(rivals[0].fitted, scored, allowed, without)):
            return Search(rounds=tuple(rounds), fitted=fitted, last=scored, ended=ended, without=without, mimics=mimics)
        rounds.append(Round(scored=scored, cost=cost, rivals=tuple(rivals)))
        fitted = rivals[0].fitted


def reopened(one: Round, allowed: Tolerance, *, without: tuple[str, ...]) -> tuple[Round, ...]:
    """The round as it ends without some effects, the next that helps fitted in full; none where no other one helps."""
    rivals = tuple(rival for rival in one.rivals if rival.name not in without)
    if not rivals or not _helps(rivals[0], one.cost, one.scored, allowed):
        return ()
    best, *others = rivals  # that may have been fitted in short
    if (fitted := fit_tolerantly(best.prepared, allowed)) is not None:
        if rings_by_itself(fitted, one.scored.courses):
            return ()
        best = rival_of(best.candidate, better_placed(fitted, one.scored.known, allowed), allowed)
    return (dataclasses.replace(one, rivals=(best, *others)),)


def why_ended(scored: Scored, allowed: Tolerance, rounds: list[Round], deadline: float, *, most_effects: int = _MOST_EFFECTS) -> str:
    """Why no further effect is tried; empty where one is."""
    if _explained(scored, allowed, rounds):
        return EXPLAINED
    if not scored.significant and not beyond_scores(scored, []):
        return EXPLAINED if leaves_noise(scored.fitted, allowed, rounds) else HELPLESS
    if len(scored.fitted.names) >= most_effects:
        return MOST_EFFECTS
    if len(rounds) > 1 and _never_still(rounds, allowed):
        return RESTLESS
    return BUDGET if time.monotonic() > deadline else ""


def _trifle(scored: Scored, allowed: Tolerance, rounds: list[Round], deadline: float, most_effects: int) -> bool:
    """Whether beside what explains all but a trifle of the misfit another effect promises more than `_TOO_LITTLE`, and may be tried.

    Or less than that, but most of what is left plainly above the noise: the first misfit may be a thousand times as large.
    """
    if not rounds or len(scored.fitted.names) >= most_effects or time.monotonic() > deadline:
        return False
    promised, plainly = _most_promised(scored), _plainly_left(scored, allowed)
    most_of_it = plainly > 0.0 and promised > _OF_IT * 2.0 * plainly
    return most_of_it or promised > _TOO_LITTLE * 2.0 * _first_misfit(rounds, allowed)


def _plainly_left(scored: Scored, allowed: Tolerance) -> float:
    """What is left beyond noise, half chi-square, if that is much beside the noise; else 0."""
    left = whole_cost(scored.fitted, allowed) - allowed.noise
    return left if left > _PLAIN * allowed.noise else 0.0


def _completes(fitted: Fitted, before: Scored, allowed: Tolerance, without: tuple[str, ...]) -> bool:
    """Whether all hold still, and nothing is left that any effect would explain: asked of an effect that is there for a trifle.

    A trifle may also be what the equation of the first one lacks of its cause, and a part of that is all that a wrong one explains. Of
    what was left plainly, nearly all is enough.
    """
    if unsteady(fitted, allowed):
        return False
    plainly = _plainly_left(before, allowed)
    if plainly > 0.0 and whole_cost(fitted, allowed) - allowed.noise < _NEARLY * plainly:
        return True
    return adequate(fitted, allowed) and not look(fitted, allowed, without=without).significant


def _never_still(rounds: list[Round], allowed: Tolerance) -> bool:
    """Whether the first effect neither held still when it came in nor does beside the last: a third would not make it the cause."""
    first, last = rounds[0].rivals[0], rounds[-1].rivals[0]
    return all(first.name in unsteady(fitted, allowed) for fitted in (first.fitted, last.fitted))


def drifting(scored: Scored, misfit: float, allowed: Tolerance) -> Drift | None:
    """The parameter whose change in the course of records explains much of the misfit (half chi-square), and far more than any candidate.

    What drifts has nothing to do with what the list holds, and to fit its effects one beside the other is long and in vain.
    """
    least = max(MUCH * 2.0 * misfit, _FAR_MORE * _most_promised(scored))
    found = [one for one in drifts(scored.fitted, allowed) if one.gain > least and one.chance < BY_CHANCE]
    return max(found, key=lambda one: one.gain, default=None)


def _helps(best: Rival, cost: float, scored: Scored, allowed: Tolerance) -> bool:
    """Whether the refit delivers more than noise would, be it coloured, and a fair share of the misfit."""
    drop, misfit = cost - best.cost, cost - allowed.noise
    by_chance = chance(2.0 * drop / _overstated(best.fitted, scored, allowed), best.candidate.degrees, trials(scored.found, best.name))
    return by_chance < FALSE_ALARM and drop >= HELPS * misfit


def _overstated(fitted: Fitted, scored: Scored, allowed: Tolerance) -> float:
    """Factor that coloured noise puts on the drop of chi-square; 1 where more than noise is left, whose colour is then that of a misfit."""
    if not adequate(fitted, allowed):
        return 1.0
    at = linearised(fitted.prepared, integrator_for(fitted.prepared), fitted.outcome.estimate)
    whole = (at.finite & scored.at.finite)[:, None, None]
    root = np.sqrt(allowed.weights(fitted.outcome.equations.cost))[:, None, None] * whole
    return overstatement(root * scored.at.residual, root * at.residual)


def _explained(scored: Scored, allowed: Tolerance, rounds: list[Round]) -> bool:
    """Whether what is left is noise, or a trifle beside what has been explained."""
    misfit = whole_cost(scored.fitted, allowed) - allowed.noise
    first = _first_misfit(rounds, allowed)
    return (leaves_noise(scored.fitted, allowed, rounds) or misfit < _REST * first) and _most_promised(scored) <= _REST * 2.0 * first


def leaves_noise(fitted: Fitted, allowed: Tolerance, rounds: list[Round]) -> bool:
    """Whether a model is adequate, and not only because its first misfit was hardly larger than what a noise figure may be off by."""
    if not adequate(fitted, allowed):
        return False
    if not rounds:
        return True
    left = whole_cost(fitted, allowed) - allowed.noise
    return left <= (1.0 - MOSTLY) * _first_misfit(rounds, allowed) or adequate(fitted, allowed, allowance=0.0, chance=_AS_STATED)


def _first_misfit(rounds: list[Round], allowed: Tolerance) -> float:
    """Of the nominal model, half chi-square beyond noise; 0 before the first round."""
    return max(rounds[0].cost - allowed.noise, 0.0) if rounds else 0.0


def _most_promised(scored: Scored) -> float:
    """The largest drop of chi-square that a significant candidate promises; 0 without one."""
    return max((candidate.gain for candidate in scored.significant.values()), default=0.0)
