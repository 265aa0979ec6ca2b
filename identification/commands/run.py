"""What the commands do, from paths to files; nothing here prints."""

import contextlib
import dataclasses
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import RenderableType

from identification.diagnosis.diagnose import diagnose_experiment
from identification.diagnosis.diagnosis import Diagnosis
from identification.diagnosis.files import StoredDiagnosis, diagnosis_dataset, diagnosis_provenance, stored_diagnosis
from identification.diagnosis.scores import among_effects, known_effects
from identification.estimation.estimate import fit_experiment
from identification.estimation.parameters import DERIVED
from identification.estimation.simulate import simulate_record
from identification.experiment import Experiment, load_experiment
from identification.guesses.declared_model import check_compared_wishes, check_law, check_laws, nominal_model
from identification.report import diagnosis_summary, fit_summary, write_diagnosis_report, write_report
from identification.report.base import SCREEN, PageStyle
from identification.report.laws import FILE_NAME as LAWS_FILE
from identification.report.laws import law_scores, law_summary, write_laws
from identification.result.files import (
    StoredFit,
    estimates_file,
    fit_dataset,
    fit_json,
    plain,
    provenance,
    read_estimates,
    state_files,
    stored_fit,
)
from identification.result.posterior import FILE_NAME as POSTERIOR_FILE
from identification.result.posterior import check_extra, write_posterior
from identification.result.reference import Reference, check_reference, read_reference
from identification.result.result import FitResult, StartedFrom
from identification.result.store import FILE_NAME, read_stored, write_dataset
from identification.trajectory.fit import Progress
from identification.wording.numbers import joined
from vibrojax.effects.formula import Formula
from vibrojax.effects.formula import terms as read_terms
from vibrojax.errors import InputError, NoConvergenceError, WarningLine
from vibrojax.json_file import write_json
from vibrojax.model import MASS, Model
from vibrojax.model_file import read_model, write_model

Show = Callable[[RenderableType], None]
FAILURES = (InputError, NoConvergenceError, np.linalg.LinAlgError)
"""What a fit raises where an experiment, or the law or effects chosen for it, cannot be fitted."""


def run_fit(
    experiment: Path,
    folder: Path,
    *,
    law: str | None = None,
    compare: Sequence[str] = (),
    effects: Sequence[str] = (),
    terms: Sequence[str] = (),
    starts: Mapping[str, float] | None = None,
    earlier: Path | None = None,
    reference: Path | None = None,
    seed: int = 0,
    smoothing: float | None = None,
    draws: int | None = None,
    with_profiles: bool = False,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
    show: Show = lambda summary: None,
) -> FitResult:
    """Fit an experiment, show the numbers, and write fit.json, model.json, result.nc, report.html and plots into `folder`.

    `show` is called with the tables for a terminal before anything is drawn. `effects` and `terms`, forces as
    formulas with first values `starts` of their parameters, are added to the nominal model. The laws in
    `compare` are fitted in place of `law`; a table and comparison.csv rank them, and the best one's result is written. The fit starts from
    the values of an `earlier` one, a fit.json or its folder, where names and units agree; other parameters keep their first guesses.
    `smoothing` is the width of a contact switch, m, with which a smoothed law is fitted as well; so many `draws` of the posterior are
    written to posterior.nc; `with_profiles` adds profiles of the likelihood. Returns the result that is written.

    Raises `InputError` before any fitting where the input cannot be used, and after that of the nominal model where an effect has
    nothing to act on, `NoConvergenceError` at the end.
    """
    chosen: dict[str, Any] = {"law": law, "compare": compare, "effects": effects, "terms": terms, "starts": starts}
    effects = tuple(dict.fromkeys(effects))
    own, known, table = check_choices(**chosen, earlier=earlier, reference=reference, draws=draws)
    progress("reading the records")
    loaded = _loaded(experiment, progress)
    if compare:
        check_compared_wishes(loaded, compare)
    more: dict[str, Any] = {"seed": seed, "smoothing": smoothing, "draws": draws, "with_profiles": with_profiles}

    def fitted(law: str | None, said: Progress) -> FitResult:
        model = nominal_model(loaded, law)
        units = _units(model, effects, own)
        if table is not None:
            check_reference(table, units)
        names = {p.name for p in model.parameters} | (set() if loaded.mass_is_known else {MASS.name})
        mine = {name: value for name, value in known.items() if name in names}
        begin = None if earlier is None else _started_from(estimates_file(earlier), mine, units, loaded)
        if begin is not None:
            said(begin.sentence())
        start = {} if begin is None else begin.taken
        found = fit_experiment(loaded, law=law, effects=effects, terms=own, earlier=start, progress=said, **more)
        check_converged(found)
        return dataclasses.replace(found, started_from=begin)

    if compare:
        found, refused = _each(compare, fitted, progress)
        if not found:
            unusable = all(isinstance(reason, InputError) for reason in refused.values())
            reasons = "; ".join(f"{law} cannot be fitted: {reason}" for law, reason in refused.items())
            raise (InputError if unusable else NoConvergenceError)(reasons)
        scores = law_scores(found)
        show(law_summary(scores, refused))
        write_laws(scores, refused, folder / LAWS_FILE)
        result = scores[0].result
    else:
        result = fitted(law, progress)
        show(fit_summary(result, table))
    write_fit(result, folder, table, style, progress)
    return result


