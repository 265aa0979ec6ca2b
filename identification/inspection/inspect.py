"""Inspection of a recorded file or folder: facts of time stamps and columns, the kind of record, problems, and all that as tables."""

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from identification.experiment.channels import CART_CHANNELS
from identification.experiment.checks import MOSTLY_SINE, Declared, Finding, all_findings, is_turned
from identification.experiment.clock import IRREGULAR_SPREAD, check_time, rebuilt
from identification.experiment.errors import ExperimentError, listed
from identification.experiment.experiment import Record
from identification.experiment.noise import estimate_noise
from identification.experiment.readers import READERS, check_suffix
from identification.experiment.samples import Saturation, find_saturation
from identification.experiment.signals import Sine, contact_force, fit_sine
from identification.inspection.columns import Column, FileColumns, Mapped, map_columns, matched, read_file
from vibrojax.errors import printable

GAP = 1.5
"""Of the median step: a longer one is a gap."""
AT_REST = 5.0
"""Noises: a channel whose standard deviation is less stands still."""
REST_SHARE = 0.02
"""Of the hammer's standard deviation: a cart that moves less stands still, though impacts shake it."""


@dataclass(frozen=True, kw_only=True)
class TimeFacts:
    """What the time stamps say.

    Attributes:
        samples: their number.
        begin: first stamp, s.
        duration: last minus first, s.
        rate: samples a second, by the median step, Hz; NaN where there are fewer than two.
        jitter: standard deviation of the steps that are no gaps, over the median step.
        gaps: steps longer than `GAP` median steps.
        longest_gap: s; 0 without gaps.
        repeated: stamps equal to the one before.
        backwards: stamps before the one before.
        problem: why a record with these stamps would be refused; empty where it would not.
    """

    samples: int
    begin: float
    duration: float
    rate: float
    jitter: float
    gaps: int
    longest_gap: float
    repeated: int
    backwards: int
    problem: str


@dataclass(frozen=True, kw_only=True)
class ColumnFacts:
    """What one column says; numbers in the unit of the file.

    Attributes:
        column: its name.
        unit: as stated, or empty.
        missing: samples that are no finite number.
        low: smallest value; NaN where there is none.
        high: largest value.
        noise: standard deviation, estimated as for a fit; None where it cannot be estimated.
        saturation: levels at which the column is cut off.
    """

    column: str
    unit: str
    missing: int
    low: float
    high: float
    noise: float | None
    saturation: tuple[Saturation, ...]


def _time_facts(found: FileColumns) -> TimeFacts:
    """Properties of the time stamps of a file."""
    time = found.seconds
    usable = time[np.isfinite(time)]
    steps = np.diff(usable)
    median = float(np.median(steps)) if steps.size else float("nan")
    even = steps[(steps > 0.0) & (steps <= GAP * median)]
    gaps = steps[steps > GAP * median]
    problem = ""
    try:
        check_time(time, "the record")
    except ExperimentError as error:
        problem = str(error)
    return TimeFacts(
        samples=int(time.size),
        begin=float(usable[0]) if usable.size else float("nan"),
        duration=float(usable[-1] - usable[0]) if usable.size else 0.0,
        rate=1.0 / median if median > 0.0 else float("nan"),
        jitter=float(np.std(even)) / median if even.size and median > 0.0 else float("nan"),
        gaps=int(gaps.size),
        longest_gap=float(gaps.max(initial=0.0)),
        repeated=int(np.sum(steps == 0.0)),
        backwards=int(np.sum(steps < 0.0)),
        problem=problem,
    )


def _column_facts(column: Column) -> ColumnFacts:
    """Properties of one column."""
    finite = np.isfinite(column.values)
    usable = column.values[finite]
    marked = np.where(finite, column.values, np.nan)
    return ColumnFacts(
        column=column.name,
        unit=column.unit,
        missing=int(np.sum(~finite)),
        low=float(usable.min()) if usable.size else float("nan"),
        high=float(usable.max()) if usable.size else float("nan"),
        noise=estimate_noise(marked),
        saturation=find_saturation(marked),
    )


