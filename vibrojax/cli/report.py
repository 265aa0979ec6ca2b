"""`vibrojax report`: the results of an earlier fit in; its page and plots drawn again."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.output import output_folder
from vibrojax.cli.paths import check_file
from vibrojax.cli.progress import stages
from vibrojax.errors import InputError

EXAMPLE = "Example:  vibrojax report rig-B-fit"


def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that a fit wrote, with its result.nc.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for page and plots. Left out: the same folder.", show_default=False)
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")] = False,
) -> None:
    """Draw report.html and the plots of an earlier fit again, without fitting.

    A diagnosis does not keep what its page is drawn from: run vibrojax diagnose again.

    Exit status: 0 done, 2 bad input.
    """
    _check_result(directory)
    out = directory if out is None else out
    with output_folder(out) as folder, stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from identification.run import run_report

        say("drawing the report")
        summary = run_report(directory, folder)
    console = Console(quiet=quiet, highlight=False)
    console.print(summary)
    console.print(f"results in {out}; start with {out / 'report.html'}", soft_wrap=True)


def _check_result(directory: Path) -> None:
    """Refuse a folder without the result of a fit, and say what to run instead."""
    if not (directory / "result.nc").is_file() and (directory / "diagnosis.json").is_file():
        raise InputError(
            f"{directory} holds a diagnosis, which does not keep the series that its page is drawn from: expected the folder of a fit;"
            f" run vibrojax diagnose EXPERIMENT --out {directory} again"
        )
    check_file(directory / "result.nc", "the result.nc that a fit writes beside fit.json")
