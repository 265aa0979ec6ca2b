"""Fit of an experiment: one chain per record, and from it estimates, standard errors, checks and predictions."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from identification.diagnosis.augment import aligned, augmented
from identification.diagnosis.scores import known_effects, score_all, weighed_anew
from identification.estimation.held_back import held_back_chain, held_back_fits, rms_nrmse
from identification.estimation.likelihood import posterior_sample, profiles
from identification.estimation.parameters import (
    Uncertainty,
    between_records,
    derived,
    deviance,
    estimates,
    sensor_errors,
    uncertainty,
    unrest,
)
from identification.estimation.prediction import record_fits
from identification.estimation.ring_downs import ring_downs
from identification.estimation.varying import with_variations
from identification.experiment import Experiment
from identification.guesses.declared_model import check_clearance, check_smoothing, nominal_model, varying
from identification.guesses.fitted_part import in_part
from identification.result.evidence import Unrest, chance
from identification.result.files import Clock
from identification.result.result import Added, FitResult, Likelihood, RecordFit
from identification.trajectory.fit import Fitted, Progress, equations, fit, settled
from identification.trajectory.remodel import with_variation
from identification.trajectory.start import Problem, problem_of
from identification.wording.numbers import joined
from vibrojax.effects.formula import Formula
from vibrojax.errors import InputError


def fit_experiment(
    experiment: Experiment,
    *,
    law: str | None = None,
    effects: Sequence[str] = (),
    terms: Sequence[Formula] = (),
    earlier: Mapping[str, float] | None = None,
    seed: int = 0,
    smoothing: float | None = None,
    draws: int | None = None,
    with_profiles: bool = False,
    progress: Progress = lambda stage: None,
) -> FitResult:
    """Fit the nominal model to an experiment, or a model with effects.

    Arguments:
        experiment: as loaded; its held-back records are predicted at the end.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        effects: names of effects that are added to the nominal model, in this order.
        terms: forces of the user, which are added before them.
        earlier: values of an earlier fit by name, SI: the fit of the nominal model starts there in place of first guesses.
        seed: of every random draw.
        smoothing: width of the contact switch, m, with which Diffrax fits the smoothed law as well; None for the exact contact alone.
        draws: of the posterior; None samples none.
        with_profiles: whether to work out profiles of the likelihood.
        progress: called with a line of text at each stage.

    Raises:
        InputError: the smoothed contact does not go with this law or with effects.
    """
    effects = (*(term.name for term in terms), *effects)
    if smoothing is not None and effects:
        raise InputError("the smoothed integrator integrates no effects: expected none beside it; fit them with the landing integrator")
    clock = Clock()
    progress("reading first guesses from the records")
    names = varying(experiment)
    nominal_law = nominal_model(experiment, law).law
    check_smoothing(nominal_law, smoothing)
    check_clearance(experiment, nominal_law)
    experiment, limits = in_part(experiment)
    problem = with_variation(problem_of(experiment, law=law, earlier=earlier), dict.fromkeys(names, 0.0))
    clock.lap("prepare")
    nominal, between = with_variations(_converged(fit(problem, seed=seed, progress=progress)), names, seed=seed, progress=progress)
    found, added = (nominal, None) if not effects else with_effects(nominal, effects, terms=terms, progress=progress)
    found = _converged(found)
    clock.lap("fit")
    smoothed = None if smoothing is None else _smoothed(found, smoothing, progress)
    progress("standard errors and intervals")
    spread = uncertainty(found)
    parameters = tuple(estimates(found, spread, between, first=problem.values(problem.start)))
    restless = unrest(found)
    clock.lap("errors")
    sample = None if draws is None else posterior_sample(found, spread, draws, seed=seed, progress=progress)
    curves = profiles(found, spread, progress) if with_profiles else None
    clock.lap("posterior and profiles")
    progress("predicting the records without the random force")
    records = record_fits(found)
    shift = discretisation_shift(found, spread)
    clock.lap("records")
    unseen = held_back_chain(found, experiment, lambda line: progress(f"held-back records: {line}"))
    held_back = held_back_fits(unseen)
    if added is not None and held_back:
        before = rms_nrmse(held_back_fits(held_back_chain(nominal, experiment)))
        added = dataclasses.replace(added, held_back=(before, rms_nrmse(held_back)))
    model = found.problem.model_at(found.at)
    models = {"nominal": nominal.problem.model_at(nominal.at)} | ({"augmented": model} if effects else {})
    decays = ring_downs(experiment, (*records, *held_back), models)
    clock.lap("held back")
    chi2, degrees = _misfit(found, records)
    known = np.flatnonzero(spread.known)
    return FitResult(
        experiment=experiment,
        model=model,
        parameters=parameters,
        derived=derived(found, spread),
        correlation=spread.correlation(known),
        correlated=tuple(found.problem.parameters[i].name for i in known),
        chi2_reduced=chi2 / max(degrees, 1),
        degrees=degrees,
        records=records,
        converged=found.converged,
        discretisation=shift,
        warnings=(
            *limits,
            *_moved_starts(problem, earlier or {}),
            *_warnings(found, restless, shift, records, () if sample is None else sample.warnings()),
        ),
        unrest=restless,
        reading_error=sensor_errors(found),
        force_share=0.0 if restless is None else float(np.clip(1.0 - np.sum(found.linear.residual**2) / max(chi2, 1e-300), 0.0, 1.0)),
        seed=seed,
        seconds=clock.seconds,
        held_back=held_back,
        added=added,
        between_records=between_records(found),
        ring_downs=decays,
        smoothing=smoothing,
        smoothed=smoothed,
        posterior=sample,
        profiles=curves,
        likelihood=_likelihood(found, unseen),
    )


def with_effects(nominal: Fitted, names: Sequence[str], *, terms: Sequence[Formula] = (), progress: Progress) -> tuple[Fitted, Added]:
    """The fitted model with effects, whether or not the records give evidence of them, and what they gain.

    They are added in the order of `names`, of listed effects or of `terms`, forces of the user, each fitted anew with everything else. Of
    the candidates of an effect (frequencies, channels, records, first values), that with the largest expected gain is the start.

    Raises:
        InputError: an effect has nothing to act on in these records.
    """
    found, possibilities, places = nominal, 1, []
    for name in names:
        progress(f"choosing where {name} begins")
        scores = score_all(found, [name], terms)
        if not scores.listed:
            channels = joined(list(found.problem.chains.channels))
            raise InputError(f"{name} has nothing to act on in these records, which hold {channels}: leave it out")
        scored = aligned(scores, scores.listed[0])
        best = scored.candidate
        places.append(best.channel or best.members[0].record or "")
        possibilities *= known_effects(terms)[name].probe.tried(scores.scales, len(scores.listed))
        progress(f"fitting the model with {name}")
        found = augmented(scores, best, weighed_anew(scores, scored), progress=progress)
    gain = 0.5 * (nominal.deviance - found.deviance)
    numbers = max(_unknowns(found) - _unknowns(nominal), 1)
    return found, Added(
        names=tuple(names),
        places=tuple(places),
        gain=gain,
        chance=chance(2.0 * gain, numbers, possibilities),
        bic=-2.0 * gain + numbers * float(np.log(max(found.local.samples, 1))),
        held_back=None,
    )


def _unknowns(fitted: Fitted) -> int:
    return int(fitted.problem.border.shared.sum() + fitted.problem.border.own.sum())


def _likelihood(found: Fitted, unseen: Fitted | None) -> Likelihood:
    """Likelihood of the contact law; its parameters are not integrated out, since the result would depend on their units.

    The normalisation of the priors of each record's own numbers, which the chain's equations leave out, depends on whether the model has
    a stop with a gap.
    """
    problem, border = found.problem, found.problem.border
    of_law = np.isin([p.name for p in problem.parameters], [p.name for p in problem.model.law.parameters])
    there = dataclasses.replace(problem, border=dataclasses.replace(border, strengths=border.strengths | of_law))
    return Likelihood(
        deviance=deviance(dataclasses.replace(found, problem=there), found.variances.force) - _of_priors(found),
        samples=found.local.samples,
        held_back=None if unseen is None else unseen.deviance - _of_priors(unseen),
    )


def _of_priors(found: Fitted) -> float:
    """Sum of the logarithms of the precisions of each record's own numbers."""
    border = found.problem.border
    precision = border.own_precision * border.own_scale**2
    return float(np.log(precision[border.own & (precision > 0)]).sum())


