"""The package in four calls: load an experiment, fit it, diagnose it, simulate it.

The first needs no JAX; the others compute in double precision, which is the caller's to set: `jax.config.update("jax_enable_x64", True)`.
"""

import abc
import dataclasses
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr
from rich.console import Console, RenderableType

from identification.commands.run import check_converged, write_diagnosed, write_fit
from identification.diagnosis.diagnose import diagnose_experiment
from identification.diagnosis.diagnosis import Diagnosis
from identification.diagnosis.files import StoredDiagnosis, diagnosis_dataset, diagnosis_provenance
from identification.diagnosis.scores import among_effects
from identification.estimation.estimate import fit_experiment
from identification.estimation.likelihood import DRAWS, FEWEST
from identification.estimation.simulate import simulate_record
from identification.experiment import Experiment, load_experiment
from identification.guesses.declared_model import check_precision
from identification.report import diagnosis_summary, fit_summary
from identification.report.base import STYLES, PageStyle
from identification.result.files import StoredFit, fit_dataset, provenance
from identification.result.posterior import check_extra
from identification.result.result import FitResult, ParameterEstimate
from identification.trajectory.fit import Progress
from vibrojax.aside import filled, of_earlier_set
from vibrojax.effects.formula import terms as read_terms
from vibrojax.errors import InputError
from vibrojax.model import Model


class _Shown(abc.ABC):
    """A result that shows its tables in a terminal or a notebook, and writes its report."""

    @abc.abstractmethod
    def _tables(self) -> RenderableType:
        """What the command prints."""

    @abc.abstractmethod
    def _write(self, folder: Path, style: PageStyle) -> None:
        """Write what the command writes."""

    def report(self, folder: Path | str, style: str = "screen") -> Path:
        """Write what the command writes, all of it or nothing, and return the path of the page.

        Arguments:
            folder: made where it is not there.
            style: "screen" for colours, "print" for black and white.

        Raises:
            InputError: an unknown style; nothing is written then.
        """
        if style not in STYLES:
            raise InputError(f"style is {style!r}: expected one of {', '.join(STYLES)}")
        path = Path(folder)
        with filled(path, outdated=of_earlier_set) as aside:
            self._write(aside, STYLES[style])
        return path / "report.html"

    def __repr__(self) -> str:
        return self._printed().export_text()

    def _repr_html_(self) -> str:
        return self._printed().export_html(inline_styles=True, code_format='<pre style="line-height:1.3">{code}</pre>')

    def _printed(self) -> Console:
        console = Console(file=io.StringIO(), width=140, highlight=False, force_jupyter=False, record=True)
        console.print(self._tables())
        return console


@dataclasses.dataclass(frozen=True, repr=False)
class Fit(_Shown):
    """A fitted experiment: shown as the tables of `fit-parameters`.

    Attributes:
        result: everything that was estimated, with the records beside their predictions.
    """

    result: FitResult

    @property
    def model(self) -> Model:
        """Fitted; runs with any integrator."""
        return self.result.model

    @property
    def parameters(self) -> dict[str, ParameterEstimate]:
        """By name: value, standard error, interval, status."""
        return {one.spec.name: one for one in self.result.parameters}

    def to_xarray(self) -> xr.Dataset:
        """Every record beside its prediction, SI, and the estimates with their standard errors over `parameter`."""
        found = fit_dataset(StoredFit(result=self.result, reference=None, provenance=provenance(self.result)))
        values = [one.value for one in self.parameters.values()]
        errors = [float("nan") if one.stderr is None else one.stderr for one in self.parameters.values()]
        return found.assign_coords(parameter=list(self.parameters)).assign(estimate=("parameter", values), stderr=("parameter", errors))

    def _tables(self) -> RenderableType:
        return fit_summary(self.result)

    def _write(self, folder: Path, style: PageStyle) -> None:
        write_fit(self.result, folder, style=style)


@dataclasses.dataclass(frozen=True, repr=False)
class Diagnosed(_Shown):
    """What the nominal model of an experiment leaves out: shown as the tables of `vibrojax diagnose`.

    Attributes:
        diagnosis: verdict, evidence, and the models before and after.
    """

    diagnosis: Diagnosis

    @property
    def verdict(self) -> str:
        """One of "adequate", "restless", "missing", "unlisted" and "undecided"."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the asserted effects, the most probable first."""
        return tuple(one.effect.name for one in self.diagnosis.effects)

    @property
    def model(self) -> Model:
        """With the effects; the nominal one where nothing is missing."""
        return self.diagnosis.model

    def to_xarray(self) -> xr.Dataset:
        """Every record beside both models, SI, and the profiles of the misfit."""
        return diagnosis_dataset(StoredDiagnosis(diagnosis=self.diagnosis, provenance=diagnosis_provenance(self.diagnosis)))

    def _tables(self) -> RenderableType:
        return diagnosis_summary(self.diagnosis)

    def _write(self, folder: Path, style: PageStyle) -> None:
        write_diagnosed(self.diagnosis, folder, style=style)


