"""A fit as tables and sentences of text, the same for the terminal and the page; and the summary that a terminal shows."""

import dataclasses
from collections.abc import Iterable, Mapping

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from identification.experiment import Experiment, ParameterOption
from identification.report.base import recorded
from identification.report.verdict import GOOD, judge
from identification.result.evidence import Unrest
from identification.result.posterior import SHAPE_LIMIT
from identification.result.reference import Comparison, Reference, compare, unmatched
from identification.result.result import OK, FitResult, ParameterEstimate, RecordFit, SensorError
from identification.wording.names import label, spoken, symbol_text
from identification.wording.numbers import NONE, chance_text, compact, grouped, joined, percent, rounded, significant, unit_text, with_unit
from vibrojax.model import Model

LISTED_FROM = 0.1
"""Correlations below this are left out of lists."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    """A table of text.

    Attributes:
        columns: headings.
        rows: a cell a column.
        words: places of the columns that hold words; numbers are set to the right.
        symbols: whether the first column holds symbols of parameters.
        names, meanings: what stands beside each first cell, in the terminal and on the page.
        bold: places of the rows that matter most.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: tuple[int, ...] = (0,)
    symbols: bool = False
    names: tuple[str, ...] = ()
    meanings: tuple[str, ...] = ()
    bold: tuple[int, ...] = ()

    def without(self, *headings: str) -> "Table":
        """The table without some of its columns."""
        kept = [place for place, heading in enumerate(self.columns) if heading not in headings]
        rows = tuple(tuple(row[place] for place in kept) for row in self.rows)
        words = tuple(new for new, place in enumerate(kept) if place in self.words)
        return dataclasses.replace(self, columns=tuple(self.columns[place] for place in kept), rows=rows, words=words)

    def for_terminal(self) -> RichTable:
        """An open table, narrow enough for 80 columns; brackets in a cell are no markup."""
        shown, above = RichTable(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)), ""
        for place, heading in enumerate(self.columns):
            shown.add_column(heading, justify="left" if place in self.words else "right", overflow="fold")
        for number, (first, *others) in enumerate(self.rows):
            name = self.names[number] if self.names else ""
            head = " ".join(dict.fromkeys(one for one in (symbol_text(first), name) if one)) if self.symbols else first
            cells = [Text(compact(cell)) for cell in ("" if head == above else head, *others)]
            shown.add_row(*cells, style="bold" if number in self.bold else "")
            above = head
        return shown


def fit_summary(result: FitResult, reference: Reference | None = None) -> Group:
    """Everything a reader wants on one screen after a fit.

    Nothing is printed here: `rich.console.Console.print` does that. A `reference` is set beside the fitted values.

    Raises:
        InputError: the reference does not suit the fit.
    """
    blocks: list[RenderableType] = [_verdict(result), parameters(result).for_terminal()]
    blocks += [Text(f"  {symbol_text(symbol)}: {text}") for symbol, text in (*reasons(result), *wishes(result))]
    if result.derived:
        blocks.append(Text(f"derived: {', '.join(f'{symbol_text(symbol)} = {value}' for symbol, value in derived(result))}"))
    blocks.append(Text(f"correlations above {LISTED_FROM}: {correlated(result)}"))
    blocks += [Text(words) for words in (smoothed_words(result),) if words]
    if result.posterior is not None:
        blocks += [Text(f"{posterior_words(result)}:"), posterior(result).for_terminal()]
    blocks += [found(result.records, result.experiment).for_terminal() for found in (records, channels)]
    blocks += [reading_errors(result.reading_error, result.experiment).for_terminal()]
    blocks += [Text(shares(result.reading_error, result.unrest, result.force_share))]
    if result.between_records:
        blocks += [Text("estimates of each record alone:"), between(result).for_terminal()]
    if result.held_back:
        blocks += [Text("not fitted, predicted:"), channels(result.held_back, result.experiment).for_terminal()]
        blocks += [Text("error of forecasts of them, over the standard deviation of the channel:"), forecasts(result).for_terminal()]
    if reference is not None:
        table, lines = comparison(compare(result, reference), reference)
        blocks += [Text(f"beside {reference.title}:"), *([table.for_terminal()] if table.rows else []), *map(Text, lines)]
    blocks += [Text(f"{record.file}: {notice}") for record in result.records for notice in record.notices]
    return Group(*blocks, *(Text(f"warning: {warning}", style="bold") for warning in (*result.experiment.warnings, *result.warnings)))


