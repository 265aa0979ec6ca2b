"""`fit-parameters --batch`: every experiment below a folder, one after the other or in several processes, resumed where it was ended."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Console

from vibrojax import __version__
from vibrojax.aside import locked, of_earlier_set
from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.interrupt import STATUS
from vibrojax.cli.output import explained, output_file, output_folder
from vibrojax.cli.progress import experiments_done
from vibrojax.cli.source import plain_name
from vibrojax.errors import InputError, NoConvergenceError, WarningLine

if TYPE_CHECKING:
    from identification.result.batch import BatchRow

_WIDE = 160
"""Columns of the table where no terminal says how many there are."""


class FitJob(NamedTuple):
    """One experiment to fit: its path from the batch's folder, its folder, that of its results, its digest, and options of `run_fit`."""

    experiment: str
    source: Path
    out: Path
    digest: str
    options: Mapping[str, Any]


def fit_batch(
    folder: Path, out: Path | None, chosen: Mapping[str, Any], *, posterior: bool, draws: int | None, style: str, workers: int, quiet: bool
) -> None:
    """Fit every experiment below a folder; write batch.csv, batch.html and batch.json, and each fit's files below `out`.

    What an earlier call has fitted there stands unless records, experiment file, options or version have changed, or its results have.

    Args:
        folder: in which experiments are looked for.
        out: of the results; None for `fit-NAME`, NAME being the folder's.
        chosen: options of `run_fit`, the same for all, but for draws and style.
        posterior: whether it is sampled, with so many `draws`; None for the usual number.
        draws: see there.
        style: name of the pages' style.
        workers: processes.
        quiet: whether to say nothing.

    Raises:
        InputError: there is nothing to fit, an option suits no experiment, or results cannot be written; what has been fitted stays.
        NoConvergenceError: all is done and written, and some experiments could not be fitted.
    """
    from identification.experiment.toml_file import experiments_below

    found = experiments_below(folder)
    out = Path(f"fit-{plain_name(folder.absolute().name) or 'batch'}") if out is None else out
    prepare_jax()
    from identification.commands.run import check_choices
    from identification.estimation.likelihood import DRAWS
    from identification.report.base import STYLES
    from identification.report.batch import batch_summary, write_batch
    from identification.result.batch import STATE, input_digest, options_digest, read_rows, write_rows

    number = (draws or DRAWS) if posterior else None
    named = ("law", "compare", "effects", "terms", "starts", "earlier", "reference")
    check_choices(**{name: chosen[name] for name in named}, draws=number)
    plain = options_digest(**chosen, draws=number, style=style, version=__version__)
    options = {**chosen, "draws": number, "style": STYLES[style]}
    try:
        with _held(out):
            jobs = [FitJob(name, path, out / name, input_digest(path, plain), options) for name, path in found.items()]
            known = read_rows(out / STATE)
            earlier = [(job, known[job.experiment]) for job in jobs if job.experiment in known]
            rows = {row.experiment: row for job, row in earlier if row.digest == job.digest and row.stands(job.out)}
            left = [job for job in jobs if job.experiment not in rows]
            with experiments_done(len(jobs), len(rows), quiet=quiet) as say:
                for row in _fitted(left, workers):
                    rows[row.experiment] = row
                    with output_file(out / STATE) as file:
                        write_rows(rows.values(), file)
                    said = f"{row.experiment}: {row.failure or row.status}"
                    say(said if row.fitted else WarningLine(said))
            ordered = [rows[name] for name in found]
            with output_folder(out) as place:
                write_rows(ordered, place / STATE)
                write_batch(ordered, place, name=folder.absolute().name, options=plain, style=STYLES[style])
    except OSError as error:
        raise explained(error, out) from error
    console = Console(quiet=quiet, highlight=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _WIDE
    console.print(batch_summary(ordered))
    console.print(f"results in {out}; start with {out / 'batch.html'}", soft_wrap=True)
    if failed := [row for row in ordered if not row.fitted]:
        counted = f"{len(failed)} of {len(ordered)} experiments could not be fitted, the first of them {failed[0].experiment}"
        raise NoConvergenceError(f"{counted}; {out / 'batch.csv'} has the reasons: correct the input, and call the same command again")


def fit_one(job: FitJob) -> "BatchRow":
    """Fit one experiment as the command for a single one does.

    Where it cannot be fitted, results that an earlier call has left in its place go.

    Raises:
        InputError: its results cannot be written.
    """
    from identification.commands.run import FAILURES, run_fit
    from identification.report.verdict import judge
    from identification.result.batch import failed_row, fitted_row

    begin, failure = time.perf_counter(), None
    try:
        with output_folder(job.out, outdated=of_earlier_set) as folder:
            try:
                result = run_fit(job.source, folder, **job.options)
            except FAILURES as error:
                failure = error
                raise
    except FAILURES as error:
        if error is not failure:  # of the place, which no other experiment could be written to either
            raise
        for file in of_earlier_set(job.out):
            (job.out / file).unlink()
        if job.experiment != ".":  # the folder of the batch itself stays
            with suppress(OSError):
                job.out.rmdir()
        return failed_row(job.experiment, job.digest, error, seconds=time.perf_counter() - begin)
    verdict, seconds = judge(result), time.perf_counter() - begin
    return fitted_row(job.experiment, job.digest, result, job.out, level=verdict.level, headline=verdict.sentence, seconds=seconds)


def _fitted(jobs: Sequence[FitJob], workers: int) -> Iterator["BatchRow"]:
    """Rows as they come; with one worker in this process."""
    for job in jobs:  # before any fit, so that no folder of results is moved while one is made inside it
        job.out.mkdir(parents=True, exist_ok=True)
    if min(workers, len(jobs)) < 2:
        yield from map(fit_one, jobs)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(jobs)), mp_context=context, initializer=_prepare_worker) as pool:
        try:
            for future in as_completed([pool.submit(fit_one, job) for job in jobs]):
                yield future.result()
        except BrokenProcessPool as error:
            raise InputError(
                f"a process of --workers {workers} was ended from outside, perhaps for want of memory: expected all to go on; call the "
                "same command again with fewer, and it continues"
            ) from error
        finally:
            pool.shutdown(cancel_futures=True)


def _prepare_worker() -> None:
    """Ctrl-C is for the parent alone, and no worker outlives it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    prepare_jax()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(STATUS)


@contextmanager
def _held(out: Path) -> Iterator[None]:
    """The folder of results, made where there is none, for this process alone."""
    out.mkdir(parents=True, exist_ok=True)
    lock = locked(out, f"{out} is in use by another batch: expected one at a time; wait for it, or name another folder with --out")
    try:
        yield
    finally:
        os.close(lock)
