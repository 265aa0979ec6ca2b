"""`fit-parameters`, also `vibrojax fit`: experiment in; parameters, a model that runs, and a report out."""

from pathlib import Path
from typing import NoReturn

import typer
from rich.console import Console

from vibrojax.aside import of_earlier_set
from vibrojax.cli import options
from vibrojax.cli.batch import fit_batch
from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.errors import run
from vibrojax.cli.grammar import first_values, listed
from vibrojax.cli.options import LANDING, Data, Experiment, Integrator, Quiet, Recipe, Smoothing, Style, contact_width
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.cli.source import check_file, check_source, default_folder, experiment_source
from vibrojax.errors import InputError

EXAMPLE = "Example:  fit-parameters rig-B/experiment.toml --out rig-B-fit"

app = typer.Typer(pretty_exceptions_enable=False)


@app.command(epilog=EXAMPLE)
def fit(
    experiment: Experiment = None,
    out: options.Out = None,
    recipe: Recipe = None,
    data: Data = None,
    law: options.Law = None,
    compare: options.Compare = None,
    effects: options.Effects = None,
    term: options.Term = None,
    start: options.Start = None,
    earlier: options.Earlier = None,
    reference: options.Reference = None,
    seed: options.Seed = 0,
    integrator: Integrator = LANDING,
    smoothing: Smoothing = None,
    posterior: options.Posterior = False,
    profiles: options.Profiles = False,
    draws: options.Draws = None,
    batch: options.Batch = None,
    workers: options.Workers = None,
    style: Style = "screen",
    quiet: Quiet = False,
) -> None:
    """Fit the parameters of the impact model to recorded experiments.

    Writes fit.json, model.json, result.nc, report.html and plots into the results folder, all of them or none. With --batch such a set for
    each experiment, and batch.csv, batch.html and batch.json.
    Exit status: 0 fitted, 2 bad input, 3 no convergence; with --batch 3 where any experiment could not be fitted, for whatever reason.
    """
    _check_batch(batch, workers, {"EXPERIMENT": experiment, "--recipe": recipe, "--data": data})
    check_source(experiment, recipe, data)
    width = contact_width(integrator, smoothing)
    if draws is not None and not posterior:
        raise InputError(f"--draws {draws} is given without a posterior: expected --posterior beside it")
    laws, starts = listed(compare or ()), first_values(start or (), term or ())
    alone = {"--law": law, "--reference": reference, "--posterior": posterior, "--profiles": profiles}
    if compare and (beside := [name for name, value in alone.items() if value]):
        raise InputError(f"{beside[0]} is given beside --compare: expected one of the two; fit the best law again with --law NAME")
    if earlier is not None:
        check_file(earlier / "fit.json" if earlier.is_dir() else earlier, "the fit.json of an earlier fit, or its folder")
    if reference is not None:
        check_file(reference, "a table of reference values")
    chosen = {"law": law, "compare": laws, "effects": effects or (), "terms": list(term or ()), "starts": starts, "earlier": earlier}
    chosen |= {"reference": reference, "seed": seed, "smoothing": width, "with_profiles": profiles}
    if batch is not None:
        fit_batch(batch, out, chosen, posterior=posterior, draws=draws, style=style, workers=workers or 1, quiet=quiet)
        return
    out = default_folder("fit", experiment, recipe) if out is None else out
    with (
        output_folder(out, outdated=of_earlier_set) as folder,
        experiment_source(experiment, recipe, data) as source,
        stages(quiet=quiet) as say,
    ):
        say("loading JAX")
        prepare_jax()
        from identification.commands.run import run_fit
        from identification.estimation.likelihood import DRAWS
        from identification.report.base import STYLES

        chosen |= {"draws": (draws or DRAWS) if posterior else None, "style": STYLES[style]}
        run_fit(source, folder, **chosen, progress=say, show=say.show)
    Console(quiet=quiet, highlight=False).print(f"results in {out}; start with {out / 'report.html'}", soft_wrap=True)


def _check_batch(batch: Path | None, workers: int | None, alone: dict[str, object]) -> None:
    """Refuse what names one experiment beside many, and workers for one."""
    if batch is None and workers is not None:
        raise InputError(f"--workers {workers} is given without --batch: expected many experiments to share out; add --batch FOLDER")
    if batch is not None and (given := [name for name, value in alone.items() if value is not None]):
        raise InputError(f"{given[0]} is given beside --batch {batch}: expected one of the two; leave one out")


def main() -> NoReturn:
    """Entry point of `fit-parameters`."""
    run(app)
