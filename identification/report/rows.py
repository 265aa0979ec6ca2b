"""A fit as rows of text, the same for the terminal and the page."""

import dataclasses

import numpy as np

from identification.experiment import Experiment, ParameterOption, Record
from identification.result.reference import Comparison
from identification.result.result import OK, FitResult, ParameterEstimate, RecordFit
from identification.result.variation import Disagreement
from identification.wording.names import label
from identification.wording.numbers import NONE, chance_text, percent, rounded, significant, unit_text, with_unit
from vibrojax.model import Model

LISTED_FROM = 0.1
"""Correlations below this are left out of lists."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ParameterRow:
    """One parameter as printed."""

    symbol: str
    name: str
    meaning: str
    value: str
    error: str
    percent: str
    interval: str
    interval_from: str
    initial: str
    unit: str
    status: str
    reason: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class ChannelRow:
    """One fitted channel of one record: its noise, and its misfit in terms of noise and of signal."""

    channel: str
    noise: str
    noise_from: str
    misfit: str
    nrmse: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class ComparisonRow:
    """One parameter beside its reference value."""

    symbol: str
    fitted: str
    reference: str
    unit: str
    sigmas: str
    percent: str
    remark: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class AloneRow:
    """One parameter as each record alone estimates it, beside the estimate from all together.

    Attributes:
        symbol, unit: of the parameter.
        together: estimate from all records, one value for all.
        records: file, estimate, and its deviation from the mean over records in its own standard errors.
        test: scatter over the errors as chi-square (Cochran's Q), its degrees of freedom, and the chance that noise scatters as much.
        scatter: standard deviation between records beyond the errors.
        pooled: mean over records, with the error that allows for the scatter.
    """

    symbol: str
    unit: str
    together: str
    records: tuple[tuple[str, str, str], ...]
    test: str
    scatter: str
    pooled: str


def parameter_rows(result: FitResult) -> list[ParameterRow]:
    """Shared parameters in the order of the fit."""
    return [_parameter(estimate, result.experiment.parameters.get(estimate.spec.name)) for estimate in result.parameters]


def wishes(result: FitResult) -> list[tuple[str, str]]:
    """Symbol of every parameter for which the operator set more than a start, and what."""
    options = result.experiment.parameters
    rows = [(p.spec.symbol, _wish(p, options[p.spec.name])) for p in result.parameters if p.spec.name in options]
    return [(symbol, text) for symbol, text in rows if text]


def unfitted_words(result: FitResult) -> str:
    """How windows that were not fitted are predicted, as one sentence; empty where all were fitted."""
    rest = result.unfitted
    if rest is None:
        return ""
    windows = f"{rest.windows} windows that were not fitted are" if rest.windows > 1 else "One window that was not fitted is"
    return (
        f"{windows} predicted with a median chi-square of {significant(rest.chi2_reduced, 3)} ({significant(rest.of_fitted, 3)} in the "
        f"fitted ones), with nothing but their initial states estimated{f'; {rest.failed} could not be integrated' if rest.failed else ''}."
    )


def alone_rows(result: FitResult) -> list[AloneRow]:
    """Parameters that several records identify, each record alone, in the order of the fit."""
    estimates = {one.spec.name: one for one in result.parameters}
    return [_alone(one, estimates[one.name]) for one in result.between_records]


def _alone(one: Disagreement, together: ParameterEstimate) -> AloneRow:
    mean, error = one.pooled
    return AloneRow(
        symbol=together.spec.symbol,
        unit=unit_text(together.spec.unit),
        together=rounded(together.value, together.stderr).text,
        records=tuple(
            (file, rounded(value, stderr).text, _signed((value - mean) / stderr, " σ")) for file, (value, stderr) in one.records.items()
        ),
        test=f"{significant(one.chi2, 3)} of {one.degrees} ({chance_text(one.chance)})",
        scatter=significant(one.scatter, 2),
        pooled=rounded(mean, error).text,
    )


def derived_rows(result: FitResult) -> list[tuple[str, str, str]]:
    """Symbol, value with error, and unit of what follows from the parameters."""
    return [(d.symbol, rounded(d.value, d.stderr).text, unit_text(d.unit)) for d in result.derived]


def reasons(result: FitResult) -> list[tuple[str, str, str]]:
    """Symbol, status and reason of every parameter without a standard error."""
    return [(p.spec.symbol, p.status, p.reason) for p in result.parameters if p.status != OK]


def correlations(result: FitResult) -> list[tuple[str, str, float]]:
    """Symbols and correlation of every pair that is listed, the strongest first."""
    symbols = {p.spec.name: p.spec.symbol for p in result.parameters}
    names = [symbols.get(name, name) for name in result.correlated]
    pairs = [(names[i], names[j], float(result.correlation[i, j])) for i in range(len(names)) for j in range(i)]
    return sorted((pair for pair in pairs if abs(pair[2]) > LISTED_FROM), key=lambda pair: -abs(pair[2]))


def channel_rows(record: RecordFit, experiment: Experiment) -> list[ChannelRow]:
    """Fitted channels of a record."""
    read = recorded(record, experiment)
    estimated = read.noise_estimated if read is not None else frozenset()
    looks = {channel: label(channel, experiment) for channel in record.chi2_reduced}
    return [
        ChannelRow(
            channel=looks[channel].words,
            noise=with_unit(significant(looks[channel].factor * record.noise[channel], 2), looks[channel].unit),
            noise_from="estimated" if channel in estimated else "declared",
            misfit=significant(chi2**0.5),
            nrmse=significant(record.nrmse.get(channel, float("nan")), 2),
        )
        for channel, chi2 in record.chi2_reduced.items()
    ]


def load_words(model: Model) -> str:
    """Known constant forces on the hammer, with the sum towards the stop; empty where there are none."""
    parts, load = [], model.load
    if load.incline:
        parts.append(f"incline of {float(np.degrees(load.incline)):.4g}°")
    if load.constant_force:
        parts.append(f"constant force of {float(load.constant_force):.4g} N")
    if not parts:
        return ""
    force = float(load.force(model.mass))
    return f"{' and '.join(parts)}: {abs(force):.4g} N {'towards' if force >= 0.0 else 'away from'} the stop at all times"


def recorded(record: RecordFit, experiment: Experiment) -> Record | None:
    """The record as it was read."""
    return next((read for read in experiment.records if read.file == record.file), None)


def nuisance_rows(record: RecordFit) -> list[tuple[str, str, str]]:
    """Name, value with error, and unit of the numbers estimated for one record only."""
    found = []
    for nuisance in record.nuisances:
        factor, unit = _readable(nuisance.unit)
        error = None if nuisance.stderr is None else factor * nuisance.stderr
        name = nuisance.name.replace("_", " ")
        if nuisance.name.startswith("variation."):
            name = f"deviation of {nuisance.name.partition('.')[2]}"
        found.append((name, rounded(factor * nuisance.value, error).text, unit))
    return found


def gap_in_mm(record: RecordFit) -> str:
    """Gap with the error of its estimate, mm."""
    error = next((n.stderr for n in record.nuisances if n.name == "gap_error"), None)
    return rounded(1e3 * record.gap, None if error is None else 1e3 * error).text


def comparison_rows(comparisons: tuple[Comparison, ...]) -> list[ComparisonRow]:
    """Fitted values beside their references."""
    return [
        ComparisonRow(
            symbol=row.symbol,
            fitted=rounded(row.value, row.stderr).text,
            reference=NONE if row.reference is None else rounded(row.reference, row.reference_stderr).text,
            unit=unit_text(row.unit),
            sigmas=_signed(row.sigmas, " σ"),
            percent=_signed(row.percent, " %"),
            remark=row.remark,
        )
        for row in comparisons
    ]


@dataclasses.dataclass(frozen=True, kw_only=True)
class PosteriorRow:
    """One parameter's posterior as printed, beside the interval of the fit."""

    symbol: str
    mean: str
    std: str
    interval: str
    of_fit: str
    unit: str
    rhat: str
    ess: str


def posterior_rows(result: FitResult) -> list[PosteriorRow]:
    """Sampled parameters; none where the posterior was not sampled."""
    sample, listed = result.posterior, {p.spec.name: p for p in result.parameters}
    if sample is None:
        return []
    rows = []
    for index, name in enumerate(sample.names):
        values, estimate = sample.pooled[:, index], listed[name]
        shown = rounded(float(values.mean()), float(values.std(ddof=1)))
        ends = [sample.interval(name), estimate.ci95]
        texts = [NONE if pair is None else f"{shown.alike(pair[0])} … {shown.alike(pair[1])}{shown.times}" for pair in ends]
        rows.append(
            PosteriorRow(
                symbol=estimate.spec.symbol,
                mean=shown.value + shown.times,
                std=f"{shown.error}{shown.times}",
                interval=texts[0],
                of_fit=texts[1],
                unit=unit_text(estimate.spec.unit),
                rhat=f"{sample.rhat[index]:.3f}",
                ess=f"{sample.ess_bulk[index]:.0f}",
            )
        )
    return rows


def posterior_words(result: FitResult) -> str:
    """How the posterior was sampled, in one sentence; empty where it was not."""
    if result.posterior is None:
        return ""
    chains, draws = result.posterior.log_density.shape
    return (
        f"Posterior of the same likelihood (flat in the coordinates of the fit, times the priors above if any): {chains} chains of {draws}"
        f" draws by the No-U-Turn Sampler, {int(result.posterior.divergent.sum())} divergent; R-hat near 1 where the chains have met"
    )


def _wish(estimate: ParameterEstimate, option: ParameterOption) -> str:
    """What the operator set for a parameter, in words."""
    unit, found = unit_text(estimate.spec.unit), []
    if option.fixed and option.start is not None:
        found.append(f"fixed at {with_unit(f'{option.start:g}', unit)}")
    if option.bounds is not None:
        low, high = option.bounds
        found.append(f"bounds {low:g} … {with_unit(f'{high:g}', unit)}")
    if option.prior is not None:
        found.append(f"prior {option.prior.mean:g} ± {with_unit(f'{option.prior.std:g}', unit)}")
    if estimate.between is not None:
        size = with_unit(significant(estimate.between, 2), unit)
        found.append(f"varies between records, standard deviation {size}" if estimate.between else "no variation between records found")
    return ", ".join(found)


def _parameter(estimate: ParameterEstimate, option: ParameterOption | None) -> ParameterRow:
    shown = rounded(estimate.value, estimate.stderr)
    interval = NONE
    if estimate.ci95 is not None:
        low, high = (shown.alike(limit) for limit in estimate.ci95)
        interval = f"{low} … {high}{shown.times}"
    return ParameterRow(
        symbol=estimate.spec.symbol,
        name=estimate.spec.name,
        meaning=estimate.spec.meaning,
        value=shown.value + shown.times,
        error=f"{shown.error}{shown.times}" if shown.error else NONE,
        percent=percent(estimate.stderr, estimate.value),
        interval=interval,
        interval_from=estimate.interval if estimate.ci95 is not None else "",
        initial=significant(estimate.initial, 4),
        unit=unit_text(estimate.spec.unit),
        status=", ".join((estimate.status, *_marks(estimate, option))),
        reason=estimate.reason,
    )


def _marks(estimate: ParameterEstimate, option: ParameterOption | None) -> list[str]:
    """Words behind the status of a parameter that is held by more than the records, or that is not one number."""
    return ["prior"] * (option is not None and option.prior is not None) + ["varies"] * bool(estimate.between)


def _readable(unit: str) -> tuple[float, str]:
    """Metres are printed in millimetres."""
    return (1e3, "mm") if unit == "m" else (1.0, unit_text(unit))


def _signed(number: float | None, unit: str) -> str:
    if number is None:
        return NONE
    return ("+" if number > 0 else "") + significant(number, 2) + unit
