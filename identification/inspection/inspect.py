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
from identification.experiment.clock import IRREGULAR_SPREAD, LONG, rebuilt
from identification.experiment.errors import ExperimentError, listed
from identification.experiment.experiment import Record
from identification.experiment.noise import estimate_noise
from identification.experiment.readers import READERS, check_suffix
from identification.experiment.signals import Sine, contact_force, fit_sine
from identification.inspection.columns import Column, FileColumns, Mapped, map_columns, matched, read_file
from vibrojax.errors import printable


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
        found: its time stamps and columns.
        mapped: the columns that seem to be channels.
        guess: what kind of record it seems to be.
        findings: what the checks of records say of it, if channels, units and kind are as guessed.
        turned: whether its load cell reads impacts as pulls.
    """

    found: FileColumns
    mapped: tuple[Mapped, ...]
    guess: Guess
    findings: tuple[Finding, ...] = ()
    turned: bool = False

    @property
    def uneven(self) -> str:
        """How much the steps vary, where they do and the samples may have come evenly; else empty."""
        steps = np.diff(self.found.seconds)
        spread = float(np.ptp(steps) / np.median(steps)) if steps.size and not self.found.problem else 0.0
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

    Raises:
        ExperimentError: there is nothing there that can be read; for a folder, the first file's reason.
    """
    known = tuple(suffix for reader in READERS for suffix in reader.suffixes)
    try:
        paths = sorted(each for each in path.iterdir() if each.is_file() and each.name.lower().endswith(known)) if path.is_dir() else [path]
        there = path.exists()
    except (OSError, ValueError) as error:
        raise ExperimentError(f"{path} cannot be opened: {error}; give a recorded file or a folder of them") from error
    if not there:
        raise ExperimentError(f"{path} does not exist: expected a recorded file or a folder of them; check the path")
    if not paths:
        raise ExperimentError(f"the folder {path} holds no recorded file: expected one of {listed(known)}; check the path")
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


def _inspected(found: FileColumns) -> Inspected:
    """Inspect one file: as a drop test whose gap nobody knows, until it shows what it is."""
    mapped = map_columns(found.columns)
    if found.problem:
        guess = Guess(kind="drop-test", why="its time stamps are unusable, so nothing could be determined")
        return Inspected(found=found, mapped=mapped, guess=guess)
    mapped = matched(found.seconds, mapped)
    channels = {one.channel: one.factor * one.column.values for one in mapped if np.isfinite(one.column.values).any()}
    noise = {channel: std for channel, values in channels.items() if (std := estimate_noise(values)) is not None}
    record = Record(file=found.file, kind="drop-test", gap=float("nan"), time=found.seconds, channels=channels, noise=noise)
    guess, turned = _guess(record), is_turned(record)
    if found.untimed:
        why = guess.why if guess.sine is None else "the cart moves as a sine; without time stamps its frequency is not known"
        return Inspected(found=found, mapped=mapped, guess=replace(guess, why=why), turned=turned)
    frequency = None if guess.sine is None else guess.sine.rounded
    record = replace(record, kind=guess.kind, base="measured" if guess.measured else "sine", excitation_frequency=frequency)
    units = {one.channel: "V" if one.is_output or one.unknown else one.unit for one in mapped}  # of these no scale is known
    findings = tuple(all_findings(record, Declared(units=units)))
    return Inspected(found=found, mapped=mapped, guess=guess, findings=findings, turned=turned)


def _guess(record: Record) -> Guess:
    """Guess the kind of a record from its channels; a drop test is only where impacts are seen."""
    for name in CART_CHANNELS:
        if name in record.channels and _moves(record, name, beside=name.replace("cart", "hammer")):
            sine = fit_sine(record.time, record.channels[name])
            if sine is None or sine.share < MOSTLY_SINE:
                share = 0.0 if sine is None else sine.share
                why = f"{name} moves, but a sine explains only {100 * share:.0f} % of it: its recorded motion had better drive the model"
                return Guess(kind="cart-excitation", why=why, measured=True)
            why = f"{name} is a sine to {100 * sine.share:.4g} %, of {sine.frequency:.7g} Hz, standard error {sine.stderr:.1g} Hz"
            return Guess(kind="cart-excitation", why=why, sine=sine)
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


