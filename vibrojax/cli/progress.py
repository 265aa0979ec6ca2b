"""What a command says while it works, on standard error."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

Progress = Callable[[str], None]


@contextmanager
def stages(*, quiet: bool) -> Iterator[Progress]:
    """A function that is told each stage of the work.

    On a terminal one line with a spinner is kept up to date; elsewhere (a log file) every stage gets its own line, with the seconds
    since the start; `quiet` says nothing.
    """
    console, start = Console(stderr=True, quiet=quiet, highlight=False), time.perf_counter()
    if not console.is_terminal:
        yield lambda stage: console.print(f"{time.perf_counter() - start:7.1f} s  {stage}", soft_wrap=True)
        return
    with console.status("starting") as status:
        yield lambda stage: status.update(f"{stage}  [dim]({time.perf_counter() - start:.0f} s)[/dim]")
