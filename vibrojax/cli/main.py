"""`vibrojax`: one command with a subcommand per job."""

from typing import Annotated, NoReturn

import typer

from vibrojax import __version__
from vibrojax.cli import continuation, experiments, fit, gallery, inspect, presets, study
from vibrojax.cli.errors import run

FIT_EXAMPLE = fit.EXAMPLE.replace("fit-parameters", "vibrojax fit")


def _print_version(wanted: bool) -> bool:
    """Eager, so that it needs no subcommand."""
    if wanted:
        typer.echo(f"vibrojax {__version__}")
        raise typer.Exit
    return wanted


app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, epilog=FIT_EXAMPLE)
app.command("fit", epilog=FIT_EXAMPLE)(fit.fit)
app.command("diagnose", epilog=experiments.DIAGNOSE_EXAMPLE)(experiments.diagnose)
app.command("report", epilog=experiments.REPORT_EXAMPLE)(experiments.report)
app.command("simulate", epilog=experiments.SIMULATE_EXAMPLE)(experiments.simulate)
app.command("inspect", epilog=inspect.INSPECT_EXAMPLE)(inspect.inspect)
app.command("new", epilog=inspect.NEW_EXAMPLE)(inspect.new)
app.command("datasets", epilog=inspect.DATASETS_EXAMPLE)(inspect.datasets)
app.command("continue", epilog=continuation.EXAMPLE)(continuation.continue_)
app.command("gallery", epilog=gallery.EXAMPLE)(gallery.gallery)
app.add_typer(presets.app, name="presets")
for name, (command, example) in study.COMMANDS.items():
    app.command(name, epilog=f"Example:  vibrojax {name} {example}")(command)


@app.callback()
def options(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.", callback=_print_version, is_eager=True)] = False,
) -> None:
    """Identify, diagnose and simulate a hammer that hits a stop."""


def main() -> NoReturn:
    """Entry point of `vibrojax`."""
    run(app)
