"""`vibrojax response`, `bifurcation`, `peterka`, `section`, `basins`, `lyapunov`, `design`: a model in; a data set and a figure out."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import stages
from vibrojax.errors import InputError

_MODEL = typer.Option("--model", metavar="MODEL.json", help="A model.json that a fit wrote.", show_default=False)
_OUT = typer.Option("--out", metavar="DIR", help="Folder for the data set and the figure.", show_default=False)
_AMPLITUDE = typer.Option("--base-amplitude", metavar="M", help="Amplitude A0 of the cart, m.", show_default=False)
_GAP = typer.Option("--gap", metavar="M", help="Gap, m.", show_default=False)
_FREQUENCY = typer.Option("--frequency", metavar="HZ", help="Excitation frequency, Hz.", show_default=False)
_CYCLES = typer.Option("--cycles", min=1, metavar="N", help="Cycles left to die down; fewer where an orbit closes.")
_QUIET = typer.Option("--quiet", help="Say nothing unless something is wrong.")

Model = Annotated[Path, _MODEL]
Out = Annotated[Path, _OUT]
Amplitude = Annotated[float, _AMPLITUDE]
Cycles = Annotated[int, _CYCLES]
Quiet = Annotated[bool, _QUIET]


def response(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    frequencies: Annotated[str, typer.Option(metavar="A:B:N", help="N excitation frequencies from A to B, Hz.")],
    gaps: Annotated[str, typer.Option(metavar="A,B,...", help="Gaps, m.")],
    cycles: Cycles = 300,
    quiet: Quiet = False,
) -> None:
    """Impact force against excitation frequency, for several gaps."""
    given = dict(frequency_hz=_values("--frequencies", frequencies), gap=_values("--gaps", gaps))

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        return studies.frequency_response(rig, **given, base_amplitude=base_amplitude, span=batch.Span(transient=cycles))

    _run("response", model, out, quiet, job)


def bifurcation(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    values: Annotated[str, typer.Option(metavar="A:B:N", help="N values of the parameter from A to B, SI.")],
    parameter: Annotated[str, typer.Option(help="frequency_hz, gap, or a parameter of the model.")] = "frequency_hz",
    gap: Annotated[float | None, _GAP] = None,
    frequency: Annotated[float | None, _FREQUENCY] = None,
    cycles: Cycles = 118,
    quiet: Quiet = False,
) -> None:
    """Bifurcation diagram of displacement and force, swept up and down, with the jumps."""
    fixed = {name: value for name, value in (("gap", gap), ("frequency_hz", frequency)) if value is not None}
    swept = _values("--values", values)

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        span = batch.Span(transient=cycles, recorded=32)
        return studies.bifurcation(rig, parameter=parameter, values=swept, base_amplitude=base_amplitude, span=span, **fixed)

    _run("bifurcation", model, out, quiet, job)


def peterka(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    ratios: Annotated[str, typer.Option(metavar="A:B:N", help="N ratios of excitation to natural frequency, from A to B.")] = "0.5:5:100",
    clearances: Annotated[str, typer.Option(metavar="A:B:N", help="N ratios of gap to base amplitude, from A to B.")] = "0:3:100",
    cycles: Cycles = 300,
    quiet: Quiet = False,
) -> None:
    """Peterka map: impacts per cycle z = p/q over frequency ratio and clearance, chaos, and force on z = 1/1."""
    given = dict(ratio=_values("--ratios", ratios), clearance=_values("--clearances", clearances))

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        return studies.peterka(rig, **given, base_amplitude=base_amplitude, span=batch.Span(transient=cycles))

    _run("peterka", model, out, quiet, job)


def section(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    gap: Annotated[float, _GAP],
    frequency: Annotated[float, _FREQUENCY],
    strobes: Annotated[int, typer.Option(min=1, metavar="N", help="Section points.")] = 1000,
    cycles: Cycles = 300,
    quiet: Quiet = False,
) -> None:
    """Poincaré section, phase plane and histories of one operating point."""

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        point = dict(frequency_hz=frequency, gap=gap, base_amplitude=base_amplitude)
        return studies.section(rig, **point, strobes=strobes, transient=cycles)

    _run("section", model, out, quiet, job)


def basins(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    gap: Annotated[float, _GAP],
    frequency: Annotated[float, _FREQUENCY],
    displacements: Annotated[str, typer.Option(metavar="A:B:N", help="N initial displacements relative to the cart, from A to B, m.")],
    velocities: Annotated[str, typer.Option(metavar="A:B:N", help="N initial velocities from A to B, m/s.")],
    cycles: Cycles = 300,
    quiet: Quiet = False,
) -> None:
    """Basins of attraction: which initial states keep impacting, and their share."""
    plane = dict(u0=_values("--displacements", displacements), v0=_values("--velocities", velocities))

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        point = dict(frequency_hz=frequency, gap=gap, base_amplitude=base_amplitude)
        return studies.basins(rig, **plane, **point, span=batch.Span(transient=cycles))

    _run("basins", model, out, quiet, job)


def lyapunov(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    values: Annotated[str, typer.Option(metavar="A:B:N", help="N values of the parameter from A to B, SI.")],
    parameter: Annotated[str, typer.Option(help="frequency_hz, gap, or a parameter of the model.")] = "frequency_hz",
    gap: Annotated[float | None, _GAP] = None,
    frequency: Annotated[float | None, _FREQUENCY] = None,
    cycles: Cycles = 300,
    quiet: Quiet = False,
) -> None:
    """Largest Lyapunov exponent along a parameter."""
    fixed = {name: value for name, value in (("gap", gap), ("frequency_hz", frequency)) if value is not None}
    along = _values("--values", values)

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        span = batch.Span(transient=cycles)
        return studies.lyapunov(rig, parameter=parameter, values=along, base_amplitude=base_amplitude, span=span, cycles=cycles, **fixed)

    _run("lyapunov", model, out, quiet, job)


def design(
    model: Model,
    out: Out,
    base_amplitude: Amplitude,
    gap: Annotated[float, _GAP],
    frequencies: Annotated[str, typer.Option(metavar="A,B,...", help="Excitation frequencies, Hz.")],
    mass_ratios: Annotated[str, typer.Option(metavar="A:B:N", help="N masses over that of the model, from A to B.")] = "0.1:3:100",
    cycles: Cycles = 300,
    quiet: Quiet = False,
) -> None:
    """Hammer design: impact force against the hammer's mass, its spring kept, at several excitation frequencies."""
    axes = dict(mass_ratio=_values("--mass-ratios", mass_ratios), frequency_hz=_values("--frequencies", frequencies))

    def job(studies: Any, rig: Any, batch: Any) -> Any:
        return studies.hammer_design(rig, **axes, gap=gap, base_amplitude=base_amplitude, span=batch.Span(transient=cycles))

    _run("design", model, out, quiet, job)


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


