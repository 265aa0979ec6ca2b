"""`vibrojax gallery`: a model or preset in; all its figures on one page out."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.grammar import values
from vibrojax.cli.options import PRESETS, Amplitude, FigureLook, Gaps, Quiet, one_of
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.cli.source import check_file
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.figure_style import FIGURE_STYLES, SCREEN

EXAMPLE = "Example:  vibrojax gallery wires --style paper --out wires-figures"
_STUDIES = ("response", "bifurcation", "peterka", "section", "basins", "lyapunov", "design", "continue")


def gallery(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="A model.json, or the name of a preset such as wires.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the figures and the page.")],
    base_amplitude: Amplitude = None,
    gap: Gaps = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="STUDY",
            help="Only this study's figures; may be repeated.",
            callback=one_of(_STUDIES, "study", f": expected one of {', '.join(_STUDIES)}"),
        ),
    ] = None,
    style: FigureLook = SCREEN.name,
    quiet: Quiet = False,
) -> None:
    """Make all figures of a model or preset in one go, with a page that shows them.

    A preset gets the figures that answer to those of the thesis; another model the usual studies at its gaps. Writes index.md, and for each
    figure PNG, PDF, SVG, caption and data. Exit status: 0 done, 2 bad input, 3 no figure could be made.
    """
    given = _checked(model, base_amplitude, gap)
    with output_folder(out) as folder, stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from vibrojax.gallery import PAGE, make_gallery, model_plates, preset_plates
        from vibrojax.model_file import read_model
        from vibrojax.presets import read_preset

        if given is None:
            preset = read_preset(model)
            rig, plates, title, thesis = preset.model(), preset_plates(preset), preset.title, preset.thesis
        else:
            amplitude, gaps = given
            rig, title, thesis = read_model(Path(model)), Path(model).stem, ""
            plates = model_plates(rig, base_amplitude=amplitude, gaps=gaps)
        chosen = [plate for plate in plates if not only or plate.study in only]
        if not chosen:
            raise InputError(f"{model} has no figure of {' or '.join(only or [])}: expected a study of its gallery; leave --only out")
        made = make_gallery(rig, chosen, folder, title=title, thesis=thesis, look=FIGURE_STYLES[style], progress=say)
    console = Console(quiet=quiet, highlight=False)
    for plate, sentence, failed in made:
        console.print(f"{plate.stem}: {'not made: ' if failed else ''}{sentence}", soft_wrap=True, markup=False)
    console.print(f"{sum(not one.failed for one in made)} figures in {out}; start with {out / PAGE}", soft_wrap=True, markup=False)
    if all(one.failed for one in made):
        raise NoConvergenceError(f"no figure of {model} could be made: see the reasons above")


def _checked(model: str, base_amplitude: float | None, gap: str | None) -> tuple[float, list[float]] | None:
    """A0 and gaps of a model; None for a preset, which has its own."""
    if model in PRESETS:
        if base_amplitude is not None or gap is not None:
            raise InputError(f"{model} has its own A0 and gaps: expected neither --base-amplitude nor --gap; leave them out")
        return None
    check_file(Path(model), f"a model.json, or one of the presets {', '.join(PRESETS)}")
    if base_amplitude is None or gap is None:
        raise InputError("--base-amplitude or --gap is missing: expected both beside a model.json; add --base-amplitude M --gap M,M,...")
    return base_amplitude, values("--gap", gap)
