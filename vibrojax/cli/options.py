"""Options that several commands have."""

from pathlib import Path
from typing import Annotated

import typer

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
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")]
