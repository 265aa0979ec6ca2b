"""One call from an experiment to a diagnosis: what the nominal model leaves out, if anything."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from identification.discrepancy.assertion import asserted, considered, twins
from identification.discrepancy.bend import bend
from identification.discrepancy.constancy import unsteady
from identification.discrepancy.continuity import apart
from identification.discrepancy.diagnosis import ADEQUATE, MISSING, UNLISTED, Asserted, Diagnosis, Location, Side
from identification.discrepancy.disagreement import disagreements
from identification.discrepancy.errors import degrees, numbers
from identification.discrepancy.evidence import significant
from identification.discrepancy.explanation import Explanation, explanation
from identification.discrepancy.held_out import SIGNAL, HeldOut, held_out
from identification.discrepancy.locate import locate
from identification.discrepancy.look import Scored
from identification.discrepancy.next_experiment import next_experiment
from identification.discrepancy.refit import Fitted
from identification.discrepancy.refutation import refutation
from identification.discrepancy.restitution import lost_in_contacts
from identification.discrepancy.robust import Tolerance, robust_fit, tolerance
from identification.discrepancy.search import BUDGET, DRIFTING, MOST_EFFECTS, Search
from identification.discrepancy.steadiness import steady_search
from identification.discrepancy.tolerant_fit import fit_tolerantly
from identification.discrepancy.verdict import nearest, sentences
from identification.experiment import Experiment
from identification.fit import bounds, evaluator, fit, free_unknowns, integrator_for
from identification.held_back import held_back_fits
from identification.levenberg_marquardt import LevenbergMarquardt
from identification.prepare import Prepared, prepare
from identification.records import record_fits
from identification.result import RecordFit
from identification.settling import settled_gradually
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
_MILD = 10.0
"""Reduced chi-square up to which the ordinary fit is a sound place to search from."""
_BLIND, _CLEARER = 0.5, 0.8
"""NRMSE of a tolerant fit above which it overlooks the motion itself, and that of the ordinary fit over it below which this does not."""
_TOLERANT = (
    "the ordinary fit of the nominal model did not settle inside the ranges of its parameters and near the records; it was fitted"
    " tolerantly on short windows, and both models are shown on these"
)
_ENDED = {
    BUDGET: "the budget ended the search before all was explained: what is said here may not be all, allow more minutes",
    MOST_EFFECTS: "the search stopped after as many effects as it adds to one model, before all was explained: more may be missing",
    DRIFTING: "no listed effect was fitted: a parameter that changes in the course of records explains far more than any of them promises",
}
_IN_PART = (
    "more than noise is left, and neither a further listed effect nor a learned term explains it: a rig that does not repeat itself looks"
    " so; the parameters may be off by more than their errors"
)
_TRIFLE = "beside that, too little to be told from what the named effect's own equation leaves"
_NO_EVIDENCE = "promised more than white noise would, but does not hold it once fitted, or no more than noise that remembers would"
_STANDS_IN = "would lower the misfit, but with a strength that differs between records or that these do not tell, and is not considered"
_MIMICS = "would lower the misfit, but {0} then still changes in the course of records, which alone explains much of it: not named"
_MOST_ITERATIONS = 15
_APART = 200.0
"""Mean squared jump from one short window to the next, in standard errors, above which they have forgiven what the model lacks. An effect
that is right, but not to the last digit, leaves some ten."""
_CUT = 25.0
"""Mean squared residual, in variances of the noise, from which a long window loses weight."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Ground:
    """Where the search starts."""

    fitted: Fitted
    allowed: Tolerance
    sound: bool
    """Whether that is on the ordinary windows, not on short ones."""


