"""Options that several commands have."""

from pathlib import Path
from typing import Annotated

import typer

from identification.wording.style_names import STYLE_NAMES

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


def _known(style: str) -> str:
    if style not in STYLE_NAMES:
        raise typer.BadParameter(f"{style!r} is no style")
    return style


Style = Annotated[
    str,
    typer.Option(
        metavar="|".join(STYLE_NAMES),
        help="Page and plots in colours, or in black and white for paper, with a PDF file of each plot.",
        callback=_known,
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")]
