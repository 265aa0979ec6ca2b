"""`fit-parameters`, also `vibrojax fit`: experiment in; parameters, a model that runs, and a report out."""

from pathlib import Path
from typing import Annotated, NoReturn

import typer

from vibrojax.cli.batch import fit_batch
from vibrojax.cli.errors import run
from vibrojax.cli.grammar import first_values, listed
from vibrojax.cli.options import Data, Experiment, Quiet, Recipe, Start, Style, Term, one_of
from vibrojax.cli.source import check_file, check_source, opened
from vibrojax.errors import InputError

EXAMPLE = "Example:  fit-parameters rig-B/experiment.toml --out rig-B-fit"
LANDING, SMOOTHED = "landing", "smoothed"
WIDTH = 1e-6
"""Width of the smoothed contact switch where none is given, m."""

app = typer.Typer(pretty_exceptions_enable=False)


@app.command(epilog=EXAMPLE)
def fit(
    experiment: Experiment = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for the results. Left out: fit-NAME, NAME being that of the experiment, or of the batch's folder."
        ),
    ] = None,
    recipe: Recipe = None,
    data: Data = None,
    law: Annotated[
        str | None, typer.Option(metavar="NAME", help="Contact law to fit. Left out: the experiment's own, else Hunt-Crossley.")
    ] = None,
    compare: Annotated[
        list[str] | None,
        typer.Option(
            "--compare",
            metavar="LAW,LAW,...",
            help="Contact laws to fit one after the other and rank in a table; the best one's result is written.",
        ),
    ] = None,
    effects: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="NAME", help="Effect to add to the model; may be repeated. `vibrojax diagnose` looks for effects."),
    ] = None,
    term: Term = None,
    start: Start = None,
    earlier: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FIT",
            help="Earlier fit, its folder or fit.json, whose values replace first guesses; a start in the experiment takes precedence.",
        ),
    ] = None,
    reference: Annotated[Path | None, typer.Option(metavar="FILE", help="Known parameter values to print beside the fitted ones.")] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")] = 0,
    integrator: Annotated[
        str,
        typer.Option(
            metavar=f"{LANDING}|{SMOOTHED}",
            help="Steps that land on every touch and release; or beside them a fit by Diffrax on a smoothed contact law.",
            callback=one_of((LANDING, SMOOTHED), "integrator"),
        ),
    ] = LANDING,
    smoothing: Annotated[
        float | None,
        typer.Option(metavar="METRES", help=f"Width of the smoothed contact, m. Left out: {WIDTH:g}; with --integrator {SMOOTHED}."),
    ] = None,
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Sample the posterior of the parameters too, in minutes; needs the extra bayes.")
    ] = False,
    profiles: Annotated[
        bool, typer.Option("--profiles", help="Draw the profiles of the likelihood too, and the contour of stiffness and exponent.")
    ] = False,
    draws: Annotated[int | None, typer.Option(min=50, metavar="N", help="Weighted draws of the posterior. Left out: 400.")] = None,
    batch: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Fit every experiment in this folder and below it; with --out the same as before, go on where that ended.",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Processes that fit experiments; with --batch. Left out: 1.")
    ] = None,
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
    with opened("fit", experiment, recipe, data, out, quiet=quiet) as (source, folder, say):
        from identification.commands.run import run_fit
        from identification.estimation.likelihood import DRAWS
        from identification.report.base import STYLES

        chosen |= {"draws": (draws or DRAWS) if posterior else None, "style": STYLES[style]}
        run_fit(source, folder, **chosen, progress=say, show=say.show)


def contact_width(integrator: str, smoothing: float | None) -> float | None:
    """Width of the contact switch, m; None for the exact contact.

    Raises:
        InputError: a width with an integrator that has none, or one that is no length.

    Example:
        >>> contact_width("smoothed", None)
        1e-06
    """
    if integrator == SMOOTHED:
        width = WIDTH if smoothing is None else smoothing
        if not 0.0 < width < float("inf"):
            raise InputError(f"--smoothing is {width:g} m: expected a length above 0, such as {WIDTH:g}")
        return width
    if smoothing is not None:
        raise InputError(f"--smoothing {smoothing:g} is given for the {integrator} integrator: expected --integrator {SMOOTHED} beside it")
    return None


def _check_batch(batch: Path | None, workers: int | None, alone: dict[str, object]) -> None:
    """Refuse what names one experiment beside many, and workers for one."""
    if batch is None and workers is not None:
        raise InputError(f"--workers {workers} is given without --batch: expected many experiments to share out; add --batch FOLDER")
    if batch is not None and (given := [name for name, value in alone.items() if value is not None]):
        raise InputError(f"{given[0]} is given beside --batch {batch}: expected one of the two; leave one out")


def main() -> NoReturn:
    """Entry point of `fit-parameters`."""
    run(app)
