"""What a command says while it works: one line per stage on standard error."""

import time
from collections.abc import Callable

import typer

Progress = Callable[[str], None]


def stage_lines(*, quiet: bool) -> Progress:
    """A function that prints a stage's name with the seconds since now, or nothing at all when `quiet`."""
    start = time.perf_counter()

    def say(stage: str) -> None:
        if not quiet:
            typer.echo(f"{time.perf_counter() - start:7.1f} s  {stage}", err=True)

    return say