def _moves(record: Record, channel: str, *, beside: str = "") -> bool:
    """Whether a channel is more than five times its noise, and more than a trace, 2 %, of what happens in the one beside it."""
    trace = 0.02 * float(np.nanstd(record.channels[beside])) if beside in record.channels else 0.0
    return float(np.nanstd(record.channels[channel])) > max(5.0 * record.noise.get(channel, 0.0), trace)


def summary(inspection: Inspection) -> Group:
    """What every file holds, as `rich.console.Console.print` can print it."""
    blocks: list[RenderableType] = []
    for one in inspection.files:
        blocks += [*_file(one), Text()]
    blocks += [_bold(f"{name} cannot be used: {reason}") for name, reason in inspection.failed.items()]
    return Group(*blocks)


def _file(one: Inspected) -> list[RenderableType]:
    """One file: its time, its columns, and what seems to have been recorded; narrow enough for a terminal of 80 characters."""
    found, remarks = one.found, [_remarks(column) for column in one.found.columns]
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("column", "unit", "smallest", "largest", "noise", "seems to be", *(["remarks"] if any(remarks) else [])):
        table.add_column(heading, justify="right" if heading in ("smallest", "largest", "noise") else "left", overflow="fold")
    channels = {each.column.name: "as named" if each.exact else each.channel for each in one.mapped}
    for column, remark in zip(found.columns, remarks, strict=True):
        limits = [f"{limit:.5g}" if isfinite(limit) else "" for limit in column.limits]
        noise = "" if column.noise is None else f"{column.noise:.2g}"
        cells = (column.name, column.unit or "not stated", *limits, noise, channels.get(column.name, ""), remark)
        table.add_row(*(Text(printable(cell)) for cell in cells[: len(table.columns)]))
    head = _bold(found.file)
    head.append(f": {found.seconds.size} samples without time stamps" if found.untimed else f": {time_sentence(found)}", "not bold")
    if found.time_guessed:
        head.append(f"; time taken to be in {found.time_unit}: {found.time_guessed}; is {found.rate:.4g} Hz right?", "not bold")
    lines: list[RenderableType] = [head, table, *(Text(printable(notice)) for notice in found.notices)]
    if found.problem:
        lines.append(_bold(f"a fit would refuse it: {found.problem}"))
    lines += [_bold(f"{name} cannot be used: {reason}") for name, reason in found.unusable.items()]
    lines.append(Text(f"looks like {one.guess.kind}: {one.guess.why}"))
    return [*lines, *(_bold(("a fit would refuse it: " if odd.refuses else "odd: ") + odd.sentence) for odd in one.findings)]


def _bold(text: str) -> Text:
    return Text(printable(text), style="bold")


def time_sentence(found: FileColumns) -> str:
    """What the time stamps of a file say; steps that are gaps do not count as jitter."""
    time = found.seconds[np.isfinite(found.seconds)]
    steps = np.diff(time)
    median = float(np.median(steps)) if steps.size else np.nan
    even, gaps = steps[(steps > 0.0) & (steps <= LONG * median)], steps[steps > LONG * median]
    begin, duration = (time[0], time[-1] - time[0]) if time.size else (np.nan, 0.0)
    said = [f"{found.seconds.size} samples in {duration:.6g} s from {begin:.6g} s"]
    said += [f"{found.rate:.6g} Hz"] if isfinite(found.rate) else []
    said += [f"steps vary by {100 * np.std(even) / median:.2g} %"] if even.size and median > 0.0 else []
    said.append(f"{_count(gaps.size, 'gap')}, the longest {gaps.max():.4g} s" if gaps.size else "no gap")
    repeated, backwards = int(np.sum(steps == 0.0)), int(np.sum(steps < 0.0))
    said.append(_count(repeated, "repeated time stamp") if repeated else "no repeated time stamp")
    said += [f"time runs backwards {_count(backwards, 'time')}"] if backwards else []
    return "; ".join(said)


def _count(number: int, noun: str) -> str:
    """A number and its noun."""
    return f"{number} {noun}" + ("s" if number != 1 else "")


def _remarks(column: Column) -> str:
    """What is odd about a column."""
    missing = int(np.sum(~np.isfinite(column.values)))
    said = [f"{_count(missing, 'sample')} missing"] if missing else []
    said += [f"saturates at {found.level:.5g} ({_count(found.samples, 'sample')} in {found.runs} stretches)" for found in column.saturation]
    said += ["stands still"] if column.limits[0] == column.limits[1] else []
    return "; ".join(said)
