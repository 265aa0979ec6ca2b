"""`vibrojax response`, `bifurcation`, `peterka`, `section`, `basins`, `lyapunov`, `design`: a model in; a data set and a figure out."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from vibrojax.cli.basins_said import check_point, named, say_finding
from vibrojax.cli.cluster import check_extra, connected
from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import points_done, stages
from vibrojax.cli.study_options import Shared, with_shared
from vibrojax.errors import InputError

_AMPLITUDE = typer.Option("--base-amplitude", metavar="M", help="Amplitude A0 of the cart, m.", show_default=False)
_GAP = typer.Option("--gap", metavar="M", help="Gap, m.", show_default=False)
_FREQUENCY = typer.Option("--frequency", metavar="HZ", help="Excitation frequency, Hz.", show_default=False)
_CYCLES = typer.Option(
    "--cycles", min=1, metavar="N", help="Cycles that the motion has to settle; fewer once it repeats (not in section and lyapunov)."
)

_DRAWS = 100
_MOST_VALUES = 10_000_000
"""Of one axis."""

Amplitude = Annotated[float, _AMPLITUDE]
Cycles = Annotated[int, _CYCLES]


@with_shared
def response(
    shared: Shared,
    base_amplitude: Amplitude,
    frequencies: Annotated[str, typer.Option(metavar="A:B:N", help="N excitation frequencies from A to B, Hz.")],
    gaps: Annotated[str, typer.Option(metavar="A,B,...", help="Gaps, m.")],
    cycles: Cycles = 300,
) -> None:
    """Impact force against excitation frequency, for several gaps."""
    axes = dict(frequency_hz=_values("--frequencies", frequencies), gap=_values("--gaps", gaps))
    _run("response", shared, axes, dict(base_amplitude=base_amplitude), dict(transient=cycles))


@with_shared
def bifurcation(
    shared: Shared,
    base_amplitude: Amplitude,
    values: Annotated[str, typer.Option(metavar="A:B:N", help="N values of the parameter from A to B, SI.")],
    parameter: Annotated[str, typer.Option(help="frequency_hz, gap, or a parameter of the model.")] = "frequency_hz",
    gap: Annotated[float | None, _GAP] = None,
    frequency: Annotated[float | None, _FREQUENCY] = None,
    cycles: Cycles = 118,
) -> None:
    """Bifurcation diagram of displacement and force, swept up and down, with the jumps."""
    fixed = {name: value for name, value in (("gap", gap), ("frequency_hz", frequency)) if value is not None}
    settings = dict(parameter=parameter, base_amplitude=base_amplitude) | fixed
    _run("bifurcation", shared, dict(values=_values("--values", values)), settings, dict(transient=cycles, recorded=32))


@with_shared
def peterka(
    shared: Shared,
    base_amplitude: Amplitude,
    ratios: Annotated[str, typer.Option(metavar="A:B:N", help="N ratios of excitation to natural frequency, from A to B.")] = "0.5:5:100",
    clearances: Annotated[str, typer.Option(metavar="A:B:N", help="N ratios of gap to base amplitude, from A to B.")] = "0:3:100",
    cycles: Cycles = 300,
) -> None:
    """Peterka map: impacts per cycle z = p/q over frequency ratio and clearance, chaos, and force on z = 1/1."""
    axes = dict(ratio=_values("--ratios", ratios), clearance=_values("--clearances", clearances))
    _run("peterka", shared, axes, dict(base_amplitude=base_amplitude), dict(transient=cycles))


@with_shared
def section(
    shared: Shared,
    base_amplitude: Amplitude,
    gap: Annotated[float, _GAP],
    frequency: Annotated[float, _FREQUENCY],
    strobes: Annotated[int, typer.Option(min=1, metavar="N", help="Section points.")] = 1000,
    cycles: Cycles = 300,
) -> None:
    """Poincaré section, phase plane and histories of one operating point."""
    point = dict(frequency_hz=frequency, gap=gap, base_amplitude=base_amplitude)
    _run("section", shared, {}, point | dict(strobes=strobes, transient=cycles), None)


@with_shared
def basins(
    shared: Shared,
    displacements: Annotated[str, typer.Option(metavar="A:B:N", help="N initial displacements relative to the cart, from A to B, m.")],
    velocities: Annotated[str, typer.Option(metavar="A:B:N", help="N initial velocities from A to B, m/s.")],
    base_amplitude: Annotated[float | None, _AMPLITUDE] = None,
    gap: Annotated[float | None, _GAP] = None,
    frequency: Annotated[float | None, _FREQUENCY] = None,
    along: Annotated[
        str | None,
        typer.Option(metavar="NAME=A:B:N", help="Follow the basins along a parameter: frequency, gap, amplitude, or one of the model's."),
    ] = None,
    cycles: Cycles = 300,
    most_cycles: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Cycles after which a motion that does not repeat is left. Left out: ten times --cycles."),
    ] = None,
) -> None:
    """Basins of attraction: where each initial state settles, how large and how tangled the basins are, and what each motion bears."""
    axes = dict(u0=_values("--displacements", displacements), v0=_values("--velocities", velocities))
    given = {"base_amplitude": base_amplitude, "gap": gap, "frequency_hz": frequency}
    parameter, text = named(along)
    settings = check_point(given, parameter, fit=shared.fit is not None) | ({} if most_cycles is None else dict(most_cycles=most_cycles))
    if parameter is None:
        _run("basins", shared, axes, settings, dict(transient=cycles))
    else:
        axes = dict(values=_values("--along", text)) | axes
        _run("basins_along", shared, axes, settings | dict(parameter=parameter), dict(transient=cycles))


@with_shared
def lyapunov(
    shared: Shared,
    base_amplitude: Amplitude,
    values: Annotated[str, typer.Option(metavar="A:B:N", help="N values of the parameter from A to B, SI.")],
    parameter: Annotated[str, typer.Option(help="frequency_hz, gap, or a parameter of the model.")] = "frequency_hz",
    gap: Annotated[float | None, _GAP] = None,
    frequency: Annotated[float | None, _FREQUENCY] = None,
    cycles: Cycles = 300,
) -> None:
    """Largest Lyapunov exponent along a parameter."""
    fixed = {name: value for name, value in (("gap", gap), ("frequency_hz", frequency)) if value is not None}
    settings = dict(parameter=parameter, base_amplitude=base_amplitude, cycles=cycles) | fixed
    _run("lyapunov", shared, dict(values=_values("--values", values)), settings, dict(transient=cycles))


@with_shared
def design(
    shared: Shared,
    base_amplitude: Amplitude,
    gap: Annotated[float, _GAP],
    frequencies: Annotated[str, typer.Option(metavar="A,B,...", help="Excitation frequencies, Hz.")],
    mass_ratios: Annotated[str, typer.Option(metavar="A:B:N", help="N masses over that of the model, from A to B.")] = "0.1:3:100",
    cycles: Cycles = 300,
) -> None:
    """Hammer design: impact force against the hammer's mass, its spring kept, at several excitation frequencies."""
    axes = dict(mass_ratio=_values("--mass-ratios", mass_ratios), frequency_hz=_values("--frequencies", frequencies))
    _run("design", shared, axes, dict(gap=gap, base_amplitude=base_amplitude), dict(transient=cycles))


