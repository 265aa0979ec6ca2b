"""Options of `fit-parameters` that no other command has."""

from pathlib import Path
from typing import Annotated

import typer

Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for the results. Left out: fit-NAME, NAME being the experiment's.")]
Law = Annotated[str | None, typer.Option(metavar="NAME", help="Contact law to fit. Left out: the experiment's own, else Hunt-Crossley.")]
Effects = Annotated[
    list[str] | None,
    typer.Option("--with", metavar="NAME", help="Effect to add to the model; may be repeated. `vibrojax diagnose` looks for effects."),
]
Reference = Annotated[Path | None, typer.Option(metavar="FILE", help="Known parameter values to print beside the fitted ones.")]
Starts = Annotated[
    int | None,
    typer.Option(min=1, metavar="N", help="Starts to try. Left out: several where the first fit leaves a misfit.", show_default=False),
]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")]
Posterior = Annotated[
    bool, typer.Option("--posterior", help="Sample the posterior of the parameters too, in minutes; needs the extra bayes.")
]
Profiles = Annotated[
    bool, typer.Option("--profiles", help="Draw the profiles of the likelihood too, and the contour of stiffness and exponent.")
]
Draws = Annotated[
    int | None, typer.Option(min=4, metavar="N", help="Draws of each of the posterior's four chains. Left out: 400.", show_default=False)
]