def _verdict(result: FitResult) -> Text:
    verdict, samples = judge(result), sum(record.samples for record in result.records)
    text = Text("\n".join((verdict.sentence, *verdict.remarks)), style="bold" if verdict.level != GOOD else "")
    counts = f"{len(result.records)} records, {samples} samples, {result.degrees} degrees of freedom"
    said = [f"{result.experiment.name}: {counts}", f"{result.model.law.title}, {result.model.suspension.name} suspension"]
    if load := load_words(result.model):
        said.append(f"known load: {load}")
    if result.started_from is not None:
        said.append(result.started_from.sentence())
    if filters := filter_words(result.model):
        said.append(f"declared filters: {filters}")
    return text.append("".join(f"\n{line}" for line in said), "not bold")


def parameters(result: FitResult) -> Table:
    """Shared parameters in the order of the fit."""
    found = result.parameters
    return Table(
        columns=("parameter", "value", "std. error", "relative", "95 % interval", "unit", "status", "first guess"),
        rows=tuple(_parameter(one, result.experiment.parameters.get(one.spec.name)) for one in found),
        words=(0, 4, 5, 6),
        symbols=True,
        names=tuple(one.spec.name for one in found),
        meanings=tuple(one.spec.meaning or one.spec.name for one in found),
    )


def _parameter(estimate: ParameterEstimate, option: ParameterOption | None) -> tuple[str, ...]:
    shown, spec = rounded(estimate.value, estimate.stderr), estimate.spec
    marks = ["prior"] * (option is not None and option.prior is not None) + ["varies"] * bool(estimate.between)
    marks += ["interval by profile"] * (estimate.ci95 is not None and estimate.interval == "profile")
    return (
        spec.symbol,
        shown.value + shown.times,
        f"{shown.error}{shown.times}" if shown.error else NONE,
        percent(estimate.stderr, estimate.value),
        NONE if estimate.ci95 is None else f"{shown.alike(estimate.ci95[0])} … {shown.alike(estimate.ci95[1])}{shown.times}",
        unit_text(spec.unit),
        ", ".join((estimate.status, *marks)),
        significant(estimate.initial, 4),
    )


def wishes(result: FitResult) -> list[tuple[str, str]]:
    """Symbol of every parameter for which the operator set more than a start, and what."""
    options = result.experiment.parameters
    return [(p.spec.symbol, text) for name, p in result.named.items() if name in options and (text := _wish(p, options[name]))]


def _wish(estimate: ParameterEstimate, option: ParameterOption) -> str:
    unit, found, size = estimate.spec.unit, [], estimate.between
    if option.fixed and option.start is not None:
        found.append(f"fixed at {with_unit(f'{option.start:g}', unit)}")
    if option.bounds is not None:
        found.append(f"bounds {option.bounds[0]:g} … {with_unit(f'{option.bounds[1]:g}', unit)}")
    if option.prior is not None:
        found.append(f"prior {option.prior.mean:g} ± {with_unit(f'{option.prior.std:g}', unit)}")
    if size is not None:
        found.append(
            f"varies between records, standard deviation {with_unit(significant(size, 2), unit)}"
            if size
            else "no variation between records found"
        )
    return ", ".join(found)


def derived(result: FitResult) -> list[tuple[str, str]]:
    """Symbol, and value with error and unit, of what follows from the parameters."""
    return [(d.symbol, with_unit(rounded(d.value, d.stderr).text, d.unit)) for d in result.derived]


def reasons(result: FitResult) -> list[tuple[str, str]]:
    """Symbol, and status with reason, of every parameter without a standard error."""
    return [(p.spec.symbol, p.status + (f": {p.reason}" if p.reason else "")) for p in result.parameters if p.status != OK]


def correlated(result: FitResult) -> str:
    """Every pair of parameters whose correlation is above `LISTED_FROM`, the strongest first."""
    matrix, names = result.correlation, _symbols(result)
    pairs = sorted(((i, j) for i in range(len(names)) for j in range(i)), key=lambda pair: -abs(matrix[pair]))
    listed = [f"{names[i]}–{names[j]} {matrix[i, j]:+.3f}".replace("-", "−") for i, j in pairs if abs(matrix[i, j]) > LISTED_FROM]
    return ", ".join(listed) or "none"


def correlations(result: FitResult) -> Table:
    """The whole matrix."""
    names = _symbols(result)
    rows = [(name, *(f"{value:.3f}".replace("-", "−") for value in row)) for name, row in zip(names, result.correlation, strict=True)]
    return Table(columns=("", *names), rows=tuple(rows))


def _symbols(result: FitResult) -> list[str]:
    return [symbol_text(result.named[name].spec.symbol) for name in result.correlated]