def _run(name: str, model: Path, out: Path, quiet: bool, job: Callable[[Any, Any, Any], Any]) -> None:
    with output_folder(out) as folder, stages(quiet=quiet) as say:
        say("loading JAX")
        prepare_jax()
        from vibrojax import batch, studies
        from vibrojax.model_file import read_model
        from vibrojax.studies.write import write_study

        rig = read_model(model)
        say("integrating")
        data = job(studies, rig, batch)
        say("drawing")
        files = [path.name for path in write_study(name, data, folder)]
    console = Console(quiet=quiet, highlight=False)
    console.print(f"{data.attrs['title']}: engine {data.attrs['engine']}, {data.attrs['seconds']:.2f} s", soft_wrap=True)
    if data.attrs["lanes_that_failed"] != "{}":
        console.print(f"not integrated: {data.attrs['lanes_that_failed']}", soft_wrap=True)
    console.print(f"{' and '.join(files)} in {out}", soft_wrap=True)


def _values(option: str, text: str) -> list[float]:
    """`A:B:N` or `A,B,...` as numbers."""
    try:
        if ":" in text:
            first, last, count = text.split(":")
            if int(count) < 1:
                raise ValueError
            step = (float(last) - float(first)) / max(int(count) - 1, 1)
            return [float(first) + step * number for number in range(int(count))]
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} is {text!r}: expected A:B:N (N values from A to B) or A,B,...; correct it") from None
