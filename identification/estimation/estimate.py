"""Fit of an experiment: estimates, standard errors, identifiability of each parameter, and checks."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from identification.estimation.held_back import held_back_fits, rms_nrmse
from identification.estimation.nominal import Nominal, degrees_of_freedom, nominal_fit, on_ordinary_windows, with_variations
from identification.estimation.profiles import likelihood_around, profiles
from identification.estimation.records import record_fits
from identification.estimation.ring_downs import ring_downs
from identification.estimation.sample import posterior_sample
from identification.estimation.unfitted import unfitted
from identification.experiment import Experiment
from identification.least_squares.block_arrow import Equations
from identification.least_squares.fit import bounds, free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import Outcome
from identification.least_squares.settling import settled_without_force
from identification.least_squares.uncertainty import Uncertainty, interval, uncertainty
from identification.likelihood.fitted import Fitted, first_point, fitted
from identification.likelihood.joint import point
from identification.likelihood.sampling.nuts import Nuts
from identification.likelihood.variances import posterior
from identification.result.posterior import PosteriorSample
from identification.result.result import (
    AT_BOUND,
    FIXED,
    NOT_IDENTIFIABLE,
    OK,
    Added,
    Derived,
    FitResult,
    ParameterEstimate,
    RecordFit,
    SensorNoise,
)
from identification.result.variation import Unrest, disagreements, unrest
from identification.windows.declared_model import varying
from identification.windows.layout import Active, Estimate
from identification.windows.prepare import MOST_SAMPLES, Prepared, prepare
from vibrojax.errors import InputError

Progress = Callable[[str], None]
Extension = Callable[[Fitted, Progress], tuple[Fitted, Added]]
"""From the fitted nominal model to one with effects, fitted, and what these gain."""
DERIVED = {"k": "N/m", "c": "N s/m"}
"""Units of the numbers derived from mass, natural frequency and damping ratio, by name."""
FORCE_BY_CHANCE = 1e-4
"""Probability that noise alone gives the random force that a fit reports."""
_STRUCK = 12.0
"""Load-cell force, in standard deviations of the noise, above which it is significant."""


def fit_experiment(
    experiment: Experiment,
    *,
    law: str | None = None,
    starts: int | None = None,
    seed: int = 0,
    extend: Extension | None = None,
    smoothing: float | None = None,
    posterior_by: Nuts | None = None,
    with_profiles: bool = False,
    progress: Progress = lambda stage: None,
) -> FitResult:
    """Fit the nominal model to an experiment, or a model with effects.

    Arguments:
        experiment: as loaded; its held-back records are predicted at the end.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        starts: number of starts; None uses several only where the first fit leaves a misfit, 1 never does.
        seed: of the random starts.
        extend: adds effects to the fitted nominal model; none if left out.
        smoothing: width of the contact switch, m, which Diffrax then integrates; None for the exact contact.
        posterior_by: sampler of the posterior; None samples none.
        with_profiles: whether to work out profiles of the likelihood.
        progress: called with a line of text at each stage.

    Raises:
        InputError: the smoothed contact does not go with this law or with effects.
    """
    if smoothing is not None and extend is not None:
        raise InputError("the smoothed integrator integrates no effects: expected none beside it; fit them with the landing integrator")
    clock = _Clock()
    progress("reading first guesses from the records")
    prepared = prepare(experiment, law=law, smoothing=smoothing, most_samples=MOST_SAMPLES)
    clock.lap("prepare")
    begin = nominal_fit(prepared, starts=starts, seed=seed, progress=progress)
    clock.lap("fit")
    nominal = with_variations(_on_long_windows(prepared, begin, progress), varying(experiment), progress)
    found, added = (nominal, None) if extend is None else extend(nominal, progress)
    short, ordinary = len(found.prepared.record) > len(prepared.record), prepared
    first = prepared.layout.physical(prepared.start.shared)
    prepared, active = found.prepared, free_unknowns(found.prepared)
    clock.lap("likelihood")
    spread = uncertainty(found.posterior.equations, found.estimate, active)
    estimates = _estimates(found, spread, first, posterior_by, with_profiles, seed, clock, progress)
    shown, cost = settled_without_force(prepared, found.estimate)
    degrees = degrees_of_freedom(prepared, active, np.isfinite(cost))
    records = record_fits(prepared, integrator_for(prepared), shown, _nuisance_errors(prepared, spread, active))
    clock.lap("records")
    model, restless = found.model, unrest(found, alpha=FORCE_BY_CHANCE)
    progress("predicting held-back records, windows that were not fitted and free vibrations")
    held_back = held_back_fits(experiment, model, smoothing=smoothing)
    decays = ring_downs(experiment, (*records, *held_back), {"nominal": nominal.model} | ({"augmented": model} if extend else {}))
    rest = unfitted(ordinary, found, cost)
    clock.lap("held back")
    return FitResult(
        experiment=experiment,
        model=model,
        chi2_reduced=2.0 * _cost(begin.outcome if prepared.layout == ordinary.layout else None, cost) / max(degrees, 1),
        degrees=degrees,
        records=records,
        starts=begin.starts,
        converged=found.converged,
        iterations=0 if begin.outcome is None else begin.outcome.iterations,
        warnings=_warnings(experiment, found, restless, estimates["discretisation"], cost, estimates["posterior"], shortened=short),
        unrest=restless,
        noise={name: SensorNoise(scale=one.std, order=one.order) for name, one in found.variances.noise.items()},
        seed=seed,
        seconds=clock.seconds,
        held_back=held_back,
        ring_downs=decays,
        smoothing=smoothing,
        unfitted=rest,
        added=added and _predicting(added, nominal, experiment, held_back),
        **estimates,
    )


def _estimates(
    of: Fitted,
    spread: Uncertainty,
    first: dict[str, float],
    posterior_by: Nuts | None,
    with_profiles: bool,
    seed: int,
    clock: "_Clock",
    progress: Progress,
) -> dict[str, Any]:
    """What a result says of the parameters: estimates with errors, correlation, posterior, profiles, and how fine the steps are."""
    progress("standard errors and intervals")
    prepared, active = of.prepared, free_unknowns(of.prepared)
    known = dataclasses.replace(active, shared=active.shared & spread.identifiable)
    parameters = _parameters(of, known, spread, first)
    clock.lap("errors")
    free = dataclasses.replace(known, shared=np.array([one.status == OK for one in parameters], bool))
    sample = None if posterior_by is None else posterior_sample(of, free.shared, spread, posterior_by, seed=seed, progress=progress)
    curves = profiles(of, free, spread, progress) if with_profiles else None
    clock.lap("posterior and profiles")
    progress("checking the step size")
    chosen = np.flatnonzero(known.shared)
    return {
        "parameters": parameters,
        "derived": _derived(prepared, prepared.layout.physical(of.estimate.shared), spread, known),
        "correlation": spread.correlation(chosen),
        "correlated": tuple(prepared.layout.parameters[i].name for i in chosen),
        "between_records": disagreements(of),
        "discretisation": discretisation_shift(of, known, spread),
        "posterior": sample,
        "profiles": curves,
    }


def _cost(outcome: Outcome | None, cost: np.ndarray) -> float:
    """Half chi-square without random force: the sum over the integrated windows; NaN without any.

    The least-squares optimum counts where it is lower: under a random force, the estimates are not those of least squares. It may be
    higher: least squares can stop in a local minimum that the fit under the full likelihood leaves.
    """
    integrated = np.isfinite(cost)
    at_estimate = float(cost[integrated].sum()) if integrated.any() else float("nan")
    if outcome is None or not outcome.converged or not integrated.all():
        return at_estimate
    return min(outcome.cost, at_estimate)


def _predicting(added: Added, nominal: Fitted, experiment: Experiment, held_back: tuple[RecordFit, ...]) -> Added:
    """The gain of effects with the errors on the held-back records, where there are any."""
    if not held_back:
        return added
    return dataclasses.replace(added, held_back=(rms_nrmse(held_back_fits(experiment, nominal.model)), rms_nrmse(held_back)))


def _on_long_windows(prepared: Prepared, begin: Nominal, progress: Progress) -> Fitted:
    """The nominal fit on ordinary windows, the likelier of those from least squares and from short windows, iterated to convergence.

    It stays on short windows where it diverges on ordinary ones from either.
    """
    found = begin.fitted
    if len(found.prepared.record) > len(prepared.record):
        progress("fitting the nominal model to ordinary windows again")
        far = None if begin.far is None else fitted(first_point(prepared, begin.far), iterations=25)
        tried = [one for one in (on_ordinary_windows(prepared, found), far) if one is not None]
        found = max(tried, key=lambda one: one.log_likelihood, default=found)
    return found if found.converged else fitted(found.point, iterations=25)


def discretisation_shift(of: Fitted, active: Active, spread: Uncertainty) -> float:
    """Largest shift of a shared parameter, in standard errors, when all steps are halved (one Gauss-Newton step from the optimum)."""
    found = (
        posterior(at.linear, at.inner, of.variances) for at in (of.point, point(of.prepared, of.estimate, of.variances, refinement=2.0))
    )
    coarse, finer = (one.step[0, : of.prepared.layout.shared] for one in found)
    sigma = spread.stderr[: of.prepared.layout.shared]
    moved = np.abs(finer - coarse)[active.shared]
    return float(np.max(moved / sigma[active.shared], initial=0.0))


def _parameters(of: Fitted, active: Active, spread: Uncertainty, first: dict[str, float]) -> tuple[ParameterEstimate, ...]:
    """Table of the shared parameters with standard errors and status; `first`: first guesses of the nominal model's."""
    evaluate = likelihood_around(of)
    found = (_parameter(of, active, spread, index, evaluate) for index in range(of.prepared.layout.shared))
    between = dict.fromkeys(varying(of.prepared.experiment), 0.0) | dict(of.prepared.layout.variations)
    return tuple(
        dataclasses.replace(
            one,
            initial=first.get(one.spec.name, one.initial),
            between=between[one.spec.name] * one.spec.slope(one.value) if one.spec.name in between else None,
        )
        for one in found
    )