def records(fits: Iterable[RecordFit], experiment: Experiment) -> Table:
    """What the fit rests on: the records, their drive, and the gap as estimated."""
    rows = []
    for one in fits:
        read, error = recorded(one, experiment), next((n.stderr for n in one.nuisances if n.name == "gap_error"), None)
        drive = significant(None if read is None else read.excitation_frequency, 4)
        gap = rounded(1e3 * one.gap, None if error is None else 1e3 * error).text
        rows.append((one.file, one.kind, drive, gap, str(one.samples), str(one.windows)))
    return Table(columns=("record", "kind", "drive (Hz)", "gap (mm)", "samples", "stretches"), rows=tuple(rows), words=(0, 1))


def channels(fits: Iterable[RecordFit], experiment: Experiment) -> Table:
    """Noise and misfit of every fitted channel of every record."""
    rows = []
    for record in fits:
        read = recorded(record, experiment)
        for channel, chi2 in record.chi2_reduced.items():
            look = label(channel, experiment)
            noise = with_unit(significant(look.factor * record.noise[channel], 2), look.unit)
            origin = "estimated" if read is not None and channel in read.noise_estimated else "declared"
            nrmse = significant(record.nrmse.get(channel, float("nan")), 2)
            rows.append((record.file, look.words, noise, origin, significant(chi2**0.5), nrmse))
    return Table(columns=("record", "channel", "noise σ", "origin", "misfit/σ", "NRMSE"), rows=tuple(rows), words=(0, 1, 3))


def forecasts(result: FitResult) -> Table:
    """Errors of forecasts of the held-back records by how far they reach."""
    rows = []
    for record in result.held_back:
        for one in record.horizons:
            far = "all of it" if one.periods is None else f"{significant(one.periods, 3)} period{'s' if one.periods > 1 else ''}"
            errors = ", ".join(f"{spoken(name)} {percent(error, 1.0)}" for name, error in one.nrmse.items())
            rows.append((record.file, far, significant(one.seconds, 2), errors))
    return Table(columns=("record", "forecast over", "s", "error"), rows=tuple(rows), words=(0, 1, 3))


def reading_errors(errors: Mapping[str, SensorError], experiment: Experiment) -> Table:
    """Size and order of each channel's error as estimated, over all records."""
    rows = []
    for channel, one in errors.items():
        look = label(channel, experiment)
        rms = with_unit(significant(look.factor * one.rms, 2), look.unit)
        rows.append((look.words, rms, significant(one.over_noise, 3), "white" if one.order == 0 else f"autocorrelated, order {one.order}"))
    return Table(columns=("channel", "reading error", "over σ", "in time"), rows=tuple(rows), words=(0, 1, 3))


def shares(errors: Mapping[str, SensorError], unrest: Unrest | None, of_force: float) -> str:
    """Which share of the misfit is random force and which is error of the readings, in one sentence."""
    name, worst = max(errors.items(), key=lambda item: item[1].over_noise)
    of_readings = f"{spoken(name)} has the largest, {significant(worst.over_noise, 2)} times its noise"
    if unrest is None:
        return f"The whole misfit is put down to errors of the readings ({of_readings}), and none to a random force on the hammer."
    force, rest = percent(of_force, 1.0), percent(1.0 - of_force, 1.0)
    return f"Of the squared misfit {force} goes away with the random force on the hammer; {rest} is errors of the readings ({of_readings})."


def smoothed_words(result: FitResult) -> str:
    """Parameters of the law with a smoothed contact, in one line; empty where it was not fitted."""
    if result.smoothing is None or result.smoothed is None:
        return ""
    values = ", ".join(f"{name} = {significant(value, 5)}" for name, value in result.smoothed.items())
    return f"with the contact smoothed over {significant(1e6 * result.smoothing)} µm, fitted with Diffrax: {values}"


def noise_words(experiment: Experiment) -> str:
    """Where the noise of the sensors comes from, which every error rests on."""
    origins: dict[str, list[str]] = {}
    for record in experiment.records:
        for channel in record.noise:
            origin = "estimated from the records" if channel in record.noise_estimated else "declared"
            origins.setdefault(origin, []).append(spoken(channel))
    return f"Noise of the sensors: {joined([f'{origin} for {joined(sorted(set(names)))}' for origin, names in origins.items()])}."


def nuisances(record: RecordFit) -> str:
    """The numbers estimated for one record only."""
    found = []
    for one in record.nuisances:
        factor, unit = (1e3, "mm") if one.unit == "m" else (1.0, one.unit)
        error = None if one.stderr is None else factor * one.stderr
        variation = one.name.startswith("variation.")
        name = f"deviation of {one.name.partition('.')[2]}" if variation else one.name.replace("_", " ")
        found.append(f"{name} {with_unit(rounded(factor * one.value, error).text, unit)}")
    return "; ".join(found)