def fit(
    experiment: Experiment | Path | str,
    *,
    law: str | None = None,
    effects: Sequence[str] = (),
    terms: Sequence[str] = (),
    starts: Mapping[str, float] | None = None,
    seed: int = 0,
    smoothing: float | None = None,
    posterior: bool = False,
    draws: int = DRAWS,
    profiles: bool = False,
    progress: Progress = lambda stage: None,
) -> Fit:
    """Estimate the parameters of the nominal model, or of one with effects.

    Args:
        experiment: loaded, or the path of its folder or `experiment.toml`.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        effects: names of those that are added to the nominal model and fitted with it; `diagnose` looks for effects.
        terms: forces on the hammer as formulas, or NAME=formula, which are fitted with it: "-a*u_dot*abs(u_dot)", N, positive towards the
            stop; symbols as in `vibrojax.effects.formula.Formula`.
        starts: first values by name, SI, of parameters of the terms that are no strengths.
        seed: of every random draw.
        smoothing: width of the contact switch, m, with which Diffrax fits the smoothed law as well; None for the exact contact alone.
        posterior: whether to sample the posterior of the parameters; needs the extra `bayes`.
        draws: weighted ones of it.
        profiles: whether to work out profiles of the likelihood.
        progress: called with a line of text at each stage.

    Raises:
        InputError: JAX computes in single precision, the experiment or a formula cannot be used, a name is unknown, or the smoothed contact
            does not go with the law or the effects.
        NoConvergenceError: the fit did not converge.
    """
    check_precision()
    if draws < FEWEST:
        raise InputError(f"draws is {draws}: expected {FEWEST} or more")
    if posterior:
        check_extra()
    among_effects(only=effects)
    result = fit_experiment(
        _loaded(experiment),
        law=law,
        effects=tuple(dict.fromkeys(effects)),
        terms=read_terms(terms, starts),
        seed=seed,
        smoothing=smoothing,
        draws=draws if posterior else None,
        with_profiles=profiles,
        progress=progress,
    )
    check_converged(result)
    return Fit(result)


def diagnose(
    experiment: Experiment | Path | str,
    *,
    law: str | None = None,
    only: Sequence[str] = (),
    without: Sequence[str] = (),
    terms: Sequence[str] = (),
    starts: Mapping[str, float] | None = None,
    budget_minutes: float = 5.0,
    progress: Progress = lambda stage: None,
) -> Diagnosed:
    """Say what the nominal model leaves out, and model it.

    Args:
        experiment: loaded, or the path of its folder or `experiment.toml`.
        law: contact law by name; the experiment's own, else Hunt-Crossley, if None.
        only: names of effects or terms; no others are looked for. Left out: all that are listed, and the terms.
        without: names of effects that are not looked for.
        terms: forces on the hammer as formulas, or NAME=formula, each looked for like a listed effect; as for `fit`.
        starts: first values by name, SI, of parameters of the terms that are no strengths; several values are tried where none is given.
        budget_minutes: no new search step is begun after so long; the verdict is then "undecided".
        progress: called with a line of text at each stage.

    Raises:
        InputError: JAX computes in single precision, the experiment or a formula cannot be used, or a name is unknown.
        NoConvergenceError: the nominal model cannot be fitted at all.
    """
    check_precision()
    if not budget_minutes > 0.0:
        raise InputError(f"budget_minutes is {budget_minutes:g}: expected minutes, above 0")
    own = read_terms(terms, starts)
    among, loaded = among_effects(only, without, own), _loaded(experiment)
    found = diagnose_experiment(loaded, law=law, among=among, terms=own, budget_minutes=budget_minutes, progress=progress)
    return Diagnosed(found)


def simulate(model: Model, experiment: Experiment | Path | str, *, as_recorded: bool = False) -> dict[str, xr.Dataset]:
    """Every channel of every record as a model has it, SI, over `time` in s; by the stem of the record's file.

    Args:
        model: such as that of a fit.
        experiment: loaded, or the path of its folder or `experiment.toml`; its records need not be there.
        as_recorded: with the faults of the recorder that are among the model's effects.

    Raises:
        InputError: JAX computes in single precision, or a record does not state how it begins.
        NoConvergenceError: a record cannot be integrated.
    """
    check_precision()
    if not isinstance(model, Model):
        raise InputError(f"the model is of type {type(model).__name__}: expected a Model, such as `.model` of a fit or `read_model(path)`")
    loaded = _loaded(experiment, need_files=False)
    series = {record.stem: simulate_record(model, record, as_recorded=as_recorded) for record in loaded.records}
    return {
        stem: xr.Dataset({name: ("time", values) for name, values in one.items() if name != "time"}, coords={"time": one["time"]})
        for stem, one in series.items()
    }


def _loaded(experiment: Experiment | Path | str, *, need_files: bool = True) -> Experiment:
    if not isinstance(experiment, Experiment | Path | str):
        raise InputError(f"the experiment is of type {type(experiment).__name__}: expected one that is loaded, or a path")
    return experiment if isinstance(experiment, Experiment) else load_experiment(Path(experiment), need_files=need_files)
