"""`fit-parameters`, also `vibrojax fit`: experiment in; parameters, a model that runs, and a report out."""

import re
import tomllib
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.errors import run
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stage_lines
from vibrojax.data_files import data_path

EXAMPLE = "Example:  fit-parameters rig-B/experiment.toml --out rig-B-fit"

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command(epilog=EXAMPLE)
def fit(
    experiment: Annotated[
        Path | None,
        typer.Argument(help="Folder of the experiment, or its experiment.toml. Left out: the embedded example.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results. Left out: fit-NAME, NAME being the experiment's.")
    ] = None,
    law: Annotated[str | None, typer.Option(metavar="NAME", help="Contact law to fit. Left out: Hunt-Crossley.")] = None,
    reference: Annotated[Path | None, typer.Option(metavar="FILE", help="Known parameter values to print beside the fitted ones.")] = None,
    starts: Annotated[int | None, typer.Option(min=1, metavar="N", help="Number of starting points.", show_default=False)] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")] = 0,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")] = False,
) -> None:
    """Fit the parameters of the impact model to recorded experiments.

    Writes fit.json, model.json, report.html and plots into the results folder, all of them or none.
    Exit status: 0 fitted, 2 bad input, 3 no convergence.
    """
    experiment = data_path("example") if experiment is None else experiment
    out = _default_folder(experiment) if out is None else out
    say = stage_lines(quiet=quiet)
    with output_folder(out) as folder:
        prepare_jax()
        from identification.run import run_fit

        run_fit(experiment, folder, law=law, reference=reference, starts=starts, seed=seed, progress=say)
    if not quiet:
        typer.echo(f"results in {out}; start with {out / 'report.html'}")


def main() -> NoReturn:
    """Entry point of `fit-parameters`."""
    run(app)


def _default_folder(experiment: Path) -> Path:
    """`fit-NAME` here; a file that cannot be read gets a name all the same, since reading it properly comes later."""
    file = experiment / "experiment.toml" if experiment.is_dir() else experiment
    try:
        name = str(tomllib.loads(file.read_text(encoding="utf-8"))["experiment"]["name"])
    except (OSError, ValueError, KeyError, TypeError):
        name = file.absolute().parent.name
    return Path("fit-" + (re.sub(r"[^\w.-]+", "-", name).strip("-.") or "experiment"))