def _parameter(of: Fitted, active: Active, spread: Uncertainty, index: int, evaluate: Callable[[Estimate], Equations]) -> ParameterEstimate:
    """One shared parameter with standard error, interval and status."""
    prepared, estimate = of.prepared, of.estimate
    spec = prepared.layout.parameters[index]
    internal = estimate.shared[index]
    value, initial = spec.to_physical(internal), spec.to_physical(prepared.start.shared[index])
    blank = ParameterEstimate(spec=spec, value=value, stderr=None, ci95=None, interval="", initial=initial, status=OK)
    if spec.name in prepared.fixed:
        given = spec.name in prepared.experiment.parameters
        reason = "held at the value given in [parameters]" if given else "held where the gain that the score test expects is largest"
        return dataclasses.replace(blank, status=FIXED, reason=reason)
    low, high = (limit[index] for limit in bounds(prepared))
    if internal <= low or internal >= high:
        return dataclasses.replace(blank, status=AT_BOUND, reason=f"stopped at {value:.4g}, the edge of its range")
    if not spread.identifiable[index]:
        return dataclasses.replace(blank, status=NOT_IDENTIFIABLE, reason=_why_not(prepared, spec.name))
    sigma = spread.stderr[index]
    left, right, kind = interval(evaluate, of.posterior.equations, estimate, active, spread, index)
    stderr = sigma * spec.slope(value)
    return dataclasses.replace(blank, stderr=float(stderr), ci95=(spec.to_physical(left), spec.to_physical(right)), interval=kind)