def check_choices(
    *,
    law: str | None,
    compare: Sequence[str],
    effects: Sequence[str],
    terms: Sequence[str],
    starts: Mapping[str, float] | None,
    earlier: Path | None,
    reference: Path | None,
    draws: int | None,
) -> tuple[tuple[Formula, ...], dict[str, tuple[float, str]], Reference | None]:
    """What the options of `run_fit` name: terms, values of an earlier fit with their units, and reference values.

    Raises `InputError` where they suit no experiment at all.
    """
    among_effects(only=effects)
    if draws is not None:
        check_extra()
    if law is not None:
        check_law(law)
    if compare:
        check_laws(compare)
    known = {} if earlier is None else read_estimates(earlier)
    return read_terms(terms, starts), known, None if reference is None else read_reference(reference)


def _started_from(file: Path, known: Mapping[str, tuple[float, str]], units: Mapping[str, str], experiment: Experiment) -> StartedFrom:
    """Values of an earlier fit, with their units, that the nominal model takes: `units` by name.

    A number whose unit holds an exponent, N/m^n, means something only beside that exponent: both are taken or neither.
    """
    options = experiment.parameters
    taken = {name: value for name, (value, unit) in known.items() if units.get(name) == unit and "." not in name}
    left_out = {name: f"in {unit} there, {units[name]} here" for name, (_, unit) in known.items() if units.get(name, unit) != unit}
    wished = {name: option.start for name, option in options.items() if option.start is not None}
    for name in list(taken):
        for exponent in re.findall(r"\bn(?:_2)?\b", units[name]):
            if name not in taken:
                continue
            if exponent not in taken:
                left_out[name] = f"the earlier fit has no {exponent} to it"
            elif wished.get(exponent, taken[exponent]) != taken[exponent]:
                left_out[name] = f"its {exponent} is {taken[exponent]:.4g} there, and {wished[exponent]:g} in [parameters]"
            elif exponent in options and (bounds := options[exponent].bounds) and not bounds[0] <= taken[exponent] <= bounds[1]:
                left_out[name] = f"its {exponent} is {taken[exponent]:.4g} there, beyond the bounds in [parameters]"
            else:
                continue
            del taken[name]
    left_out |= {name: "given in [parameters]" for name in wished if name in taken}
    taken = {name: value for name, value in taken.items() if name not in wished}
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    return StartedFrom(file=str(file), sha256=digest, taken=taken, left_out=left_out)


def _each(
    laws: Sequence[str], fitted: Callable[[str, Progress], FitResult], progress: Progress
) -> tuple[dict[str, FitResult], dict[str, Exception]]:
    """Fits with each law by name, and the errors of those that could not be fitted."""
    found, refused = dict[str, FitResult](), dict[str, Exception]()
    for law in dict.fromkeys(laws):
        try:
            found[law] = fitted(law, lambda line, law=law: progress(f"{law}: {line}"))
        except FAILURES as error:
            refused[law] = error
            progress(f"{law} cannot be fitted: {error}")
    return found, refused


def _loaded(experiment: Path, progress: Progress) -> Experiment:
    """Read an experiment, and say at once what is odd about it."""
    loaded = load_experiment(experiment)
    for warning in loaded.warnings:
        progress(WarningLine(f"warning: {warning}"))
    return loaded


def check_converged(result: FitResult) -> None:
    """Raise `NoConvergenceError`, with what to do, if a fit stopped early."""
    if not result.converged:
        remedy = "check units, signs, mass and gaps, or ask `vibrojax diagnose` where model and records differ"
        if result.added is not None:
            remedy = f"leave {joined(result.added.names)} out, or fit fewer effects"
        reason = f": {result.warnings[0]}" if result.warnings else ""
        raise NoConvergenceError(f"the fit of {result.experiment.name!r} did not converge{reason}; {remedy}")


def write_fit(
    result: FitResult, folder: Path, reference: Reference | None = None, style: PageStyle = SCREEN, progress: Progress = lambda stage: None
) -> None:
    """Write fit.json, model.json, result.nc, report.html and plots, and posterior.nc if it was sampled, into a folder that exists."""
    origin = provenance(result)
    write_json(fit_json(result), folder / "fit.json")
    write_model(result.model, folder / "model.json", provenance=origin)
    write_dataset(fit_dataset(StoredFit(result=result, reference=reference, provenance=origin)), folder / FILE_NAME)
    if result.posterior is not None:
        write_posterior(result.posterior, folder / POSTERIOR_FILE, {"experiment": result.experiment.name, "created_by": "vibrojax fit"})
    write_report(result, folder, reference=reference, provenance=origin, style=style, progress=progress)
    state_files(folder / "fit.json", folder)


