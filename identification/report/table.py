"""The fit as tables for a terminal: value, error, interval, first guess, correlations, and why an error is missing."""

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from identification.experiment import Experiment
from identification.report.rows import (
    LISTED_FROM,
    alone_rows,
    channel_rows,
    comparison_rows,
    correlations,
    derived_rows,
    load_words,
    parameter_rows,
    posterior_rows,
    posterior_words,
    reasons,
    unfitted_words,
    wishes,
)
from identification.report.verdict import GOOD, judge
from identification.result.reference import Reference, compare, unmatched
from identification.result.result import FitResult, RecordFit
from identification.wording.names import symbol_text
from identification.wording.numbers import NONE, compact, significant


def fit_summary(result: FitResult, reference: Reference | None = None) -> Group:
    """Everything a reader wants on one screen after a fit.

    Args:
        result: of the fit.
        reference: known values to set beside the fitted ones.

    Returns:
        What `rich.console.Console.print` can print; nothing is printed here.

    Raises:
        InputError: the reference does not suit the fit.
    """
    blocks: list[RenderableType] = [_verdict(result), _parameters(result)]
    blocks += [_line(f"  {symbol_text(symbol)}: {status}: {reason}") for symbol, status, reason in reasons(result)]
    blocks += [_line(f"  {symbol_text(symbol)}: {text}") for symbol, text in wishes(result)]
    if result.derived:
        values = ", ".join(f"{symbol_text(symbol)} = {value} {unit}".strip() for symbol, value, unit in derived_rows(result))
        blocks.append(_line(f"derived: {values}"))
    blocks.append(_line(_correlations(result)))
    if result.posterior is not None:
        blocks += [_line(f"{posterior_words(result)}:"), _posterior(result)]
    blocks.append(_records(result.records, result.experiment))
    if words := unfitted_words(result):
        blocks.append(_line(words))
    if result.between_records:
        blocks += [_line("mean over the estimates of each record alone:"), _alone(result)]
    if result.held_back:
        blocks += [_line("not fitted, predicted:"), _records(result.held_back, result.experiment)]
    if reference is not None:
        blocks += _comparison(result, reference)
    blocks += [_line(f"{record.file}: {notice}") for record in result.records for notice in record.notices]
    blocks += [_line(f"warning: {warning}", style="bold") for warning in (*result.experiment.warnings, *result.warnings)]
    return Group(*blocks)


def _verdict(result: FitResult) -> Text:
    verdict = judge(result)
    text = Text("\n".join((verdict.sentence, *verdict.remarks)), style="bold" if verdict.level != GOOD else "")
    samples = sum(record.samples for record in result.records)
    text.append(
        f"\n{result.experiment.name}: {len(result.records)} records, {samples} samples, {result.degrees} degrees of freedom", "not bold"
    )
    text.append(f"\n{result.model.law.title}, {result.model.suspension.name} suspension", "not bold")
    if result.smoothing is not None:
        text.append(f"; contact smoothed over {significant(1e6 * result.smoothing)} µm, integrated with Diffrax", "not bold")
    if load := load_words(result.model):
        text.append(f"\nknown load: {load}", "not bold")
    return text


def _parameters(result: FitResult) -> Table:
    table = open_table("parameter", "value", "stderr", "", "95 % interval", "initial", "unit", "status", right=(1, 2, 3, 5))
    for row in parameter_rows(result):
        last = row.name.rpartition(".")[2].replace("_", " ") if "." in row.name else row.name
        name = f"{symbol_text(row.symbol)} {last}" if row.symbol != row.name else row.name
        numbers = (compact(text) for text in (row.value, row.error, row.percent, row.interval, row.initial))
        table.add_row(name, *numbers, row.unit, row.status)
    return table


def _posterior(result: FitResult) -> Table:
    table = open_table("", "mean", "std", "95 % posterior", "95 % fit", "unit", "R-hat", "ESS", right=(1, 2, 6, 7))
    for row in posterior_rows(result):
        numbers = (compact(text) for text in (row.mean, row.std, row.interval, row.of_fit))
        table.add_row(symbol_text(row.symbol), *numbers, row.unit, row.rhat, row.ess)
    return table


def _correlations(result: FitResult) -> str:
    pairs = [f"{symbol_text(a)}–{symbol_text(b)} {value:+.3f}".replace("-", "−") for a, b, value in correlations(result)]
    return f"correlations above {LISTED_FROM}: " + (", ".join(pairs) if pairs else "none")


def _records(records: tuple[RecordFit, ...], experiment: Experiment) -> Table:
    table = open_table("record", "kind", "windows", "channel", "misfit/σ", "NRMSE", right=(2, 4, 5))
    for record in records:
        names = (record.file, record.kind, str(record.windows))
        for row in channel_rows(record, experiment):
            table.add_row(*names, row.channel, row.misfit, compact(row.nrmse))
            names = ("", "", "")
    return table


def _alone(result: FitResult) -> Table:
    """Mean over the records of each parameter that several of them identify, and the test of their scatter; the page has every record."""
    table = open_table("parameter", "mean", "scatter", "chi-square (chance)", right=(2, 3))
    for row in alone_rows(result):
        table.add_row(symbol_text(row.symbol), compact(row.pooled), compact(row.scatter), compact(row.test))
    return table


def _comparison(result: FitResult, reference: Reference) -> list[RenderableType]:
    """Only what has a reference value goes into the table; the rest is one line each reason."""
    comparisons = compare(result, reference)
    table = open_table("", "fitted", "reference", "unit", "difference", "in %", "", right=(4, 5))
    missing: dict[str, list[str]] = {}
    for row in comparison_rows(comparisons):
        if row.reference == NONE:
            missing.setdefault(row.remark, []).append(symbol_text(row.symbol))
        else:
            numbers = (compact(text) for text in (row.fitted, row.reference))
            table.add_row(symbol_text(row.symbol), *numbers, row.unit, compact(row.sigmas), compact(row.percent), row.remark)
    blocks: list[RenderableType] = [_line(f"beside {reference.title}:")]
    blocks += [table] if table.row_count else []
    blocks += [_line(f"  {', '.join(symbols)}: {remark}") for remark, symbols in missing.items()]
    others = unmatched(comparisons, reference)
    if others:
        blocks.append(_line(f"  not compared, no such number in this fit: {', '.join(others[:8])}{' …' if len(others) > 8 else ''}"))
    return blocks


def open_table(*headings: str, right: tuple[int, ...]) -> Table:
    """An open table, narrow enough for 80 columns; the columns `right` are set to the right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="right" if number in right else "left", overflow="fold")
    return table


def _line(text: str, style: str = "") -> Text:
    """Text as it stands: brackets in it are no markup."""
    return Text(text, style=style)
