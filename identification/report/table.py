"""The fit as tables for a terminal: value, error, interval, first guess, correlations, and why an error is missing."""

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from identification.reference import Reference, compare, unmatched
from identification.report.rows import (
    WORTH_TELLING,
    channel_rows,
    comparison_rows,
    correlations,
    derived_rows,
    parameter_rows,
    reasons,
    windows,
)
from identification.report.symbols import symbol_text
from identification.report.verdict import GOOD, judge
from identification.result import FitResult


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
    if result.derived:
        told = ", ".join(f"{symbol_text(symbol)} = {value} {unit}".strip() for symbol, value, unit in derived_rows(result))
        blocks.append(_line(f"derived: {told}"))
    blocks.append(_line(_correlations(result)))
    blocks.append(_records(result))
    if reference is not None:
        blocks += _comparison(result, reference)
    blocks += [_line(f"{record.file}: {notice}") for record in result.records for notice in record.notices]
    blocks += [_line(f"warning: {warning}", style="bold") for warning in result.warnings]
    return Group(*blocks)


def _verdict(result: FitResult) -> Text:
    verdict = judge(result)
    text = Text("\n".join((verdict.sentence, *verdict.remarks)), style="bold" if verdict.level != GOOD else "")
    samples = sum(len(record.time) for record in result.records)
    text.append(
        f"\n{result.experiment.name}: {len(result.records)} records, {samples} samples, {result.degrees} degrees of freedom", "not bold"
    )
    text.append(f"\n{result.model.law.title}, {result.model.suspension.name} suspension, {result.iterations} iterations", "not bold")
    return text


def _parameters(result: FitResult) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("", "name", "value", "± std. error", "95 % interval", "initial", "unit", "status"):
        table.add_column(heading, justify="right" if heading in ("value", "± std. error", "initial") else "left", overflow="fold")
    for row in parameter_rows(result):
        error = f"{row.error} ({row.percent})" if row.error != "–" else row.error
        table.add_row(symbol_text(row.symbol), row.name, row.value, error, row.interval, row.initial, row.unit, row.status)
    return table


def _correlations(result: FitResult) -> str:
    pairs = [f"{symbol_text(a)}–{symbol_text(b)} {value:+.3f}".replace("-", "−") for a, b, value in correlations(result)]
    return f"correlations above {WORTH_TELLING}: " + (", ".join(pairs) if pairs else "none")


def _records(result: FitResult) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("record", "kind", "windows", "channel", "misfit / noise", "NRMSE"):
        table.add_column(heading, justify="right" if heading in ("windows", "misfit / noise", "NRMSE") else "left", overflow="fold")
    for record in result.records:
        names = (record.file, record.kind, str(windows(record)))
        for row in channel_rows(record, result.experiment):
            table.add_row(*names, row.channel, row.misfit, row.nrmse)
            names = ("", "", "")
    return table


def _comparison(result: FitResult, reference: Reference) -> list[RenderableType]:
    comparisons = compare(result, reference)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=f"beside {reference.title}", title_justify="left")
    for heading in ("", "fitted", "reference", "unit", "difference", "in %", ""):
        table.add_column(heading, overflow="fold")
    for row in comparison_rows(comparisons):
        table.add_row(symbol_text(row.symbol), row.fitted, row.reference, row.unit, row.sigmas, row.percent, row.remark)
    others = unmatched(comparisons, reference)
    more = [_line(f"  not compared, for want of such a number in this fit: {', '.join(others[:8])}{' …' if len(others) > 8 else ''}")]
    return [table, *(more if others else [])]


def _line(text: str, style: str = "") -> Text:
    """Text as it stands: brackets in it are no markup."""
    return Text(text, style=style)
