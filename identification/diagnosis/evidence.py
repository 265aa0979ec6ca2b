"""Evidence for an effect, from fitted models and what they predict; `decide` weighs it."""

import dataclasses

import numpy as np

from identification.diagnosis.decide import Evidence, decide
from identification.diagnosis.left_out import LeftOut, errors_of, left_out
from identification.diagnosis.scores import Scored
from identification.diagnosis.search import Alternative
from identification.experiment import Experiment
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted
from identification.trajectory.variances import is_largest
from vibrojax.effects import AbstractEffect

Free = tuple[tuple[Scored, Reestimated, float], ...]
"""Free forms with all variances estimated anew, and their gains, the best first."""

NOT_CONVERGED = "its fit has not converged"
_BEYOND = 1e6
"""Gain where one of two models cannot follow a record at all."""


class Judge:
    """Decides on effects one by one; what a model predicts of the records left out is worked out once."""

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._known: list[LeftOut] = []

    def left_out(self, fitted: Fitted) -> LeftOut:
        """What a model predicts of what was left out."""
        known = next((one for one in self._known if one.fitted is fitted), None)
        if known is None:
            known = left_out(fitted, self._experiment)
        others = [one for one in self._known[1:] if one is not known]
        if not (self._known and known is self._known[0]):  # the nominal model and the latest: each holds its equations
            self._known = [*self._known[:1], *others[-2:], known]
        return known

    def errors(self, before: Fitted, after: Fitted) -> tuple[float, float]:
        """Of two models on what was left out; brief ones where the second is shaken."""
        was, is_now = self.left_out(before), self.left_out(after)
        return errors_of(was, is_now, brief=is_now.is_shaken)

    def held_back_gain(self, before: Fitted, after: Fitted) -> float:
        """Gain of twice the log predictive density of the records held back; 0 without any, or where neither model can follow them.

        Numbers that every record has of its own are fitted to those too, and cost 2 each (Akaike).
        """
        held_back = len(self._experiment.held_back)
        if not held_back:
            return 0.0
        densities = [self.left_out(one).density + 2.0 * held_back * int(one.problem.border.own_strengths.sum()) for one in (before, after)]
        return float(np.clip(densities[0] - densities[1], -_BEYOND, _BEYOND)) if np.isfinite(densities).any() else 0.0

    def with_held_back(self, before: Fitted, one: Alternative) -> Alternative:
        """A fitted alternative with its gain on the records held back."""
        assert one.fitted is not None, "a candidate is judged once it is fitted"
        gain = self.held_back_gain(before, one.fitted) if one.fitted.converged and one.best > 0.0 else 0.0
        return dataclasses.replace(one, held_back=gain)

    def __call__(self, before: Fitted, one: Alternative, no_worse_than: Fitted | None = None) -> Alternative:
        """A fitted alternative with the reason why it is not taken in beside a model; empty where it is.

        Beside a random force as large as it may be more is missing: no fit that has converged is refused yet, the rule is asked at the end.

        Args:
            before: model without it.
            one: the alternative.
            no_worse_than: model whose error on what was left out it may reach, where that exceeds the error before; any error, where the
                model before has a random force as large as it may be, beside which its parameters mean little.
        """
        assert one.fitted is not None, "a candidate is judged once it is fitted"
        if not one.fitted.converged:
            return dataclasses.replace(one, refused=NOT_CONVERGED)
        unfinished = is_largest(one.fitted.problem, one.fitted.variances.force)
        if unfinished:
            return dataclasses.replace(one, refused="")
        evidence = self._of_effect(before, one, one.fitted)
        errors = evidence.errors
        if errors is not None and no_worse_than is not None:
            says_little = is_largest(before.problem, before.variances.force)
            allowed = np.inf if says_little else float(np.fmax(errors[0], self.errors(no_worse_than, one.fitted)[0]))
            evidence = dataclasses.replace(evidence, errors=(allowed, errors[1]))
        return dataclasses.replace(one, refused=decide(evidence), errors=errors)

    def why_not(self, before: Fitted, one: Alternative, after: Fitted, free: Free, forms: int) -> str:
        """Why an effect is not asserted; empty where it is.

        Args:
            before: model without it.
            one: the effect, with its gain.
            after: model with it, and perhaps with more.
            free: forms beside that model.
            forms: of how many they are the best.
        """
        evidence = self._of_effect(before, one, after)
        if free:
            form, left = free[0][0].candidate, free[0][2]
            evidence = dataclasses.replace(evidence, left=left, left_degrees=len(form.signals), forms=forms * form.tried)
        return decide(evidence)

    def _of_effect(self, before: Fitted, one: Alternative, after: Fitted) -> Evidence:
        """Evidence of an effect by two models; nothing is left over as yet."""
        effect = next(each for each in after.problem.model_at(after.at).effects if each.name == one.name)
        evidence, size = self.evidence(before, after, one.best, one.degrees, one.tried), strength(after, effect)
        evidence = dataclasses.replace(evidence, strength=size, drives=drives(after, effect, size))
        if effect.record is not None:  # of one that acts in a single record the others say nothing
            evidence = dataclasses.replace(evidence, held_out=None, errors=None)
        return evidence

    def evidence(self, before: Fitted, after: Fitted, gain: float, degrees: int, tried: int, *, in_turn: bool = True) -> Evidence:
        """Of an effect or a free form, by what the models before and after it predict; free forms are not compared yet.

        Args:
            before: model without it.
            after: model with it.
            gain: as in `Evidence`.
            degrees: as in `Evidence`.
            tried: as in `Evidence`.
            in_turn: whether records left out in turn count where none is held back.
        """
        held_out = errors = None
        if in_turn or self._experiment.held_back:
            was, is_now = self.left_out(before), self.left_out(after)
            held_out = self.held_back_gain(before, after) if self._experiment.held_back else was.density - is_now.density
            errors = None if np.isnan(errors := self.errors(before, after)).all() else errors  # no channel has signal there
        return Evidence(gain=gain, degrees=degrees, tried=tried, held_out=held_out, errors=errors)