def _why_not(prepared: Prepared, name: str) -> str:
    """Reason why a parameter has no standard error."""
    in_law = name in {p.name for p in prepared.model.law.parameters}
    touched = any(motion is None or motion.touching.any() for motion in prepared.motions)
    if in_law and not touched:
        return "the hammer does not touch the stop in any record"
    return "its standard error is larger than a factor of e, or than 1 where it is not estimated by its logarithm"


def _derived(prepared: Prepared, values: dict[str, float], spread: Uncertainty, known: Active) -> tuple[Derived, ...]:
    """Stiffness k = m omega_n^2 and damping c = 2 zeta omega_n m, with errors to first order."""
    if "f_n" not in values:
        return ()
    layout, mass = prepared.layout, values.get("m", prepared.experiment.mass)
    omega = 2 * np.pi * values["f_n"]

    def row(name: str, value: float, slopes: dict[str, float]) -> Derived:
        at = {layout.index(key): slope for key, slope in slopes.items() if key in values}
        is_known = all(known.shared[i] for i in at if layout.parameters[i].name != "m" or "m" not in prepared.fixed)
        vector = np.array([at.get(i, 0.0) for i in range(layout.shared)])
        variance = vector @ spread.covariance[: layout.shared, : layout.shared] @ vector
        stderr = float(value * np.sqrt(variance)) if is_known else None
        return Derived(name=name, symbol=name, unit=DERIVED[name], value=float(value), stderr=stderr)

    return (
        row("k", mass * omega**2, {"f_n": 2.0, "m": 1.0}),
        row("c", 2 * values["zeta"] * omega * mass, {"zeta": 1.0, "f_n": 1.0, "m": 1.0}),
    )


