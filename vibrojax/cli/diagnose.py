"""`vibrojax diagnose`: experiment in; what the nominal model leaves out, both models, and a report out."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vibrojax.aside import of_earlier_set
from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.grammar import first_values
from vibrojax.cli.options import Data, Experiment, Quiet, Recipe, Start, Style, Term
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.cli.source import check_source, default_folder, experiment_source

EXAMPLE = "Example:  vibrojax diagnose rig-B/experiment.toml --out rig-B-diagnosis"


def _above_zero(minutes: float) -> float:
    """Not a number is refused as well."""
    if not minutes > 0:
        raise typer.BadParameter(f"{minutes:g} is not above 0")
    return minutes


def diagnose(
    experiment: Experiment = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results. Left out: diagnose-NAME, NAME being the experiment's.")
    ] = None,
    budget_minutes: Annotated[
        float,
        typer.Option(
            metavar="MINUTES",
            help="Time after which no further effect is looked for; the verdict is then undecided.",
            callback=_above_zero,
        ),
    ] = 5.0,
    only: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Effect to look for, no others; may be repeated.")] = None,
    without: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Effect not to look for; may be repeated.")] = None,
    term: Term = None,
    start: Start = None,
    recipe: Recipe = None,
    data: Data = None,
    style: Style = "screen",
    quiet: Quiet = False,
) -> None:
    """Find out what the impact model leaves out of recorded experiments.

    Writes diagnosis.json, nominal.json, model.json, result.nc, report.html and plots into the results folder, all of them or none.
    Exit status: 0 done, whatever the verdict; 2 bad input; 3 no convergence.
    """
    check_source(experiment, recipe, data)
    starts = first_values(start or (), term or ())
    out = default_folder("diagnose", experiment, recipe) if out is None else out
    with (
        output_folder(out, outdated=of_earlier_set) as folder,
        experiment_source(experiment, recipe, data) as source,
        stages(quiet=quiet) as say,
    ):
        say("loading JAX")
        prepare_jax()
        from identification.commands.run import run_diagnose
        from identification.report.base import STYLES

        run_diagnose(
            source,
            folder,
            only=only or (),
            without=without or (),
            terms=term or (),
            starts=starts,
            budget_minutes=budget_minutes,
            style=STYLES[style],
            progress=say,
            show=say.show,
        )
    Console(quiet=quiet, highlight=False).print(f"results in {out}; start with {out / 'report.html'}", soft_wrap=True)