def drives(fitted: Fitted, effect: AbstractEffect, size: float) -> float:
    """By how many standard errors an effect that can only brake the motion would drive it beside the suspension's damping; 0 for none.

    Args:
        fitted: the model with it.
        effect: in that model.
        size: its strength over the standard error.
    """
    values, needed = fitted.problem.values(fitted.at), float(effect.damping_needed)
    mass = float(values.get("m", fitted.problem.experiment.mass))
    damping = 4.0 * np.pi * values.get("zeta", 0.0) * values.get("f_n", 0.0) * mass
    if not needed > damping:
        return 0.0
    error = damping * fitted.stderr[fitted.problem.unknowns.index("zeta")] if damping > 0.0 else 0.0
    return float((needed - damping) / max(np.hypot(needed / size, error), 1e-300))


def strength(fitted: Fitted, effect: AbstractEffect) -> float:
    """Strength of an effect over its standard error, of the part or record in which that is largest.

    Exponents, places and the like are held beside it: of an effect without strength they mean nothing, and a coefficient of N/m^n has the
    error of n a metre deep. Its other strengths are not.
    """
    problem, unknowns = fitted.problem, fitted.problem.unknowns
    nothing, twice, found = effect.scaled(0.0), effect.scaled(2.0), []
    covariance, scale = fitted.solution.covariance, problem.border.shared_scale
    strengths = [p for p in effect.parameters if not p.searched and float(getattr(twice, p.field)) != float(getattr(effect, p.field))]
    others = [unknowns.index(f"{effect.name}.{p.name}") for p in effect.parameters if not p.per_record and p not in strengths]
    for p in effect.parameters:
        full = f"{effect.name}.{p.name}"
        if p.per_record:
            place = unknowns.own.index(full)
            error = fitted.solution.own_error[:, place] * problem.border.own_scale[place]
            found.append(float(np.max(np.abs(fitted.at.own[:, place]) / np.maximum(error, 1e-300))))
        elif p in strengths:
            index = unknowns.index(full)
            moved = 1.0 if p.logarithmic else abs(float(fitted.at.shared[index])) - abs(float(getattr(nothing, p.field)))
            size = np.sqrt(np.maximum(covariance[others, others], 1e-300))
            across, alone = covariance[index, others] / size, covariance[np.ix_(others, others)] / np.outer(size, size)
            variance = covariance[index, index] - across @ np.linalg.pinv(alone, rcond=1e-12) @ across
            found.append(abs(moved) / max(float(np.sqrt(max(variance, 0.0)) * scale[index]), 1e-300))
    return max(found, default=np.inf)
