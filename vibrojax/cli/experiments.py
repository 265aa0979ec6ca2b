"""`vibrojax diagnose`, `simulate` and `report`: an experiment or its results in; findings, tables and pages out."""

from pathlib import Path
from typing import Annotated

import typer

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.grammar import first_values
from vibrojax.cli.options import Data, Experiment, Quiet, Recipe, Start, Style, Term
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.cli.source import check_experiment, check_file, check_source, opened, say_results

DIAGNOSE_EXAMPLE = "Example:  vibrojax diagnose rig-B/experiment.toml --out rig-B-diagnosis"
SIMULATE_EXAMPLE = "Example:  vibrojax simulate --model rig-B-fit/model.json --experiment rig-B/experiment.toml --out rig-B-model"
REPORT_EXAMPLE = "Example:  vibrojax report rig-B-fit"


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
            metavar="MINUTES", help="Time after which no further effect is looked for; the verdict is then undecided.", callback=_above_zero
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
    with opened("diagnose", experiment, recipe, data, out, quiet=quiet) as (source, folder, say):
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


def simulate(
    model: Annotated[Path, typer.Option(metavar="MODEL.json", help="A model.json of a fit, a diagnosis or a preset.")],
    experiment: Annotated[Path, typer.Option(metavar="EXPERIMENT.toml", help="The experiment whose records are simulated.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the tables.")],
    as_recorded: Annotated[
        bool,
        typer.Option(
            "--as-recorded",
            help="With the recorder's faults that the model knows: lag, clipping, gain, offset; not those that differ between records.",
        ),
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Simulate every record of an experiment with a fitted model.

    Mass, suspension, stop and effects are the model's; the experiment gives records, gaps and the motion of the base.
    Writes one CSV file per record with time and all channels, in SI units, on the record's own time stamps where it has them.
    Exit status: 0 done, 2 bad input, 3 the integration failed.
    """
    check_file(model, "the model.json that a fit wrote")
    check_experiment(experiment)
    with output_folder(out) as folder:
        prepare_jax()
        from identification.commands.run import run_simulate

        run_simulate(model, experiment, folder, out=out, as_recorded=as_recorded)
        tables = len(list(folder.iterdir()))
    if not quiet:
        typer.echo(f"{tables} table{'s' if tables != 1 else ''} in {out}")


def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that a fit or a diagnosis wrote, with its result.nc.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for page and plots. Left out: the same folder.")] = None,
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
    say_results(out, quiet=quiet)
