"""Options of `fit-parameters`, and those that it shares with other commands."""

from pathlib import Path
from typing import Annotated

import typer

from identification.wording import STYLE_NAMES
from vibrojax.errors import InputError

Experiment = Annotated[
    Path | None,
    typer.Argument(
        metavar="[EXPERIMENT]", help="Folder of the experiment, or its experiment.toml. Left out: the embedded example.", show_default=False
    ),
]
Recipe = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Use recordings published by others, read as this recipe says; with --data.", show_default=False),
]
Data = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the recipe's recordings.", show_default=False)]


def _known_style(style: str) -> str:
    if style not in STYLE_NAMES:
        raise typer.BadParameter(f"{style!r} is no style")
    return style


Style = Annotated[
    str,
    typer.Option(
        metavar="|".join(STYLE_NAMES),
        help="Page and plots in colours, or in black and white for paper, with a PDF file of each plot.",
        callback=_known_style,
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")]


Out = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR", help="Folder for the results. Left out: fit-NAME, NAME being that of the experiment, or of the batch's folder."
    ),
]
Law = Annotated[str | None, typer.Option(metavar="NAME", help="Contact law to fit. Left out: the experiment's own, else Hunt-Crossley.")]
Compare = Annotated[
    list[str] | None,
    typer.Option(
        "--compare",
        metavar="LAW,LAW,...",
        help="Contact laws to fit one after the other and rank in a table; the best one's result is written.",
    ),
]
Effects = Annotated[
    list[str] | None,
    typer.Option("--with", metavar="NAME", help="Effect to add to the model; may be repeated. `vibrojax diagnose` looks for effects."),
]
Term = Annotated[
    list[str] | None,
    typer.Option(
        "--term",
        metavar="[NAME=]FORMULA",
        help="Force on the hammer, N, positive towards the stop, such as -a*u_dot*abs(u_dot); names other than u, u_dot, t, delta,"
        " delta_dot and pi are estimated. May be repeated.",
    ),
]
Start = Annotated[
    list[str] | None,
    typer.Option(
        "--start",
        metavar="NAME=VALUE",
        help="First value, SI, of a parameter of a --term; a factor in front of it needs none. May be repeated.",
    ),
]
Earlier = Annotated[
    Path | None,
    typer.Option(
        "--from",
        metavar="FIT",
        help="Earlier fit, its folder or fit.json, whose values replace first guesses; a start in the experiment takes precedence.",
    ),
]
Reference = Annotated[Path | None, typer.Option(metavar="FILE", help="Known parameter values to print beside the fitted ones.")]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")]
Posterior = Annotated[
    bool, typer.Option("--posterior", help="Sample the posterior of the parameters too, in minutes; needs the extra bayes.")
]
Profiles = Annotated[
    bool, typer.Option("--profiles", help="Draw the profiles of the likelihood too, and the contour of stiffness and exponent.")
]
Draws = Annotated[int | None, typer.Option(min=50, metavar="N", help="Weighted draws of the posterior. Left out: 400.", show_default=False)]


Batch = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Fit every experiment in this folder and below it; with --out the same as before, go on where that ended.",
    ),
]
Workers = Annotated[
    int | None, typer.Option(min=1, metavar="N", help="Processes that fit experiments; with --batch. Left out: 1.", show_default=False)
]


LANDING, SMOOTHED = "landing", "smoothed"
WIDTH = 1e-6
"""Width of the smoothed contact switch where none is given, m."""


def _known_integrator(name: str) -> str:
    if name not in (LANDING, SMOOTHED):
        raise typer.BadParameter(f"{name!r} is no integrator")
    return name


Integrator = Annotated[
    str,
    typer.Option(
        metavar=f"{LANDING}|{SMOOTHED}",
        help="Steps that land on every touch and release; or beside them a fit by Diffrax on a smoothed contact law.",
        callback=_known_integrator,
    ),
]
Smoothing = Annotated[
    float | None,
    typer.Option(
        metavar="METRES", help=f"Width of the smoothed contact, m. Left out: {WIDTH:g}; with --integrator {SMOOTHED}.", show_default=False
    ),
]


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
