"""Diagnosis of an experiment: from the fit of the nominal model to a verdict on missing effects."""

import dataclasses
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

import numpy as np

from identification.diagnosis.assertion import asserted, considered, twins
from identification.diagnosis.beginnings import beginnings
from identification.diagnosis.calibration import ALPHA, RELEVANT
from identification.diagnosis.diagnosis import ADEQUATE, MISSING, NOT_FINISHED, RESTLESS, UNLISTED, Asserted, Diagnosis, Location, Side
from identification.diagnosis.errors import numbers
from identification.diagnosis.free_form.free_form import Learned, learn
from identification.diagnosis.held_out import Predictions
from identification.diagnosis.locate.locate import locate
from identification.diagnosis.locate.loop_kink import loop_kink
from identification.diagnosis.locate.next_experiment import next_experiment
from identification.diagnosis.locate.restitution import lost_in_contacts
from identification.diagnosis.relevance import residual_share, share_added, share_predicted
from identification.diagnosis.score.scored import Scored
from identification.diagnosis.score.signature import signatures
from identification.diagnosis.search.among import SEARCHED, limit_warning
from identification.diagnosis.search.forward import BUDGET, FAILED, MOST, Search, search
from identification.diagnosis.sentences import sentences
from identification.estimation.nominal import follows_records, nominal_fit
from identification.estimation.records import record_fits
from identification.estimation.ring_downs import ring_downs
from identification.experiment import Experiment
from identification.least_squares.fit import integrator_for
from identification.least_squares.settling import settled_without_force
from identification.likelihood.fitted import Fitted
from identification.result.result import RecordFit
from identification.result.ring_down import RingDowns
from identification.result.variation import disagreements, unrest
from identification.windows.declared_model import varying
from identification.windows.prepare import MOST_SAMPLES, prepare

