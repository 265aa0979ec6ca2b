"""One call from an experiment to a diagnosis: what the nominal model leaves out, if anything."""

import dataclasses
import time
from collections.abc import Callable

import numpy as np

from identification.adequacy import OVERALL, chi2_limit
from identification.discrepancy.assertion import active_of, asserted, considered, numbers, twins
from identification.discrepancy.diagnosis import ADEQUATE, MISSING, UNLISTED, Asserted, Diagnosis, Location, Side
from identification.discrepancy.free_form import learn
from identification.discrepancy.held_out import held_out
from identification.discrepancy.locate import locate
from identification.discrepancy.next_experiment import next_experiment
from identification.discrepancy.prune import pruned
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance, robust_fit, tolerance
from identification.discrepancy.search import Scored, Search, search
from identification.discrepancy.verdict import sentences
from identification.estimate import degrees_of_freedom
from identification.experiment import Experiment
from identification.fit import bounds, fit, integrator_for
from identification.levenberg_marquardt import LevenbergMarquardt
from identification.prepare import Prepared, prepare
from identification.records import record_fits
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
_MILD = 10.0
"""Reduced chi-square up to which the ordinary fit is a sound place to search from."""
_TOLERANT = (
    "the ordinary fit of the nominal model does not come near the records; it was fitted tolerantly on short windows, and both models"
    " are shown on these"
)
_MOST_ITERATIONS = 15
_FINDING = 0.5
"""Share of the misfit that a learned term must explain to be shown."""
_CUT = 25.0
"""Mean squared residual, in variances of the noise, from which a long window loses weight."""


def diagnose_experiment(
    experiment: Experiment,
    *,
    law: str | None = None,
    budget_minutes: float = 5.0,
    seed: int = 0,
    progress: Progress = lambda stage: None,
) -> Diagnosis:
    """Fit the nominal model, and say what it leaves out.

    Arguments:
        experiment: as loaded.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        budget_minutes: no new search step is begun after so long.
        seed: kept for callers; nothing here is drawn at random.
        progress: told each stage by a line of text.

    Raises:
        NoConvergenceError: not even the tolerant fit on short windows can be integrated.
    """
    begin, seconds = time.monotonic(), {}
    progress("reading first guesses from the records")
    prepared = prepare(experiment, law=law)
    progress("fitting the nominal model")
    nominal = ordinary(prepared)
    seconds["nominal"] = time.monotonic() - begin
    start, allowed = _ground(prepared, nominal, progress)
    seconds["ground"] = time.monotonic() - begin
    deadline = begin + 60.0 * budget_minutes
    found = search(start, allowed, deadline, progress)
    seconds["search"] = time.monotonic() - begin
    return conclude(nominal is start, start, allowed, found, begin, deadline, seconds, progress)


def ordinary(prepared: Prepared) -> Fitted | None:
    """The nominal model on long windows, as an ordinary fit has it; None where that does not settle inside its bounds."""
    try:
        outcome = fit(prepared, method=LevenbergMarquardt(most_iterations=_MOST_ITERATIONS))
    except NoConvergenceError:
        return None
    low, high = bounds(prepared)
    inside = np.all((outcome.estimate.shared > low) & (outcome.estimate.shared < high))
    return Fitted(prepared=prepared, outcome=outcome) if outcome.converged and inside else None


def _ground(prepared: Prepared, nominal: Fitted | None, progress: Progress) -> tuple[Fitted, Tolerance]:
    """Where the search starts: the ordinary fit if it is sound, else a tolerant one on short windows."""
    if nominal is not None and nominal.chi2 / degrees_of_freedom(prepared, active_of(nominal)) <= _MILD:
        return nominal, dataclasses.replace(tolerance(prepared, nominal.outcome.equations.cost), cut=_CUT)
    progress("fitting the nominal model to short windows")
    return robust_fit(prepared)


def conclude(
    sound: bool,
    start: Fitted,
    allowed: Tolerance,
    found: Search,
    begin: float,
    deadline: float,
    seconds: dict[str, float],
    progress: Progress,
) -> Diagnosis:
    """The verdict and its evidence; `sound` says whether the ordinary fit served as the start."""
    final, explained = found.fitted, found.explained
    if len(final.names) > 1:
        progress("taking out what later effects have made needless")
        final = pruned(final, allowed)
    formula = ""
    first = found.rounds[0].scored if found.rounds else found.last
    effects = final.names
    verdict = ADEQUATE if explained and not effects else MISSING if explained else UNLISTED
    if verdict == UNLISTED:
        progress("learning a free-form term")
        final, formula = _free_form(first, start, allowed, deadline, progress)
    seconds["verdict"] = time.monotonic() - begin
    after = start if verdict == ADEQUATE or not final.names else final
    progress("predicting windows left out of the fit")
    shown_before = _side(start)
    shown_after = shown_before if after is start else _side(after)
    samples = int(allowed.samples.sum())
    named = asserted(found, after, shown_after.parameters, samples) if verdict == MISSING else ()
    ambiguous = twins(found.rounds, tuple(one.effect.name for one in named))
    location = _location(first, start, named, verdict)
    seconds["total"] = time.monotonic() - begin
    return Diagnosis(
        experiment=start.prepared.experiment,
        verdict=verdict,
        sentences=sentences(verdict, named, ambiguous, location, shown_before, shown_after, formula),
        effects=named,
        free_form=formula,
        ambiguous_with=ambiguous,
        location=location,
        considered=considered(found),
        nominal=shown_before,
        augmented=shown_after,
        next_experiment=next_experiment(found, named, ambiguous),
        warnings=() if sound else (_TOLERANT,),
        seconds=seconds,
    )


def _free_form(first: Scored, start: Fitted, allowed: Tolerance, deadline: float, progress: Progress) -> tuple[Fitted, str]:
    """The nominal model with a learned term, and the term's formula; the nominal model where none explains half of the misfit."""
    learned = learn(first, allowed, deadline=deadline, progress=progress)
    if learned is None or learned.explained < _FINDING:
        return start, ""
    return learned.fitted, learned.formula


def _side(fitted: Fitted) -> Side:
    """A model beside the records, with its errors."""
    prepared, estimate = fitted.prepared, fitted.outcome.estimate
    degrees = degrees_of_freedom(prepared, active_of(fitted))
    chi2 = fitted.chi2 / max(degrees, 1)
    errors = np.full(estimate.nuisances.shape, np.nan)
    return Side(
        model=fitted.model,
        parameters=numbers(fitted, chi2, chi2_limit(degrees, OVERALL)),
        chi2_reduced=chi2,
        held_out_nrmse=held_out(fitted).nrmse,
        records=record_fits(prepared, integrator_for(prepared), estimate, errors),
    )


def _location(first, start: Fitted, named: tuple[Asserted, ...], verdict: str) -> Location | None:
    """Where the misfit of the nominal model sits; None where there is none."""
    if verdict == ADEQUATE:
        return None
    effect = named[0].effect if named else None
    found = locate(start.prepared, start.outcome.estimate, first.at, first.courses, named=effect)
    if effect is not None and effect.record is not None:
        return dataclasses.replace(found, record=effect.record)
    return found