@dataclass(frozen=True, kw_only=True)
class Guess:
    """The guessed kind of a record.

    Attributes:
        kind: one of the experiment's kinds.
        why: a sentence.
        sine: of the cart, for a harmonic excitation.
        impacts: whether impacts are seen; None where no channel shows it.
        measured: whether the recorded cart motion had better drive the model, because it is no sine.
    """

    kind: str
    why: str
    sine: Sine | None = None
    measured: bool = False
    impacts: bool | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Inspected:
    """One inspected file.

    Attributes:
        found: its columns.
        time: facts of its time stamps.
        columns: facts of every usable column.
        mapped: the columns that seem to be channels.
        guess: what kind of record it seems to be.
        findings: what the checks of records say of it, if channels, units and kind are as guessed.
        turned: whether its load cell reads impacts as pulls.
    """

    found: FileColumns
    time: TimeFacts
    columns: tuple[ColumnFacts, ...]
    mapped: tuple[Mapped, ...]
    guess: Guess
    findings: tuple[Finding, ...] = ()
    turned: bool = False

    @property
    def uneven(self) -> str:
        """How much the steps vary, where they do and the samples may have come evenly; else empty."""
        steps = np.diff(self.found.seconds)
        spread = float(np.ptp(steps) / np.median(steps)) if steps.size and not self.time.problem else 0.0
        if spread <= IRREGULAR_SPREAD:
            return ""
        try:
            rebuilt(self.found.seconds, None, "the record")
        except ExperimentError:
            return ""
        return f"steps vary by {100 * spread:.2g} % of their median"


@dataclass(frozen=True, kw_only=True, eq=False)
class Inspection:
    """All inspected files.

    Attributes:
        folder: that holds the files.
        files: those that could be read.
        failed: why another could not, by name.
    """

    folder: Path
    files: tuple[Inspected, ...]
    failed: dict[str, str]


def inspect_path(path: Path) -> Inspection:
    """Inspect a file, or every file in a folder whose suffix has a reader.

    Args:
        path: of the file or folder.

    Returns:
        What was found.

    Raises:
        ExperimentError: there is nothing there that can be read; for a folder, the first file's reason.
    """
    try:
        paths = sorted(each for each in path.iterdir() if each.is_file() and _known(each)) if path.is_dir() else [path]
        there = path.exists()
    except (OSError, ValueError) as error:
        raise ExperimentError(f"{path} cannot be opened: {error}; give a recorded file or a folder of them") from error
    if not there:
        raise ExperimentError(f"{path} does not exist: expected a recorded file or a folder of them; check the path")
    if not paths:
        suffixes = listed(suffix for reader in READERS for suffix in reader.suffixes)
        raise ExperimentError(f"the folder {path} holds no recorded file: expected one of {suffixes}; check the path")
    check_suffix(paths[0].name)
    files, failed = [], {}
    for each in paths:
        try:
            files.append(_inspected(read_file(each)))
        except ExperimentError as error:
            failed[each.name] = str(error)
    if not files:
        raise ExperimentError(next(iter(failed.values())))
    return Inspection(folder=path if path.is_dir() else path.parent, files=tuple(files), failed=failed)


def _known(path: Path) -> bool:
    """Whether a file's suffix has a reader."""
    return any(path.name.lower().endswith(suffix) for reader in READERS for suffix in reader.suffixes)


def _inspected(found: FileColumns) -> Inspected:
    """Inspect one file."""
    time, columns, mapped = _time_facts(found), tuple(map(_column_facts, found.columns)), map_columns(found.columns)
    if time.problem:
        guess = Guess(kind="drop-test", why="its time stamps are unusable, so nothing could be determined")
        return Inspected(found=found, time=time, columns=columns, mapped=mapped, guess=guess)
    mapped = matched(found.seconds, mapped)
    record = _as_drop_test(found, mapped)
    guess = _guess(record)
    turned = is_turned(record)
    if found.untimed:
        why = guess.why if guess.sine is None else "the cart moves as a sine; without time stamps its frequency is not known"
        return Inspected(found=found, time=time, columns=columns, mapped=mapped, guess=replace(guess, why=why), turned=turned)
    frequency = None if guess.sine is None else guess.sine.rounded
    record = replace(record, kind=guess.kind, base="measured" if guess.measured else "sine", excitation_frequency=frequency)
    units = {one.channel: "V" if one.is_output or one.unknown else one.unit for one in mapped}  # of these no scale is known
    findings = tuple(all_findings(record, Declared(units=units)))
    return Inspected(found=found, time=time, columns=columns, mapped=mapped, guess=guess, findings=findings, turned=turned)


