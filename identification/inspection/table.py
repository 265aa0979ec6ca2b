"""What was found in files, as tables for a terminal."""

from math import isfinite

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from identification.inspection.facts import ColumnFacts, TimeFacts
from identification.inspection.inspect import Inspected, Inspection
from vibrojax.errors import printable


def summary(inspection: Inspection) -> Group:
    """Say what every file holds.

    Args:
        inspection: from `inspect_path`.

    Returns:
        What `rich.console.Console.print` can print; nothing is printed here.
    """
    blocks: list[RenderableType] = []
    for one in inspection.files:
        blocks += [*_file(one), Text()]
    blocks += [_bold(f"{name} cannot be used: {reason}") for name, reason in inspection.failed.items()]
    return Group(*blocks)


def _file(one: Inspected) -> list[RenderableType]:
    """One file: its time, its columns, and what seems to have been recorded; narrow enough for a terminal of 80 characters."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading, side in {"column": "left", "unit": "left", "smallest": "right", "largest": "right", "noise": "right"}.items():
        table.add_column(heading, justify="right" if side == "right" else "left", overflow="fold")
    table.add_column("seems to be", overflow="fold")
    remarks = [_remarks(facts) for facts in one.columns]
    if any(remarks):
        table.add_column("remarks", overflow="fold")
    channels = {each.column.name: "as named" if each.exact else each.channel for each in one.mapped}
    for facts, remark in zip(one.columns, remarks, strict=True):
        noise = "" if facts.noise is None else f"{facts.noise:.2g}"
        numbers = (_number(facts.low), _number(facts.high), noise)
        cells = (facts.column, facts.unit or "not stated", *numbers, channels.get(facts.column, ""))
        table.add_row(*(Text(printable(cell)) for cell in cells), *([Text(printable(remark))] if any(remarks) else []))
    head = _bold(one.found.file)
    head.append(f": {one.time.samples} samples without time stamps" if one.found.untimed else f": {_time(one.time)}", "not bold")
    if one.found.time_guessed:
        head.append(f"; time taken to be in {one.found.time_unit}: {one.found.time_guessed}", "not bold")
    lines: list[RenderableType] = [head, table]
    if one.time.problem:
        lines.append(_bold(f"a fit would refuse it: {one.time.problem}"))
    lines += [_bold(f"{name} cannot be used: {reason}") for name, reason in one.found.unusable.items()]
    return [*lines, Text(f"looks like {one.guess.kind}: {one.guess.why}")]


def _bold(text: str) -> Text:
    return Text(printable(text), style="bold")


def _time(time: TimeFacts) -> str:
    """The time stamps in one sentence."""
    said = [f"{time.samples} samples in {time.duration:.6g} s from {time.begin:.6g} s"]
    if isfinite(time.rate):
        said.append(f"{time.rate:.6g} Hz")
    if isfinite(time.jitter):
        said.append(f"steps vary by {100 * time.jitter:.2g} %")
    said.append("no gap" if time.gaps == 0 else f"{_count(time.gaps, 'gap')}, the longest {time.longest_gap:.4g} s")
    said.append("no repeated time stamp" if time.repeated == 0 else f"{_count(time.repeated, 'repeated time stamp')}")
    if time.backwards:
        said.append(f"time runs backwards {_count(time.backwards, 'time')}")
    return "; ".join(said)


def _count(number: int, noun: str) -> str:
    """A number and its noun."""
    return f"{number} {noun}" + ("s" if number != 1 else "")


def _number(value: float) -> str:
    """A value of a range."""
    return f"{value:.5g}" if isfinite(value) else ""


def _remarks(facts: ColumnFacts) -> str:
    """What is odd about a column."""
    said = [f"{_count(facts.missing, 'sample')} missing"] if facts.missing else []
    said += [f"saturates at {found.level:.5g} ({_count(found.samples, 'sample')} in {found.runs} stretches)" for found in facts.saturation]
    if facts.low == facts.high:
        said.append("stands still")
    return "; ".join(said)