Progress = Callable[[str], None]
_SHOWN = 3
"""Candidates whose free vibration is simulated beside that of both models."""
_ENDED = {
    BUDGET: f"{NOT_FINISHED}: the budget ended the search before all candidates were fitted; allow more minutes",
    FAILED: f"{NOT_FINISHED}: the best alternative, which is significant, could not be fitted on whole windows",
    MOST: "the search stopped after as many effects as it adds to one model: more may be missing",
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Cause:
    """Verdict and final model, with the formula of its free-form term if it has one."""

    verdict: str
    fitted: Fitted
    formula: str = ""


class _Course:
    """Wall time by stage, and the deadline after which no search step begins."""

    def __init__(self, budget_minutes: float, progress: Progress) -> None:
        self.seconds: dict[str, float] = {}
        self.progress = progress
        self.deadline = time.monotonic() + 60.0 * budget_minutes

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Record the wall time of the enclosed block."""
        begin = time.monotonic()
        yield
        self.seconds[name] = time.monotonic() - begin


def diagnose_experiment(
    experiment: Experiment,
    *,
    law: str | None = None,
    among: Collection[str] = SEARCHED,
    budget_minutes: float = 5.0,
    progress: Progress = lambda stage: None,
) -> Diagnosis:
    """Fit the nominal model, search for missing effects and return the verdict. The procedure uses no random numbers.

    Of long records the first part is diagnosed (`beginnings`), with a warning.

    Arguments:
        experiment: as loaded.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        among: names of the effects that may be added to the model, all listed ones if left out; `among_effects` checks names.
        budget_minutes: time after which no search step begins; the verdict then states that the search was not finished.
        progress: called with a line of text at each stage.

    Raises:
        NoConvergenceError: the nominal model cannot be integrated in any window.
    """
    course = _Course(budget_minutes, progress)
    experiment, partly = beginnings(experiment, MOST_SAMPLES)
    with course.stage("nominal"):
        progress("reading first guesses from the records")
        start = nominal_fit(prepare(experiment, law=law), progress=progress).fitted
    with course.stage("search"):
        found = search(start, deadline=course.deadline, among=among, progress=progress)
    with course.stage("model"):
        term = found.learned or learn(found.last, deadline=course.deadline, progress=progress)
        predicted = Predictions(experiment)
        cause = _cause(found, term, predicted)
    diagnosis = _concluded(experiment, found, cause, among, course, predicted)
    return dataclasses.replace(diagnosis, warnings=(*diagnosis.warnings, *partly))


def _cause(found: Search, term: Learned | None, predicted: Predictions) -> _Cause:
    """Verdict from the share of the misfit: a free-form term if it adds more than `RELEVANT` to the listed effects; else these, if any.

    It has to add as much on held-back records, else on windows left out of the fit, where these can be predicted: a flexible term always
    gains on those it was fitted to. Without listed effects, the verdict depends on whether the random force is significant. A random force
    beside which many windows still deviate from the recorded motion explains nothing: the cause is then an unlisted one.
    """
    nominal, model = found.first.fitted, found.fitted
    if (
        term is not None
        and share_added(nominal, model, term.fitted) > RELEVANT
        and not share_predicted(predicted(model), predicted(term.fitted)) <= RELEVANT
    ):
        return _Cause(verdict=UNLISTED, fitted=term.fitted, formula=term.formula)
    if model.names:
        return _Cause(verdict=MISSING, fitted=model)
    if not follows_records(model):
        return _Cause(verdict=UNLISTED, fitted=model)
    return _Cause(verdict=RESTLESS if unrest(model, alpha=ALPHA) else ADEQUATE, fitted=model)


def _concluded(
    experiment: Experiment, found: Search, cause: _Cause, among: Collection[str], course: _Course, predicted: Predictions
) -> Diagnosis:
    """The verdict with its evidence: held-out errors, alternatives, location of the misfit, next experiment."""
    start, verdict, after = found.first.fitted, cause.verdict, cause.fitted
    with course.stage("evidence"):
        course.progress("predicting windows left out of the fit")
        shown_before = _side(start, predicted)
        shown_after = shown_before if after is start else _side(after, predicted)
        named = asserted(found, after, shown_after.parameters) if verdict == MISSING else ()
        ambiguous = twins(found.steps, tuple(one.effect.name for one in named)) if named else ()
        location = _location(found.first, named, verdict)
        rows = considered(found, predicted.windows)
        advice = next_experiment(found, ambiguous)
        lost = lost_in_contacts(location, shown_before) if verdict == UNLISTED else None
        restless = unrest(after, alpha=ALPHA)
        decays = _ring_downs(found, experiment, shown_before, shown_after)
        said = sentences(
            verdict,
            named,
            ambiguous,
            location,
            shown_before,
            shown_after,
            cause.formula,
            restless,
            lost,
            in_part=_in_part(found, predicted) if verdict == UNLISTED else None,
            finished=found.ended not in (BUDGET, FAILED),
            limited=bool(limit_warning(among)),
        )
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
        unrest=restless,
        next_experiment=advice,
        warnings=(*_warnings(found, after, shown_after), *limit_warning(among)),
        seconds=course.seconds,
        ring_downs=decays,
    )


def _in_part(found: Search, predicted: Predictions) -> tuple[tuple[str, ...], float] | None:
    """Summaries of the listed effects that the search added, with the share of the misfit that they explain; None if not relevant.

    The misfit is the squared error on what was left out of the fit; in the fit where no part of the records can be left out.
    """
    if not found.fitted.names:
        return None
    explained = share_predicted(predicted(found.first.fitted), predicted(found.fitted))
    if np.isnan(explained):
        explained = 1.0 - residual_share(found.fitted, found.first.fitted)
    return (tuple(effect.summary for effect in found.fitted.model.effects), min(explained, 1.0)) if explained > RELEVANT else None


def _ring_downs(found: Search, experiment: Experiment, before: Side, after: Side) -> RingDowns:
    """Damping and frequency by amplitude: of the records, both models, and the best candidates of the first search step."""
    models = {"nominal": before.model}
    for one in (found.steps[0].alternatives if found.steps else found.refused)[:_SHOWN]:
        if one.fitted.names != tuple(effect.name for effect in after.model.effects):
            models.setdefault(one.name, one.fitted.model)
    models |= {} if after is before else {"augmented": after.model}
    return ring_downs(experiment, (*after.records, *after.held_back), models)


def _warnings(found: Search, after: Fitted, side: Side) -> tuple[str, ...]:
    """Warnings beside the verdict: unfinished search, no convergence, parameters without a standard error."""
    said = [_ENDED[found.ended]] if found.ended in _ENDED else []
    if not after.converged:
        said.append("the last fit stopped before it had converged: its numbers may still move by more than their errors")
    held = after.prepared.fixed
    if names := varying(after.prepared.experiment):
        said.append(f"varies of {', '.join(names)} is not used: the search adds what varies between records where it is significant")
    if lost := [p.symbol for p in side.parameters if p.stderr is None and p.name not in held]:
        said.append(f"without an error, at the edge of their range or not identifiable from these records: {', '.join(lost)}")
    return tuple(said)


def _side(fitted: Fitted, predicted: Predictions) -> Side:
    """A model with parameters, errors and predictions, for the fitted records and for those held back."""
    return Side(
        model=fitted.model,
        parameters=numbers(fitted),
        chi2_reduced=fitted.chi2_reduced,
        held_out_nrmse=predicted(fitted),
        records=_fits(fitted),
        disagreements=disagreements(fitted),
        held_back=predicted.records(fitted),
    )


def _fits(fitted: Fitted) -> tuple[RecordFit, ...]:
    """Every fitted record with its prediction, without random force."""
    prepared, estimate = fitted.prepared, settled_without_force(fitted.prepared, fitted.estimate)[0]
    return record_fits(prepared, integrator_for(prepared), estimate, np.full(estimate.nuisances.shape, np.nan))


def _location(first: Scored, named: tuple[Asserted, ...], verdict: str) -> Location | None:
    """Location of the nominal model's misfit; None where the verdict finds none."""
    if verdict in (ADEQUATE, RESTLESS):
        return None
    effects = [one.effect for one in named]
    effect = next((one for one in effects if one.record is not None), effects[0] if effects else None)
    acting = None if effect is None else signatures(first.at, first.courses, first.fitted.prepared.layout.files, [effect])[0].force
    found = locate(first.fitted.prepared, first.fitted.estimate, first.at, named=effect, acting=acting)
    if verdict == UNLISTED:
        return dataclasses.replace(found, kink=loop_kink(first))
    if effect is not None and effect.record is not None:
        return dataclasses.replace(found, record=effect.record)
    return found