def run_diagnose(
    experiment: Path,
    folder: Path,
    *,
    only: Sequence[str] = (),
    without: Sequence[str] = (),
    terms: Sequence[str] = (),
    starts: Mapping[str, float] | None = None,
    budget_minutes: float = 5.0,
    style: PageStyle = SCREEN,
    progress: Progress = lambda stage: None,
    show: Show = lambda summary: None,
) -> None:
    """Diagnose an experiment, show the numbers; write diagnosis.json, nominal.json, model.json, result.nc, report.html and plots.

    `terms` are forces as formulas, each looked for like a listed effect, with first values `starts` of their parameters. `show` is called
    with the tables for a terminal before anything is drawn. Raises `InputError` before any fitting where the input cannot be used,
    `NoConvergenceError` where the nominal model cannot be fitted.
    """
    own = read_terms(terms, starts)
    among = among_effects(only, without, own)
    progress("reading the records")
    diagnosis = diagnose_experiment(_loaded(experiment, progress), among=among, terms=own, budget_minutes=budget_minutes, progress=progress)
    show(diagnosis_summary(diagnosis))
    write_diagnosed(diagnosis, folder, style, progress)


def write_diagnosed(diagnosis: Diagnosis, folder: Path, style: PageStyle = SCREEN, progress: Progress = lambda stage: None) -> None:
    """Write diagnosis.json, nominal.json, model.json, result.nc, report.html and plots into a folder that exists."""
    origin = diagnosis_provenance(diagnosis)
    write_json(plain(diagnosis.document(origin)), folder / "diagnosis.json")
    write_model(diagnosis.nominal_model, folder / "nominal.json", provenance=origin)
    write_model(diagnosis.model, folder / "model.json", provenance=origin)
    write_dataset(diagnosis_dataset(StoredDiagnosis(diagnosis=diagnosis, provenance=origin)), folder / FILE_NAME)
    write_diagnosis_report(diagnosis, folder, provenance=origin, style=style, progress=progress)
    state_files(folder / "diagnosis.json", folder)


def _units(model: Model, effects: Sequence[str], terms: Sequence[Formula] = ()) -> dict[str, str]:
    """Unit by name of every number that a fit of the model with these effects and terms gives, those derived from others included."""
    known, names = known_effects(terms), (*(term.name for term in terms), *effects)
    units = {p.name: p.unit for p in (*model.parameters, MASS)}
    units |= {f"{name}.{p.name}": p.unit for name in names for p in known[name].parameters}
    return units | DERIVED if "f_n" in units else units


def run_report(
    finished: Path,
    folder: Path,
    *,
    style: PageStyle = SCREEN,
    in_place: bool = False,
    progress: Progress = lambda stage: None,
    show: Show = lambda summary: None,
) -> None:
    """Show the numbers of an earlier fit or diagnosis, and write its report.html and plots into `folder`, from the result.nc in `finished`.

    `in_place`: the files will go to `finished`, so that its fit.json or diagnosis.json, where there is one, has to state their checksums.
    Raises `InputError` where there is no such result.
    """
    stored = read_stored(finished / FILE_NAME, {"fit": stored_fit, "diagnosis": stored_diagnosis})
    if isinstance(stored, StoredDiagnosis):
        show(diagnosis_summary(stored.diagnosis))
        write_diagnosis_report(stored.diagnosis, folder, provenance=stored.provenance, style=style, progress=progress)
        stating = finished / "diagnosis.json"
    else:
        show(fit_summary(stored.result, stored.reference))
        write_report(stored.result, folder, reference=stored.reference, provenance=stored.provenance, style=style, progress=progress)
        stating = finished / "fit.json"
    if in_place:
        with contextlib.suppress(OSError, ValueError, AttributeError, TypeError):  # none there, or not one of ours: it stays as it is
            state_files(stating, folder)


def run_simulate(model: Path, experiment: Path, folder: Path, *, out: Path | None = None, as_recorded: bool = False) -> None:
    """Simulate every record of an experiment and write one CSV each into `folder`, from where they go to `out`.

    Raises `InputError` where a table would take the place of a record, or where the experiment declares another load than the model's.
    """
    fitted, loaded = read_model(model), load_experiment(experiment, need_files=False)
    declared = (loaded.load.incline, loaded.load.constant_force)
    if any(declared) and declared != (fitted.load.incline, fitted.load.constant_force):
        raise InputError(
            f"the experiment's [rig] has an incline of {declared[0]:g} rad and a constant force of {declared[1]:g} N, and the model has "
            f"{fitted.load.incline:g} rad and {fitted.load.constant_force:g} N: expected the same; change 'load' of the model, or [rig]"
        )
    tables = {((out or folder) / f"{record.stem}.csv").resolve() for record in loaded.records}
    if replaced := [record.file for record in loaded.records if (loaded.folder / record.file).resolve() in tables]:
        raise InputError(f"the tables would replace the records {', '.join(replaced)}: expected another folder; give it with --out")
    for record in loaded.records:
        series = simulate_record(fitted, record, as_recorded=as_recorded)
        table, header = np.stack(list(series.values()), axis=1), ",".join(series)
        formats = ["%.17g"] + ["%.10g"] * (table.shape[1] - 1)  # time stamps may lie far from zero
        np.savetxt(folder / f"{record.stem}.csv", table, fmt=formats, delimiter=",", header=header, comments="")
