"""A diagnosis as tables for a terminal: the verdict, parameters before and after, and what else was considered."""

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from identification.diagnosis.diagnosis import UNLISTED, Diagnosis
from identification.report.diagnosis.rows import (
    candidate_rows,
    change_rows,
    error_rows,
    notices,
    number_rows,
    strongest,
    symbol_and_name,
    warnings,
)
from identification.report.diagnosis.words import effect_words, headline, plain_name, probability_text, where
from identification.report.table import open_table
from identification.wording.names import symbol_text
from identification.wording.numbers import NONE, compact, joined, with_unit

_CANDIDATES = 6


def diagnosis_summary(diagnosis: Diagnosis) -> Group:
    """Everything a reader wants on one screen after a diagnosis.

    Args:
        diagnosis: of one experiment.

    Returns:
        What `rich.console.Console.print` can print; nothing is printed here.
    """
    blocks: list[RenderableType] = [_verdict(diagnosis), *_effects(diagnosis), _errors(diagnosis), _parameters(diagnosis)]
    blocks += _considered(diagnosis)
    if diagnosis.next_experiment:
        blocks.append(Text(f"next: {diagnosis.next_experiment}"))
    blocks += [Text(notice) for notice in notices(diagnosis)]
    blocks += [Text(f"warning: {warning}", style="bold") for warning in warnings(diagnosis)]
    return Group(*blocks)


def _verdict(diagnosis: Diagnosis) -> Text:
    text = Text(headline(diagnosis), style="bold")
    for sentence in diagnosis.sentences:
        text.append(f"\n{sentence}", "not bold")
    if diagnosis.location is not None and diagnosis.location.sentence not in diagnosis.sentences:
        text.append(f"\n{diagnosis.location.sentence}", "not bold")
    return text


def _effects(diagnosis: Diagnosis) -> list[RenderableType]:
    """A line an asserted effect, with its numbers; or the formula that was learned."""
    lines: list[RenderableType] = []
    for one in diagnosis.effects:
        numbers = [f"{symbol_text(row.symbol)} = {with_unit(compact(row.value), row.unit)}" for row in number_rows(one.reported)]
        place = f" ({where(one)})" if where(one) else ""
        lines.append(Text(f"  {one.effect.name}{place}: {probability_text(one.probability)}; {', '.join(numbers)}"))
    if diagnosis.verdict == UNLISTED and diagnosis.free_form:
        lines.append(Text(f"  learned in its place: {diagnosis.free_form}"))
    if diagnosis.ambiguous_with and not any(name in said for said in diagnosis.sentences for name in diagnosis.ambiguous_with):
        lines.append(Text(f"  these records cannot separate it from {joined([effect_words(name) for name in diagnosis.ambiguous_with])}"))
    return lines


def _errors(diagnosis: Diagnosis) -> Text:
    same = not diagnosis.is_augmented
    changes = [f"{row.name} {compact(row.before)}" + ("" if same else f" -> {compact(row.after)}") for row in error_rows(diagnosis)]
    return Text("; ".join(changes))


def _parameters(diagnosis: Diagnosis) -> Table:
    if not diagnosis.is_augmented:
        table = open_table("parameter", "value", "unit", right=(1,))
        for row in change_rows(diagnosis):
            table.add_row(symbol_and_name(row.symbol, row.name), compact(row.before), row.unit)
        return table
    table = open_table("parameter", "before", "after", "unit", "shift", right=(1, 2, 4))
    for row in change_rows(diagnosis):
        table.add_row(symbol_and_name(row.symbol, row.name), compact(row.before), compact(row.after), row.unit, compact(row.shift))
    return table


def _considered(diagnosis: Diagnosis) -> list[RenderableType]:
    rows = candidate_rows(diagnosis, _CANDIDATES)
    if not rows:
        return []
    columns = {"expected": "gain", "chance": "chance", "gain": "drop", "BIC": "bic", "left out": "held_out"}
    columns = {heading: name for heading, name in columns.items() if any(getattr(row, name) != NONE for row in rows)}
    table = open_table("considered", "beside", *columns, right=(2, 3, 4, 5, 6))
    for row in rows:
        name = plain_name(row.name) + (f", {row.detail}" if row.detail else "")
        table.add_row(name, row.beside, *(compact(getattr(row, c)) for c in columns.values()), style="bold" if row.asserted else "")
    left = len(strongest(diagnosis)) - len(rows)
    return [table, *([Text(f"  {left} more in the report")] if left else [])]