COMMANDS: dict[str, tuple[Callable[..., None], str]] = {
    "response": (response, "--model model.json --base-amplitude 2e-3 --frequencies 3:9:300 --gaps 0,1e-3,2.4e-3 --out response"),
    "bifurcation": (bifurcation, "--model model.json --base-amplitude 2e-3 --values 3:9:300 --gap 1e-3 --out bifurcation"),
    "peterka": (peterka, "--model model.json --base-amplitude 2e-3 --out map"),
    "section": (section, "--model model.json --base-amplitude 2e-3 --gap 1e-3 --frequency 7.7 --out section"),
    "basins": (
        basins,
        "--model model.json --base-amplitude 2e-3 --gap 3e-3 --frequency 8 --displacements=-0.01:0.003:99 --velocities=-0.5:0.5:99 --out b",
    ),
    "lyapunov": (lyapunov, "--model model.json --base-amplitude 2e-3 --values 3:9:200 --gap 1e-3 --out lyapunov"),
    "design": (design, "--model model.json --base-amplitude 2e-3 --gap 0 --frequencies 3,4.5,6 --out design"),
}
"""The commands, and an example of each."""


def _run(name: str, shared: Shared, axes: dict[str, list[float]], settings: dict[str, Any], span: dict[str, int] | None) -> None:
    if shared.store is not None:
        check_extra(cluster=shared.cluster is not None)
    begin = time.perf_counter()
    with output_folder(shared.out) as folder:
        with stages(quiet=shared.quiet, since=begin) as say:
            say("loading JAX")
            prepare_jax()
            from vibrojax.batch import Span
            from vibrojax.studies.job import Job
            from vibrojax.studies.write import write_study

            more = {} if span is None else {"span": Span(**span)}
            model, draws = _rigs(shared)
            job = Job(study=name, model=model, axes=axes, settings=settings | more, draws=draws, points=shared.tile)
        data = _made(job, shared, begin)
        with stages(quiet=shared.quiet, since=begin) as say:
            say("drawing")
            files = [path.name for path in write_study(name, data, folder)]
    console = Console(quiet=shared.quiet, highlight=False)
    took = f", {data.attrs['seconds']:.2f} s" if "seconds" in data.attrs else ""
    console.print(f"{data.attrs['title']}: engine {data.attrs['engine']}{took}", soft_wrap=True)
    if data.attrs["lanes_that_failed"] != "{}":
        console.print(f"not integrated: {data.attrs['lanes_that_failed']}", soft_wrap=True)
    say_finding(console, data)
    console.print(f"{' and '.join(files)} in {shared.out}", soft_wrap=True)


def _made(job: Any, shared: Shared, begin: float) -> Any:
    """The study; one that is made at once has no points to count on the way."""
    from vibrojax.studies.run import make

    if shared.store is None and job.draws is None:
        with stages(quiet=shared.quiet, since=begin) as say:
            say("integrating")
            return make(job)
    with connected(shared.cluster) as client, points_done(job.lanes, quiet=shared.quiet) as progress:
        return make(job, store=shared.store, client=client, progress=progress, notice=lambda text: typer.echo(text, err=True))


def _rigs(shared: Shared) -> tuple[Any, Any]:
    """The model, and the draws of the fit where one is given."""
    from vibrojax.model_file import read_model
    from vibrojax.studies.draws import read_fit

    if shared.fit is None:
        return read_model(shared.model or Path()), None
    fit = read_fit(shared.fit)
    return fit.model, fit.draw(_DRAWS if shared.draws is None else shared.draws, seed=shared.seed)


def _values(option: str, text: str) -> list[float]:
    """`A:B:N` or `A,B,...` as numbers."""
    try:
        if ":" not in text:
            return [float(part) for part in text.split(",")]
        begin, end, number = text.split(":")
        first, last, count = float(begin), float(end), int(number)
    except ValueError:
        raise InputError(f"{option} is {text!r}: expected A:B:N (N values from A to B) or A,B,...; correct it") from None
    if not 1 <= count <= _MOST_VALUES:
        raise InputError(f"{option} is {text!r}: expected A:B:N with N from 1 to {_MOST_VALUES}; correct it")
    step = (last - first) / max(count - 1, 1)
    return [first + step * place for place in range(count)]
