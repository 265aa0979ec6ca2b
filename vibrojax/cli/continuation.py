"""`vibrojax continue`: a model in; one branch of periodic orbits, its table, special points and picture out."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.options import Quiet
from vibrojax.cli.output import output_folder
from vibrojax.cli.paths import check_file
from vibrojax.cli.progress import stages
from vibrojax.errors import InputError

EXAMPLE = "Example:  vibrojax continue --model rig-B-fit/model.json --gap 1e-3 --amplitude 1e-3 --from 3 --to 12 --out branch"


def continue_(
    begin: Annotated[float, typer.Option("--from", metavar="VALUE", help="Lowest value of the parameter, SI (frequency in Hz).")],
    end: Annotated[float, typer.Option("--to", metavar="VALUE", help="Highest value.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the results.", show_default=False)],
    model: Annotated[Path, typer.Option(metavar="MODEL.json", help="A model.json that a fit or a preset wrote.", show_default=False)],
    gap: Annotated[float | None, typer.Option(metavar="M", help="Gap, m.", show_default=False)] = None,
    amplitude: Annotated[
        float | None, typer.Option("--amplitude", "--base-amplitude", metavar="M", help="Amplitude A0 of the cart, m.", show_default=False)
    ] = None,
    frequency: Annotated[float | None, typer.Option(metavar="HZ", help="Frequency of the cart, Hz.", show_default=False)] = None,
    parameter: Annotated[
        str, typer.Option(metavar="NAME", help="What varies: frequency, gap, amplitude, m, or a parameter of the model.")
    ] = "frequency",
    at: Annotated[
        float | None,
        typer.Option(metavar="VALUE", help="Value at which the first orbit is looked for. Left out: the lowest.", show_default=False),
    ] = None,
    start: Annotated[
        tuple[float, float], typer.Option(metavar="U V", help="State from which the rig settles onto the first orbit, m and m/s.")
    ] = (0.0, 0.0),
    quiet: Quiet = False,
) -> None:
    """Follow one family of periodic orbits, stable or not, along a parameter.

    The rig first settles onto a stable orbit; another --start may lead to another one. Writes branch.csv, special.json and branch.png.
    Exit status: 0 done, 2 bad input, 3 no orbit was found.
    """
    at = begin if at is None else at
    check_file(model, "the model.json that a fit or a preset wrote")
    settings = _settings({"gap": gap, "amplitude": amplitude, "frequency": frequency}, parameter, at)
    with output_folder(out) as folder, stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from vibrojax.continuation import ForcedRig
        from vibrojax.continuation.job import follow_and_write
        from vibrojax.model_file import read_model

        rig = ForcedRig(read_model(model), settings["gap"], settings["amplitude"], settings["frequency"])
        branch = follow_and_write(rig, parameter, (begin, end), folder, at=at, start=start, progress=say)
    table = Table("special point", branch.label, "impacts a period", "largest multiplier")
    for place in branch.special:
        largest = complex(place.orbit.multipliers[0])
        number = f"{largest:.4g}" if largest.imag else f"{largest.real:.4g}"
        table.add_row(place.kind.value, f"{place.parameter:.6g}", str(place.orbit.touches), number)
    console = Console(quiet=quiet, highlight=False)
    console.print(table)
    cycles = "1 cycle" if branch.cycles == 1 else f"{branch.cycles} cycles"
    console.print(f"{len(branch.parameter)} orbits of {cycles}; first end: {branch.ends[0].value}; last end: {branch.ends[1].value}")
    console.print(f"results in {out}; start with {out / 'branch.png'}", soft_wrap=True)


def _settings(given: dict[str, float | None], parameter: str, at: float) -> dict[str, float]:
    """Gap, amplitude and frequency; the one that varies need not be given."""
    settings = {name: at if name == parameter else value for name, value in given.items()}
    if missing := [name for name, value in settings.items() if value is None]:
        raise InputError(f"--{missing[0]} is missing: expected it where --parameter is {parameter}; add --{missing[0]} VALUE")
    return {name: float(value) for name, value in settings.items() if value is not None}
