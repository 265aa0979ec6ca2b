"""Trials in several processes, each written as one line of a file as soon as it is done, so that an interrupted run can go on."""

import json
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from vibrojax.cli.environment import prepare_jax


def lines_beside(json_file: Path, *, resume: bool) -> Path:
    """The file of the trials, beside that of the figures; what an earlier run left there goes unless it is to be resumed."""
    lines = json_file.with_suffix(".jsonl")
    if lines == json_file:
        raise SystemExit(f"{json_file} is the name that the trials take: expected another suffix for the figures, such as .json")
    if not resume:
        lines.unlink(missing_ok=True)
    return lines


def finished(lines: Path, key: str) -> dict[Any, dict]:
    """Trials by what they say under `key`; a last line that an interruption cut off does not count."""
    found = {}
    for line in lines.read_text(encoding="utf-8").splitlines() if lines.exists() else []:
        try:
            one = json.loads(line)
        except ValueError:
            continue
        found[one[key]] = one
    return found


def run_trials(what: str, trial: Callable[[Any], dict], wanted: Sequence[Any], lines: Path, *, workers: int) -> None:
    """Run the trials and append each to the file as it ends.

    Args:
        what: they are, in the plural, beside the progress bar.
        trial: runs one; it and what it takes must pickle.
        wanted: one for each trial.
        lines: the file; a line that an interruption cut off is ended first.
        workers: processes.
    """
    bar = Progress(TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    processes = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=prepare_jax)
    with bar, processes as pool, lines.open("a", encoding="utf-8") as file:
        task = bar.add_task("", total=len(wanted))
        if lines.stat().st_size and not lines.read_bytes().endswith(b"\n"):
            file.write("\n")
        for future in as_completed([pool.submit(trial, one) for one in wanted]):
            file.write(json.dumps(future.result()) + "\n")
            file.flush()
            bar.advance(task)