def _nuisance_errors(prepared: Prepared, spread: Uncertainty, active: Active) -> np.ndarray:
    """(records, nuisances) standard errors, NaN where not estimated."""
    errors = spread.stderr[prepared.layout.shared :].reshape(active.nuisances.shape)
    return np.where(active.nuisances, errors, np.nan)


def _warnings(
    experiment: Experiment,
    of: Fitted,
    restless: Unrest | None,
    shift: float,
    cost: np.ndarray,
    sample: PosteriorSample | None,
    *,
    shortened: bool,
) -> tuple[str, ...]:
    """Warnings beside the result, on records, convergence, windows, random force, step size, gaps and chains of the posterior."""
    found = []
    if (few := len(of.prepared.experiment.records)) < (records := len(experiment.fitting.records)):
        found.append(f"{few} of {records} records are fitted, an even selection of each kind with the same channels")
    if not of.converged:
        found.append("the iteration stopped before it had converged")
    if lost := int(np.sum(~np.isfinite(cost))):
        found.append(f"{lost} of {len(cost)} windows could not be integrated and do not count")
    if shortened:
        found.append(
            "fitted to windows of half an impact, since longer ones diverge from the records: predictions over several impacts have larger"
            " errors than shown; `vibrojax diagnose` looks for the cause"
        )
    if restless is not None:
        found.append(f"{restless.sentence()} The errors allow for it; `vibrojax diagnose` looks for a cause")
    if shift > 0.1:
        found.append(f"halving the integration steps moves a parameter by {shift:.2f} standard errors")
    return (*found, *_implausible_gaps(of.prepared), *(sample.warnings() if sample else ()))


def _implausible_gaps(prepared: Prepared) -> tuple[str, ...]:
    """Warnings on records whose load cell shows impacts while the recorded hammer stays clear of the stop."""
    found = []
    for record, motion in zip(prepared.experiment.records, prepared.motions, strict=True):
        if motion is None or motion.force is None or motion.touching.any():
            continue
        peak = float(motion.force.max())
        if peak > _STRUCK * record.noise["impact_force"]:
            found.append(
                f"the load cell of {record.file} reads up to {peak:.3g} N, but the hammer stays {record.gap - motion.u.max():.3g} m short"
                " of the stop: check gap, unit and sign of the displacement"
            )
    return tuple(found)


class _Clock:
    """Wall time by stage, s."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Record the wall time of a stage that ends."""
        last, self._last = self._last, time.perf_counter()
        self.seconds[stage] = self._last - last
