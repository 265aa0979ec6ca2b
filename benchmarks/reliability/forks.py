"""Processes that a server forks which has imported everything: a second's start is spent once, and JAX starts no thread before a fork."""

import gc
import logging
import multiprocessing
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from vibrojax.cli.environment import prepare_jax

PRELOADED = [
    *("identification.commands.run", "identification.inspection", "identification.guesses.declared_model", "vibrojax.studies.run"),
    *("identification.diagnosis.files", "vibrojax.cli.main", "benchmarks.resume", "dask.array", "zarr"),
    *("h5py", "scipy.io", "nptdms", "pyuff", "asammdf"),
]
Send = Callable[[Any], None]
Work = Callable[..., None]
"""What a fork does; its last argument sends what pickles to the process that asked for the fork."""


def started(work: Work, arguments: tuple[Any, ...], folder: Path) -> tuple[Any, Any]:
    """A fork that works in a folder, and the end of a pipe on which it sends; ready to work when this returns."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    mine, its = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(work, arguments, folder, its))
    process.start()
    its.close()
    mine.recv()
    return process, mine


def ended(process: Any, line: Any) -> None:
    """Kill it, where it still runs."""
    process.kill()
    process.join()
    line.close()


def forked(work: Work, arguments: tuple[Any, ...], folder: Path, patience: float) -> Iterator[Any]:
    """What a fork sends, one after the other; None where it takes more than so many seconds.

    Raises:
        EOFError, ConnectionError: it has ended.
    """
    process, line = started(work, arguments, folder)
    try:
        while True:
            if not line.poll(patience):
                yield None
                return
            yield line.recv()
    finally:
        ended(process, line)


def _work(work: Work, arguments: tuple[Any, ...], folder: Path, line: Any) -> None:
    os.chdir(folder)
    logging.disable()
    for standard in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), standard)
    prepare_jax()
    gc.freeze()  # asammdf collects garbage for each file: it need not go through all modules
    line.send("ready")
    work(*arguments, line.send)