class _Course:
    """Seconds by stage, and when to begin no further step."""

    def __init__(self, budget_minutes: float, progress: Progress) -> None:
        self.seconds: dict[str, float] = {}
        self.progress = progress
        self.deadline = time.monotonic() + 60.0 * budget_minutes

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what happens inside."""
        begin = time.monotonic()
        yield
        self.seconds[name] = time.monotonic() - begin


def diagnose_experiment(
    experiment: Experiment, *, law: str | None = None, budget_minutes: float = 5.0, progress: Progress = lambda stage: None
) -> Diagnosis:
    """Fit the nominal model, and say what it leaves out. Nothing in it is drawn at random.

    Arguments:
        experiment: as loaded.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        budget_minutes: no new search step is begun after so long; the verdict then says that the search was cut short.
        progress: told each stage by a line of text.

    Raises:
        NoConvergenceError: not even the tolerant fit on short windows can be integrated.
    """
    course = _Course(budget_minutes, progress)
    with course.stage("nominal"):
        ground = _ground(experiment, law, progress)
    with course.stage("search"):
        found = steady_search(ground.fitted, ground.allowed, course.deadline, progress)
    if not ground.sound and found.explained and apart(found.fitted) > _APART:
        with course.stage("nominal, longer windows"):
            longer = _longer(experiment, law, ground, progress)
        with course.stage("search, longer windows"):
            again = steady_search(longer.fitted, longer.allowed, course.deadline, progress)
        cut_short = again.ended == BUDGET
        ground, found = (ground, dataclasses.replace(found, cut_short=True)) if cut_short else (longer, again)
    return _concluded(experiment, ground, found, course)


def _ground(experiment: Experiment, law: str | None, progress: Progress) -> _Ground:
    """The ordinary fit if it is sound, else a tolerant one on short windows, unless that overlooks what the ordinary one describes."""
    progress("reading first guesses from the records")
    prepared = prepare(experiment, law=law)
    progress("fitting the nominal model")
    nominal = ordinary(prepared)
    if nominal is not None and nominal.chi2 / degrees(nominal) <= _MILD:
        allowed = dataclasses.replace(tolerance(prepared, nominal.outcome.equations.cost), cut=_CUT)
        return _Ground(fitted=nominal, allowed=allowed, sound=True)
    progress("fitting the nominal model to short windows")
    fitted, allowed = robust_fit(prepared)
    if nominal is not None and overlooks(_rms_nrmse(_fits(fitted)), _rms_nrmse(_fits(nominal))):
        return _Ground(fitted=nominal, allowed=tolerance(prepared, nominal.outcome.equations.cost), sound=True)
    return _Ground(fitted=fitted, allowed=allowed, sound=False)


def overlooks(tolerant: float, ordinary: float) -> bool:
    """Whether a tolerant fit, though on short windows, describes little of the motion and an ordinary one clearly more, by their NRMSE.

    Where a model is wrong everywhere, and the more so the larger the motion, the windows that resist are those that matter.
    """
    return tolerant > _BLIND and ordinary < _CLEARER * tolerant


def _longer(experiment: Experiment, law: str | None, short: _Ground, progress: Progress) -> _Ground:
    """The ordinary windows, fitted from where the short ones ended: what these forgive, a slow force say, longer ones may not."""
    progress("fitting the nominal model to longer windows")
    prepared, found = prepare(experiment, law=law), short.fitted.outcome.estimate
    start = dataclasses.replace(prepared.start, shared=found.shared, nuisances=found.nuisances)
    estimate, cost = settled_gradually(dataclasses.replace(prepared, start=start), integrator_for(prepared))
    allowed = dataclasses.replace(tolerance(prepared, cost), cut=_CUT)
    fitted = fit_tolerantly(dataclasses.replace(prepared, start=estimate), allowed)
    return short if fitted is None else _Ground(fitted=fitted, allowed=allowed, sound=True)


def ordinary(prepared: Prepared) -> Fitted | None:
    """The nominal model on long windows, as an ordinary fit has it; None where that does not settle inside its bounds.

    A fit that is slow and far away is given up early; one that has come near may take its time.
    """
    try:
        fitted = Fitted(prepared=prepared, outcome=fit(prepared, method=LevenbergMarquardt(most_iterations=_MOST_ITERATIONS)))
    except NoConvergenceError:
        return None
    if not fitted.outcome.converged and fitted.chi2 / degrees(fitted) <= _MILD:
        evaluate, active = evaluator(prepared, integrator_for(prepared)), free_unknowns(prepared)
        outcome = LevenbergMarquardt()(evaluate, fitted.outcome.estimate, active, bounds(prepared))
        fitted = dataclasses.replace(fitted, outcome=outcome)
    (low, high), shared = bounds(prepared), fitted.outcome.estimate.shared
    inside = np.all((shared > low) & (shared < high) | ~free_unknowns(prepared).shared)
    return fitted if fitted.outcome.converged and inside else None


def _concluded(experiment: Experiment, ground: _Ground, found: Search, course: _Course) -> Diagnosis:
    """The verdict and its evidence."""
    start, allowed, progress = found.first.fitted, ground.allowed, course.progress
    with course.stage("model"):
        cause = explanation(start, found, allowed, progress=progress)
    with course.stage("evidence"):
        progress("predicting windows left out of the fit")
        predicted = _Predicted(allowed)
        shown_before = _side(start, allowed, experiment, predicted)
        shown_after = shown_before if cause.fitted is start else _side(cause.fitted, allowed, experiment, predicted)
        refuted = "" if found.explained else refutation(cause, shown_before, shown_after)
        if refuted:
            cause, shown_after = Explanation(verdict=UNLISTED, fitted=start), shown_before
        verdict, after = cause.verdict, cause.fitted
        named = asserted(found, after, shown_after.parameters, allowed) if verdict == MISSING else ()
        ambiguous = twins(found.rounds, tuple(one.effect.name for one in named), dispersion=found.dispersion(allowed))
        location = _location(found.first, start, named, verdict)
        rows = considered(found, allowed, predicted)
        advice = next_experiment(found, ambiguous, allowed)
        lost = lost_in_contacts(location, shown_before) if verdict == UNLISTED else None
        said = sentences(verdict, named, ambiguous, location, shown_before, shown_after, cause.formula, cause.share, found.mimics, lost)
        said = (*said, *_nearest(found, allowed)) if verdict == UNLISTED else said
    return Diagnosis(
        experiment=experiment,
        verdict=verdict,
        sentences=said,
        effects=named,
        free_form=cause.formula,
        ambiguous_with=ambiguous,
        location=location,
        considered=rows,
        nominal=shown_before,
        augmented=shown_after,
        next_experiment=advice,
        warnings=_warnings(ground, found, cause, shown_after, refuted),
        seconds=course.seconds,
    )


def _nearest(found: Search, allowed: Tolerance) -> tuple[str, ...]:
    """What is told of several effects that would leave next to nothing but noise, none of which is asserted."""
    if found.nearest is None:
        return ()
    named = asserted(found, found.nearest, numbers(found.nearest, allowed), allowed)
    return (nearest(named, unsteady(found.nearest, allowed)),)


def _warnings(ground: _Ground, found: Search, cause: Explanation, side: Side, refuted: str) -> tuple[str, ...]:
    """What the reader must know beside the verdict."""
    after = cause.fitted
    said = [refuted] if refuted else []
    said += [] if ground.sound else [_TOLERANT]
    if found.without:
        said.append(f"{' and '.join(found.without)} {_STANDS_IN}")
    if found.mimics is not None and found.fitted.names:
        restless = next(p.symbol for p in side.parameters if p.name == found.mimics.name)
        said.append(f"{' and '.join(found.fitted.names)} {_MIMICS.format(restless)}")
    if found.cut_short and found.ended != BUDGET:
        said.append(_ENDED[BUDGET])
    if found.ended in _ENDED:
        said.append(_ENDED[found.ended])
    elif cause.share < 1.0:
        said.append(_IN_PART)
    if not after.outcome.converged:
        said.append("the last fit stopped before it had converged: its numbers may still move by more than their errors")
    held = after.prepared.fixed
    if lost := [p.symbol for p in side.parameters if p.stderr is None and p.name not in held]:
        said.append(f"without an error, at the edge of their range or not identifiable from these records: {', '.join(lost)}")
    if found.explained and (left := significant(found.last.found)):
        most = max(left.values(), key=lambda one: one.gain)
        words = f"{most.name} (chi-square {most.gain:.3g} of {2.0 * ground.allowed.total(ground.fitted.outcome.equations.cost):.3g})"
        said.append(f"{_TRIFLE if found.fitted.names else _NO_EVIDENCE}: {words}")
    return tuple(said)


class _Predicted:
    """What each model predicts of windows left out of its fit, worked out once."""

    def __init__(self, allowed: Tolerance) -> None:
        self._allowed = allowed
        self._known: dict[int, tuple[Fitted, HeldOut]] = {}

    def __call__(self, fitted: Fitted) -> HeldOut:
        if id(fitted) not in self._known:
            self._known[id(fitted)] = fitted, held_out(fitted, self._allowed)
        return self._known[id(fitted)][1]


def _side(fitted: Fitted, allowed: Tolerance, experiment: Experiment, predicted: _Predicted) -> Side:
    """A model beside the records, with its errors; and beside those that were held back."""
    unseen = held_back_fits(experiment, fitted.model)
    return Side(
        model=fitted.model,
        parameters=numbers(fitted, allowed),
        chi2_reduced=2.0 * allowed.total(fitted.outcome.equations.cost) / degrees(fitted),
        held_out_nrmse=_rms_nrmse(unseen) if unseen else predicted(fitted).nrmse,
        records=_fits(fitted),
        disagreements=disagreements(fitted, allowed),
        held_back=unseen,
    )


def _fits(fitted: Fitted) -> tuple[RecordFit, ...]:
    """Every record beside the model, as it was fitted."""
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    return record_fits(prepared, integrator_for(prepared), estimate, np.full(estimate.nuisances.shape, np.nan))


def _rms_nrmse(records: tuple[RecordFit, ...]) -> float:
    """Over all channels that hold more than noise; a prediction that broke off counts as one that knows nothing."""
    errors = [error for record in records for channel, error in record.nrmse.items() if _has_signal(record, channel)]
    return float(np.sqrt(np.mean(np.nan_to_num(errors, nan=1.0, posinf=1.0) ** 2))) if errors else float("nan")


def _has_signal(record: RecordFit, channel: str) -> bool:
    """Whether there is anything in a channel to predict."""
    return bool(np.nanvar(record.measured[channel]) > SIGNAL * record.noise[channel] ** 2)


def _location(first: Scored, start: Fitted, named: tuple[Asserted, ...], verdict: str) -> Location | None:
    """Where the misfit of the nominal model sits; None where there is none."""
    if verdict == ADEQUATE:
        return None
    effects = [one.effect for one in named]
    effect = next((one for one in effects if one.record is not None), effects[0] if effects else None)
    found = locate(start.prepared, start.outcome.estimate, first.at, named=effect)
    if verdict == UNLISTED:
        return dataclasses.replace(found, bend=bend(first))
    if effect is not None and effect.record is not None:
        return dataclasses.replace(found, record=effect.record)
    return found
