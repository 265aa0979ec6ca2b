"""`vibrojax report`: the results of an earlier fit or diagnosis in; its page and plots drawn again."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.options import Quiet, Style
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.cli.source import check_file

EXAMPLE = "Example:  vibrojax report rig-B-fit"


def report(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder that a fit or a diagnosis wrote, with its result.nc.", show_default=False)
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for page and plots. Left out: the same folder.", show_default=False)
    ] = None,
    style: Style = "screen",
    quiet: Quiet = False,
) -> None:
    """Draw report.html and the plots of an earlier fit or diagnosis again, without computing it again.

    Exit status: 0 done, 2 bad input.
    """
    check_file(directory / "result.nc", "the result.nc that a fit or a diagnosis writes")
    out = directory if out is None else out
    with output_folder(out) as folder, stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from identification.commands.run import run_report
        from identification.report.base import STYLES

        in_place = out.resolve() == directory.resolve()
        run_report(directory, folder, style=STYLES[style], in_place=in_place, progress=say, show=say.show)
    Console(quiet=quiet, highlight=False).print(f"results in {out}; start with {out / 'report.html'}", soft_wrap=True)
