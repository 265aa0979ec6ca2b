"""`vibrojax simulate`: a model and an experiment in, one table of every channel per record out."""

from pathlib import Path
from typing import Annotated

import typer

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.options import Quiet
from vibrojax.cli.output import output_folder
from vibrojax.cli.source import check_experiment, check_file

EXAMPLE = "Example:  vibrojax simulate --model rig-B-fit/model.json --experiment rig-B/experiment.toml --out rig-B-model"


def simulate(
    model: Annotated[Path, typer.Option(metavar="MODEL.json", help="A model.json of a fit, a diagnosis or a preset.", show_default=False)],
    experiment: Annotated[
        Path, typer.Option(metavar="EXPERIMENT.toml", help="The experiment whose records are simulated.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the tables.", show_default=False)],
    as_recorded: Annotated[
        bool,
        typer.Option(
            "--as-recorded",
            help="With the faults of the recorder that the model knows (lag, clipping, gain, offset; not hum, another in each record).",
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