def _as_drop_test(found: FileColumns, mapped: tuple[Mapped, ...]) -> Record:
    """The file as a record of a drop test whose gap nobody knows."""
    marked = {one.channel: one.factor * np.where(np.isfinite(one.column.values), one.column.values, np.nan) for one in mapped}
    channels = {channel: values for channel, values in marked.items() if np.isfinite(values).any()}
    noise = {channel: std for channel, values in channels.items() if (std := estimate_noise(values)) is not None}
    return Record(file=found.file, kind="drop-test", gap=float("nan"), time=found.seconds, channels=channels, noise=noise)


def _guess(record: Record) -> Guess:
    """Guess the kind of a record from its channels; a drop test is only where impacts are seen."""
    for name in CART_CHANNELS:
        if name in record.channels and _moves(record, name, beside=name.replace("cart", "hammer")):
            return _excited(record.time, record.channels[name], name)
    felt = contact_force(record)
    impacts = None if felt is None else bool(np.nanmax(np.abs(felt[0])) > felt[1])
    if "applied_force" in record.channels and _moves(record, "applied_force"):
        return Guess(kind="forced", why="an applied force is recorded and no cart moves", impacts=impacts)
    cart = any(name in record.channels for name in CART_CHANNELS)
    rest = "the cart is at rest" if cart else "no motion of a cart is recorded"
    if impacts:
        return Guess(kind="drop-test", why=f"{rest} and impacts occur")
    seen = "no impact is seen" if impacts is not None else "no channel shows whether impacts occur"
    return Guess(kind="free-decay", why=f"{rest} and {seen}", impacts=impacts)


def _excited(seconds: np.ndarray, cart: np.ndarray, name: str) -> Guess:
    """A moving cart: a sine, or not."""
    sine = fit_sine(seconds, cart)
    if sine is None or sine.share < MOSTLY_SINE:
        share = 0.0 if sine is None else sine.share
        why = f"{name} moves, but a sine explains only {100 * share:.0f} % of it: its recorded motion had better drive the model"
        return Guess(kind="cart-excitation", why=why, measured=True)
    why = f"{name} is a sine to {100 * sine.share:.4g} %, of {sine.frequency:.7g} Hz, standard error {sine.stderr:.1g} Hz"
    return Guess(kind="cart-excitation", why=why, sine=sine)


def _moves(record: Record, channel: str, *, beside: str = "") -> bool:
    """Whether a channel is more than noise, and more than a trace of what happens in the one beside it."""
    trace = REST_SHARE * float(np.nanstd(record.channels[beside])) if beside in record.channels else 0.0
    return float(np.nanstd(record.channels[channel])) > max(AT_REST * record.noise.get(channel, 0.0), trace)


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
        head.append(f"; time taken to be in {one.found.time_unit}: {one.found.time_guessed}; is {one.time.rate:.4g} Hz right?", "not bold")
    lines: list[RenderableType] = [head, table, *(Text(printable(notice)) for notice in one.found.notices)]
    if one.time.problem:
        lines.append(_bold(f"a fit would refuse it: {one.time.problem}"))
    lines += [_bold(f"{name} cannot be used: {reason}") for name, reason in one.found.unusable.items()]
    lines.append(Text(f"looks like {one.guess.kind}: {one.guess.why}"))
    return [*lines, *(_bold(("a fit would refuse it: " if found.refuses else "odd: ") + found.sentence) for found in one.findings)]


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
