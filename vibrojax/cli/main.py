"""`vibrojax`: one command with a subcommand per job."""

from typing import Annotated, NoReturn

import typer

from vibrojax import __version__
from vibrojax.cli import fit, simulate
from vibrojax.cli.errors import run

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, epilog=fit.EXAMPLE.replace("fit-parameters", "vibrojax fit"))
app.command("fit", epilog=fit.EXAMPLE.replace("fit-parameters", "vibrojax fit"))(fit.fit)
app.command("simulate", epilog=simulate.EXAMPLE)(simulate.simulate)


@app.callback()
def options(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.", callback=lambda on: _print_version(on), is_eager=True)] = False,
) -> None:
    """Identify and simulate a hammer that hits a stop."""


def main() -> NoReturn:
    """Entry point of `vibrojax`."""
    run(app)


def _print_version(wanted: bool) -> None:
    """Eager, so that it needs no subcommand."""
    if wanted:
        typer.echo(f"vibrojax {__version__}")
        raise typer.Exit