def between(result: FitResult) -> Table:
    """Mean over the records of each parameter that several of them identify, and the test of their scatter."""
    rows = []
    for one in result.between_records:
        chi2 = f"{significant(one.chi2, 3)} of {one.degrees} ({chance_text(one.chance)})"
        rows.append((result.named[one.name].spec.symbol, rounded(*one.pooled).text, significant(one.scatter, 2), chi2))
    return Table(columns=("parameter", "mean over records", "scatter", "chi-square (chance)"), rows=tuple(rows), symbols=True)


def alone(result: FitResult) -> Table:
    """Records by parameters: what each record alone would estimate, and all together."""
    found, files = result.between_records, [record.file for record in result.records]
    specs = [result.named[one.name] for one in found]
    rows = [(file, *(rounded(*one.records[file]).text if file in one.records else NONE for one in found)) for file in files]
    together = ("all together", *(rounded(one.value, one.stderr).text for one in specs))
    headings = [f"{symbol_text(one.spec.symbol)} ({unit_text(one.spec.unit) or '1'})" for one in specs]
    return Table(columns=("record", *headings), rows=(*rows, together), bold=(len(rows),))


def comparison(comparisons: tuple[Comparison, ...], reference: Reference) -> tuple[Table, list[str]]:
    """Fitted values beside those that have a reference; and a line a reason why others are not compared."""
    rows = []
    for one in comparisons:
        if one.reference is None:
            continue
        pair = (rounded(one.value, one.stderr).text, rounded(one.reference, one.reference_stderr).text)
        rows.append((one.symbol, *pair, unit_text(one.unit), _signed(one.sigmas, " σ"), _signed(one.percent, " %"), one.remark))
    columns = ("parameter", "fitted", "reference", "unit", "difference", "relative", "source")
    lines = grouped((symbol_text(one.symbol), one.remark) for one in comparisons if one.reference is None)
    if others := unmatched(comparisons, reference):
        lines.append(f"not compared, no such number in this fit: {', '.join(others[:8])}{' …' if len(others) > 8 else ''}")
    return Table(columns=columns, rows=tuple(rows), words=(0, 3, 6), symbols=True), lines


def posterior(result: FitResult) -> Table:
    """Sampled parameters beside the intervals of the fit, where the posterior was sampled."""
    sample, rows = result.posterior, []
    assert sample is not None
    for name in sample.names:
        estimate = result.named[name]
        shown = rounded(*sample.moments(name))
        ends = [sample.interval(name), estimate.ci95]
        texts = [NONE if pair is None else f"{shown.alike(pair[0])} … {shown.alike(pair[1])}{shown.times}" for pair in ends]
        numbers = (shown.value + shown.times, f"{shown.error}{shown.times}")
        rows.append((estimate.spec.symbol, *numbers, *texts, unit_text(estimate.spec.unit)))
    headings = ("parameter", "mean", "std", "95 % of the posterior", "95 % of the fit", "unit")
    return Table(columns=headings, rows=tuple(rows), words=(0, 3, 4, 5), symbols=True)


def posterior_words(result: FitResult) -> str:
    """How the posterior was sampled, in one sentence."""
    sample = result.posterior
    assert sample is not None
    return (
        f"Posterior of the same likelihood (flat in the coordinates of the fit, times the priors above if any): {len(sample.weight)} "
        f"weighted draws, worth {sample.effective:.0f} of equal weight; shape of the weights' tail {sample.tail:.2f}, "
        f"reliable up to {SHAPE_LIMIT}"
    )


def filter_words(model: Model) -> str:
    """The recorder's known filters, each with the channels that pass it; empty where there are none."""
    channels: dict[str, list[str]] = {}
    for one in model.recorder:
        channels.setdefault(one.kind, []).append(one.of_channel.replace("_", " "))
    return "; ".join(f"{kind} of {joined(names)}" for kind, names in channels.items())


def load_words(model: Model) -> str:
    """Known constant forces on the hammer, with the sum towards the stop; empty where there are none."""
    load, parts = model.load, []
    if load.incline:
        parts.append(f"incline of {float(np.degrees(load.incline)):.4g}°")
    if load.constant_force:
        parts.append(f"constant force of {float(load.constant_force):.4g} N")
    if not parts:
        return ""
    force = float(load.force(model.mass))
    return f"{' and '.join(parts)}: {abs(force):.4g} N {'towards' if force >= 0.0 else 'away from'} the stop at all times"


def _signed(number: float | None, unit: str) -> str:
    return NONE if number is None else ("+" if number > 0 else "") + significant(number, 2) + unit