def _smoothed(found: Fitted, smoothing: float, progress: Progress) -> dict[str, float]:
    """The fit of the smoothed law by Diffrax and optax, which a fit without it does not load."""
    from identification.trajectory.smoothed import fit_smoothed

    fitted = fit_smoothed(found.problem, found.at, smoothing=smoothing, readings=found.variances.readings, progress=progress)
    if not fitted.converged:
        progress("the fit of the smoothed law has not converged")
    return fitted.values


def _converged(found: Fitted) -> Fitted:
    """The fit, with more steps under the variances that it found where it has not converged."""
    return found if found.converged else settled(found.problem, found.at, found.variances, steps=20)


def _misfit(found: Fitted, records: tuple[RecordFit, ...]) -> tuple[float, int]:
    """Chi-square of the free motion over the noise, and its degrees of freedom; a stretch that is not led has a state of its own."""
    problem, chi2 = found.problem, 0.0
    for index, record in enumerate(records):
        weight = problem.chains.series(index, problem.chains.weight, len(record.time))
        for column, name in enumerate(problem.chains.channels):
            if name in record.chi2_reduced:
                chi2 += record.chi2_reduced[name] * int((weight[:, column] > 0).sum())
    stretches = sum(record.windows for record in records if record.kind != "prescribed")
    samples = int((problem.chains.weight > 0).sum())
    return chi2, samples - _unknowns(found) - len(problem.unknowns.states) * stretches


