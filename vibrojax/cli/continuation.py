"""`vibrojax continue`: a model in; branches of periodic orbits, their tables, special points and figures out."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.grammar import AMPLITUDE, FREQUENCY, canonical, cases, ends, named, values
from vibrojax.cli.options import Amplitude, FigureLook, Frequencies, Gaps, Preset, Quiet, Vary, check_rig
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.cli.source import check_file
from vibrojax.errors import InputError
from vibrojax.figure_style import FIGURE_STYLES, SCREEN

EXAMPLE = "Example:  vibrojax continue --model rig-B-fit/model.json --gap 1e-3 --base-amplitude 1e-3 --sweep frequency=3:12 --out branch"
_OURS = {AMPLITUDE: "amplitude", FREQUENCY: "frequency"}

Doublings = Annotated[
    int, typer.Option(min=0, max=4, metavar="N", help="Follow the branches that are born by up to N period doublings in a row.")
]
SecondParameter = Annotated[
    str | None,
    typer.Option(
        metavar="NAME=A:B",
        help="A second parameter: where orbits of the branch fold, double their period or graze is followed in the plane of both.",
    ),
]


def continue_(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the results.")],
    model: Annotated[Path | None, typer.Option(metavar="MODEL.json", help="A model.json that a fit or a preset wrote.")] = None,
    preset: Preset = None,
    base_amplitude: Amplitude = None,
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="[NAME=]A:B",
            help="What is followed, from A to B, SI (frequency in Hz): frequency, gap, amplitude, m, or a parameter of the model.",
        ),
    ] = None,
    gap: Gaps = None,
    frequency: Frequencies = None,
    vary: Vary = None,
    style: FigureLook = SCREEN.name,
    at: Annotated[
        float | None, typer.Option(metavar="VALUE", help="Value at which the first orbit is looked for. Left out: the lowest.")
    ] = None,
    start: Annotated[
        tuple[float, float], typer.Option(metavar="U V", help="State from which the rig settles onto the first orbit, m and m/s.")
    ] = (0.0, 0.0),
    doublings: Doublings = 0,
    along: SecondParameter = None,
    quiet: Quiet = False,
) -> None:
    """Follow one family of periodic orbits, stable or not, along a parameter; one for each gap or other value that is given.

    The rig first settles onto a stable orbit; another --start may lead to another one. Writes branch.csv, special.json, the figure and its
    caption; with --along borders.csv, its figure and caption too. Exit status: 0 done, 2 bad input, 3 no orbit was found.
    """
    if preset is not None and sweep is None:
        name, bounds, at, gap = _of_preset(preset, at, gap, vary or [])
    else:
        name, bounds = _followed(sweep)
    second, span = (None, bounds) if along is None else _second(along, name)
    at = bounds[0] if at is None else at
    check_rig({"--model": model, "--preset": preset})
    if model is not None:
        check_file(model, "the model.json that a fit or a preset wrote")
    console = Console(quiet=quiet, highlight=False)
    found = []
    with output_folder(out) as folder, stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from vibrojax.continuation.job import borders_and_write, borders_finding, branch_finding, follow_and_write

        rigs = _rigs(model, preset, {"gap": gap, "amplitude": base_amplitude, "frequency": frequency}, vary, name, at)
        if second is not None:
            _check_second(second, span, rigs)
        for tail, rig in rigs:
            look: Any = dict(tail=tail, look=FIGURE_STYLES[style], progress=say)
            branches = follow_and_write(rig, name, bounds, folder, at=at, start=start, doublings=doublings, **look)
            lines = [branch_finding(branch) for branch in branches]
            if second is not None:
                curves, lost = borders_and_write(branches[0], second, (bounds, span), folder, **look)
                lines += [borders_finding(curves), *(f"not followed: {text}" for text in lost)]
            found.append((tail, branches, lines))
    _show(found, out, console)


def _show(found: list[tuple[str, Any, list[str]]], out: Path, console: Console) -> None:
    """Special points, ends and findings of every branch, and where the results are."""
    for tail, branches, lines in found:
        for branch in branches:
            console.print(_table(branch))
            cycles = "1 cycle" if branch.cycles == 1 else f"{branch.cycles} cycles"
            console.print(
                f"{len(branch.parameter)} orbits of {cycles}; first end: {branch.ends[0].value}; last end: {branch.ends[1].value}"
            )
        for line in lines:
            console.print(line, soft_wrap=True, markup=False)
        console.print(f"results in {out}; start with {out / f'branch{tail}.png'}", soft_wrap=True, markup=False)


def _table(branch: Any) -> Table:
    table = Table("special point", branch.label, "impacts a period", "largest multiplier")
    for place in branch.special:
        largest = complex(place.orbit.multipliers[0])
        number = f"{largest:.4g}" if largest.imag else f"{largest.real:.4g}"
        table.add_row(place.kind.value, f"{place.parameter:.6g}", str(place.orbit.touches), number)
    return table


def _of_preset(preset: str, at: float | None, gap: str | None, vary: list[str]) -> tuple[str, tuple[float, float], float, str | None]:
    """What is followed where only a preset is named: its frequencies, from its operating point on, at its first gap."""
    prepare_jax()
    from vibrojax.presets import read_preset

    known = read_preset(preset)
    varies = any(canonical(text.partition("=")[0]) == "gap" for text in vary)
    gap = gap if gap is not None or varies else f"{known.gaps[0]:g}"
    return "frequency", known.ranges["frequency_hz"], known.point["frequency_hz"] if at is None else at, gap


def _followed(sweep: str | None) -> tuple[str, tuple[float, float]]:
    """The parameter and its range."""
    if sweep is None:
        raise InputError("--sweep is missing: expected what is followed, from A to B; add --sweep frequency=A:B")
    ((name, text),) = named("--sweep", [sweep]).items()
    name = name or "frequency"
    return _OURS.get(canonical(name), name), ends("--sweep", text)


def _second(along: str, first: str) -> tuple[str, tuple[float, float]]:
    """The second parameter and its range."""
    ((name, text),) = named("--along", [along]).items()
    if not name:
        raise InputError(f"--along {along} names no parameter: expected NAME=A:B; write --along gap=0:5e-3")
    name = _OURS.get(canonical(name), name)
    if name == first:
        raise InputError(f"--along and --sweep both name {name}: expected two parameters; change one of them")
    low, high = ends("--along", text)
    if not low < high < float("inf"):
        raise InputError(f"--along runs from {low:g} to {high:g}: expected a finite range from the lower to the higher value; correct it")
    return name, (low, high)


def _check_second(name: str, span: tuple[float, float], rigs: list[tuple[str, Any]]) -> None:
    """Refuse a second parameter whose range is not possible, or does not hold the value of every branch."""
    from vibrojax.continuation.rig import check_settings

    for _, rig in rigs:
        value = float(rig.value(name))
        if not span[0] <= value <= span[1]:
            raise InputError(f"--along runs from {span[0]:g} to {span[1]:g}, a branch has {name} = {value:g}: name a range that holds it")
        for end in span:
            check_settings(rig.replace(name, end))


def _rigs(
    model: Path | None, preset: str | None, given: dict[str, Any], vary: list[str] | None, name: str, at: float
) -> list[tuple[str, Any]]:
    """The rig for every combination of the values that do not vary along the branch, with what that adds to the files' names."""
    from vibrojax.continuation import ForcedRig
    from vibrojax.model_file import read_model
    from vibrojax.presets import read_preset

    known = None if preset is None else read_preset(preset)
    further = {_OURS.get(canonical(key), key): values("--vary", text) for key, text in named("--vary", vary or []).items()}
    fixed: dict[str, list[float]] = {}
    for key, value in given.items():
        if key in further and value is not None:
            raise InputError(f"{key} is given twice, by --vary and by its own option: leave one out")
        if key == name:
            fixed[key] = [at]
        elif value is not None:
            fixed[key] = values(f"--{key}", value) if isinstance(value, str) else [value]
        elif known is not None and key != "frequency" and key not in further:
            fixed[key] = list(known.gaps) if key == "gap" else [known["base_amplitude"]]
        elif key not in further:
            raise InputError(f"--{key} is missing: expected it where {name} is swept; add --{key} VALUE")
    what = known.model() if known is not None else read_model(model or Path())
    found = []
    for tail, one in cases(fixed | further):
        rig = ForcedRig(what, one["gap"], one["amplitude"], one["frequency"])
        for key in (key for key in one if key not in given):
            rig = rig.replace(key, one[key])
        found.append((tail, rig))
    return found