def discretisation_shift(found: Fitted, spread: Uncertainty) -> float:
    """Largest shift of a shared parameter, in standard errors, when all steps are halved (one Gauss-Newton step from the mode)."""
    steps = found.problem.integrator
    finer = dataclasses.replace(steps, contact_steps=2.0 * steps.contact_steps, flight_step=0.5 * steps.flight_step)
    _, _, solution = equations(dataclasses.replace(found.problem, integrator=finer), found.at, found.variances)
    moved = np.abs(solution.shared - found.solution.shared)[spread.known]
    return float(np.max(moved / spread.stderr[spread.known], initial=0.0))


def _moved_starts(problem: Problem, earlier: Mapping[str, float]) -> tuple[str, ...]:
    """Warnings on values of an earlier fit that lie outside the range of this one."""
    given = {name for name, option in problem.experiment.parameters.items() if option.start is not None}
    return tuple(
        f"{p.name} = {earlier[p.name]:g} of the earlier fit lies outside {p.lower:g} to {p.upper:g}: the fit starts at the edge"
        for p in problem.parameters
        if p.name in earlier and p.name not in given and not p.lower <= earlier[p.name] <= p.upper
    )


def _warnings(
    found: Fitted, restless: Unrest | None, shift: float, records: tuple[RecordFit, ...], of_sample: tuple[str, ...]
) -> tuple[str, ...]:
    """Warnings beside the result, on convergence, segments and records that cannot be integrated, random force, step size and gaps."""
    warnings = []
    if not found.converged:
        warnings.append("the iteration stopped before it had converged")
    if lost := int(np.sum(~found.linear.done)):
        warnings.append(f"{lost} of {len(found.linear.done)} segments could not be integrated and do not count")
    warnings += [
        f"the model cannot be integrated through the whole of {record.file}"
        for record in records
        if not np.isfinite(record.relative_displacement).all()
    ]
    if restless is not None:
        allowed = "It explains any motion, and the parameters are hardly determined" if restless.at_limit else "The errors allow for it"
        warnings.append(f"{restless.sentence()} {allowed}; `vibrojax diagnose` looks for a cause")
    if shift > 0.1:
        warnings.append(f"halving the integration steps moves a parameter by {shift:.2f} standard errors")
    for record, motion in zip(found.problem.experiment.records, found.problem.motions, strict=True):
        if motion is None or motion.force is None or motion.touching.any():
            continue
        peak = float(motion.force.max())
        if peak > 12.0 * record.noise["impact_force"]:  # no noise reaches that far
            warnings.append(
                f"the load cell of {record.file} reads up to {peak:.3g} N, but the hammer stays {record.gap - motion.u.max():.3g} m short"
                " of the stop: check gap, unit and sign of the displacement"
            )
    return (*warnings, *of_sample)
