"""`vibrojax response`, `bifurcation`, `peterka`, `section`, `basins`, `lyapunov`, `design`: a model in; a data set and a figure out."""

import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.console import Console
from rich.table import Table

from vibrojax.cli.environment import check_extra, connected, prepare_jax, seconds_compiling
from vibrojax.cli.grammar import AMPLITUDE, FORMS, FREQUENCY, canonical, cases, named, one_range, swept, values
from vibrojax.cli.options import NOTHING_OVER, Over, Shared, with_shared
from vibrojax.cli.output import output_folder
from vibrojax.cli.progress import points_done, stages
from vibrojax.cli.source import check_file
from vibrojax.errors import InputError
from vibrojax.figure_style import FIGURE_STYLES

_DRAWS = 100
_OPTION = {AMPLITUDE: "--base-amplitude", "gap": "--gap", FREQUENCY: "--frequency"}

Cycles = Annotated[
    int,
    typer.Option(
        "--cycles", min=1, metavar="N", help="Cycles that the motion has to settle; fewer once it repeats (not in section and lyapunov)."
    ),
]


@with_shared
def response(shared: Shared, cycles: Cycles = 300) -> None:
    """Impact force against excitation frequency, for several gaps and stiffnesses."""
    _run("response", shared, {}, dict(transient=cycles))


@with_shared
def bifurcation(
    shared: Shared,
    branches: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="branch.csv",
            help="Branch that vibrojax continue followed for the same model, drawn over both sweeps, side by side. Repeat it for another.",
        ),
    ] = None,
    cycles: Cycles = 118,
) -> None:
    """Bifurcation diagram of displacement and force, swept up and down along frequency, gap or any parameter, with the jumps."""
    if branches and shared.fit is not None:
        raise InputError("--branches is given with --fit: expected one model, that of the branches; name its --model")
    for path in branches or []:
        check_file(path, "a branch.csv that vibrojax continue wrote")
    over = Over(branches=tuple(branches or ()))
    _run("bifurcation", shared, {}, dict(transient=cycles, recorded=32), over=over)


@with_shared
def peterka(
    shared: Shared,
    borders: Annotated[
        Path | None,
        typer.Option(metavar="borders.csv", help="Borders that vibrojax continue --along followed for the same model, drawn over the map."),
    ] = None,
    cycles: Cycles = 300,
) -> None:
    """Peterka map: impacts per cycle z = p/q over frequency ratio and clearance, chaos, and force on z = 1/1."""
    if borders is not None:
        check_file(borders, "the borders.csv that vibrojax continue --along wrote")
    _run("peterka", shared, {}, dict(transient=cycles), over=Over(borders=borders))


@with_shared
def section(
    shared: Shared,
    strobes: Annotated[int, typer.Option(min=1, metavar="N", help="Section points.")] = 1000,
    start: Annotated[tuple[float, float], typer.Option(metavar="U V", help="State from which the motion starts, m and m/s.")] = (0.0, 0.0),
    cycles: Cycles = 300,
) -> None:
    """Poincaré section, phase plane and histories of one operating point."""
    u0, v0 = start
    _run("section", shared, dict(strobes=strobes, transient=cycles) | (dict(u0=u0, v0=v0) if any(start) else {}))


@with_shared
def basins(
    shared: Shared,
    along: Annotated[
        str | None,
        typer.Option(metavar="NAME=A:B:N", help="Follow the basins along a parameter: frequency, gap, amplitude, or one of the model's."),
    ] = None,
    manifolds: Annotated[
        int | None,
        typer.Option(min=1, metavar="Q", help="Draw stable and unstable manifolds of the saddles of up to Q cycles: the boundaries."),
    ] = None,
    cycles: Cycles = 300,
    most_cycles: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Cycles after which a motion that does not repeat is left. Left out: ten times --cycles."),
    ] = None,
) -> None:
    """Basins of attraction: where each initial state settles, how large and how tangled the basins are, and what each motion bears."""
    settings = {} if most_cycles is None else dict(most_cycles=most_cycles)
    if manifolds is not None:
        for option, value in (("--along", along), ("--fit", shared.fit)):
            if value is not None:
                raise InputError(f"--manifolds is given with {option}: expected one picture of one model; leave one of them out")
    if along is None:
        _run("basins", shared, settings, dict(transient=cycles), over=Over(manifolds=manifolds))
    else:
        if shared.fit is not None:
            raise InputError("--along is given with --fit: expected one model, since attractors are matched along it; name its --model")
        _run("basins_along", shared, settings, dict(transient=cycles), followed=along)


@with_shared
def lyapunov(shared: Shared, cycles: Cycles = 300) -> None:
    """Largest Lyapunov exponent along frequency, gap or any parameter."""
    _run("lyapunov", shared, dict(cycles=cycles), dict(transient=cycles))


@with_shared
def design(shared: Shared, cycles: Cycles = 300) -> None:
    """Hammer design: impact force against the hammer's mass, its spring kept, at several excitation frequencies."""
    _run("design", shared, {}, dict(transient=cycles))


_RIG = "--model model.json --base-amplitude 2e-3"
COMMANDS: dict[str, tuple[Callable[..., None], str]] = {
    "response": (response, f"{_RIG} --sweep frequency=3:9:300 --gap 0,1e-3,2.4e-3 --out response"),
    "bifurcation": (bifurcation, f"{_RIG} --sweep frequency=3:9:300 --gap 1e-3 --out bifurcation"),
    "peterka": (peterka, f"{_RIG} --sweep ratio=0.5:5:100 --sweep clearance=0:3:100 --out map"),
    "section": (section, f"{_RIG} --gap 1e-3 --frequency 7.7 --out section"),
    "basins": (basins, f"{_RIG} --gap 3e-3 --frequency 8 --sweep u0=-0.01:0.003:99 --sweep v0=-0.5:0.5:99 --out basins"),
    "lyapunov": (lyapunov, f"{_RIG} --sweep frequency=3:9:200 --gap 1e-3 --out lyapunov"),
    "design": (design, f"{_RIG} --gap 0 --frequency 3,4.5,6 --sweep mass_ratio=0.1:3:100 --out design"),
}
"""The commands, and an example of each."""


class Rig(NamedTuple):
    """What a study is made of: the model, its draws where a fit is given, and what a preset sets."""

    model: Any
    draws: Any
    preset: Any


def _run(
    name: str,
    shared: Shared,
    settings: dict[str, Any],
    span: dict[str, int] | None = None,
    *,
    followed: str | None = None,
    over: Over = NOTHING_OVER,
) -> None:
    ways = _swept(name, shared, followed, {}) if shared.preset is None else None
    if shared.store is not None:
        check_extra(cluster=shared.cluster is not None)
    begin = time.perf_counter()
    console = Console(quiet=shared.quiet, highlight=False)
    with output_folder(shared.out) as folder:
        with stages(quiet=shared.quiet, since=begin) as say:
            say("loading JAX")
            prepare_jax()
            from vibrojax.batch import Span

            rig = _rig(shared)
            axes, along = ways or _swept(name, shared, followed, _ranges(rig.preset))
            settings = settings | ({} if span is None else {"span": Span(**span)}) | ({"parameter": along} if along else {})
            jobs = _jobs(name, shared, rig, axes, settings)
            over.check([job for _, job in jobs])
        loaded = time.perf_counter() - begin
        written = [_written(name, tail, job, shared, folder, begin, over) for tail, job in jobs]
    for tail, data, sentence, files, took in written:
        console.print(f"{data.attrs['title']}{_words(tail)}: engine {data.attrs['engine']}{took}", soft_wrap=True, markup=False)
        if data.attrs["lanes_that_failed"] != "{}":
            console.print(f"not integrated: {data.attrs['lanes_that_failed']}", soft_wrap=True, markup=False)
        say_attractors(console, data)
        if sentence:
            console.print(sentence, soft_wrap=True, markup=False)
        console.print(f"{' and '.join(files[:2])} in {shared.out}", soft_wrap=True, markup=False)
    console.print(f"{time.perf_counter() - begin:.1f} s in all, {loaded:.1f} s of them loading", markup=False)


def _swept(name: str, shared: Shared, followed: str | None, ranges: dict[str, tuple[float, float]]) -> tuple[dict[str, list[float]], str]:
    """Values along the axes, and what is swept."""
    axes, along = swept(name, shared.sweep or [], ranges)
    if followed is not None:
        along, listed = one_range("--along", followed)
        axes = {"values": listed} | axes
    return axes, along


def _ranges(preset: Any) -> dict[str, tuple[float, float]]:
    """What a preset's studies sweep by default; initial states reach from four gaps behind the hammer to the stop."""
    gap, frequency = preset.point["gap"] or preset["base_amplitude"], preset.point[FREQUENCY]
    reach = 8.0 * math.pi * gap * frequency
    return {**preset.ranges, "u0": (-4.0 * gap, gap), "v0": (-reach, reach)}


def _jobs(name: str, shared: Shared, rig: Rig, axes: dict[str, list[float]], settings: dict[str, Any]) -> list[tuple[str, Any]]:
    """The study for every combination of the values that it holds one at a time, with what that adds to the files' names."""
    from vibrojax.studies.job import Job

    varied = named("--vary", shared.vary or [])
    form, inside = FORMS[name], {}
    along = settings.get("parameter", "")
    fixed = _fixed(name, shared, rig, along, {canonical(option) for option in varied})
    for option, text in varied.items():
        key, listed = canonical(option), values("--vary", text)
        _check_varied(option, rig, fixed if key not in form.lists else {}, shared, along)
        if form.varied_inside and key not in _OPTION:
            inside[key] = listed
        else:
            fixed[key] = listed
    axes = axes | {key: fixed.pop(key) for key in form.lists if key in fixed}
    found = []
    for tail, one in cases(fixed):
        set_here = {key: value for key, value in one.items() if key in _OPTION}
        model = rig.model.replace({key: value for key, value in one.items() if key not in set_here})
        more = settings | set_here | ({"also": inside} if inside else {})
        found.append((tail, Job(study=name, model=model, axes=axes, settings=more, draws=rig.draws, points=shared.tile)))
    if len(found) > 1 and shared.store is not None:
        raise InputError(f"{len(found)} studies for one --store: expected one; give one value of each of {', '.join(fixed)}")
    return found


def _fixed(name: str, shared: Shared, rig: Rig, along: str, varied: set[str]) -> dict[str, list[float]]:
    """Values of A0, gap and frequency, as far as the study needs them and does not sweep them; none yet of those that `--vary` sets."""
    found: dict[str, list[float]] = {}
    for key, option in _OPTION.items():
        given = _given(shared)[key]
        if key == along or key not in (AMPLITUDE, *FORMS[name].settings):
            if given is not None:
                raise InputError(f"{option} is given, but {name} {'sweeps it' if key == along else 'does not take it'}: leave it out")
        elif given is not None:
            found[key] = values(option, given) if isinstance(given, str) else [given]
        elif key in varied:
            found[key] = []
        elif rig.preset is None:
            raise InputError(f"{option} is missing: expected it where {along or 'it'} is not swept; add {option} VALUE")
        elif key == "gap" and not name.startswith("basins"):
            found[key] = list(rig.preset.gaps)[: 1 if name in ("section", "design") else None]
        else:
            found[key] = [rig.preset["base_amplitude"] if key == AMPLITUDE else rig.preset.point[key]]
    return found


def _given(shared: Shared) -> dict[str, Any]:
    """What the options of `_OPTION` say."""
    return {AMPLITUDE: shared.base_amplitude, "gap": shared.gap, FREQUENCY: shared.frequency}


def _check_varied(name: str, rig: Rig, fixed: dict[str, list[float]], shared: Shared, along: str) -> None:
    """Refuse a name that is none, and one that is swept or set otherwise."""
    from vibrojax.model import MASS

    key, parameters = canonical(name), [MASS.name, *rig.model.values()]
    if key == along:
        raise InputError(f"--vary names {name!r}, which is swept: expected another parameter; leave it out")
    if key not in parameters and key not in fixed:
        raise InputError(f"--vary names {name!r}: expected one of {', '.join([*parameters, *fixed])}; correct it")
    if key in parameters and shared.fit is not None:
        raise InputError(f"--vary {name} is given with --fit, whose draws set the parameters: leave one out")
    if _given(shared).get(key) is not None:
        raise InputError(f"{name} is given twice, by --vary and by its own option: leave one out")


def _written(
    name: str, tail: str, job: Any, shared: Shared, folder: Path, begin: float, over: Over
) -> tuple[str, Any, str, list[str], str]:
    """One study, made and written; and the seconds of each stage."""
    from vibrojax.studies.finding import finding
    from vibrojax.studies.write import write_study

    compiled, start = seconds_compiling(), time.perf_counter()
    data = _made(job, shared, begin, _words(tail))
    made = time.perf_counter()
    with stages(quiet=shared.quiet, since=begin) as say:
        data = over.drawn(data, job.model, say)
        say(f"drawing{_words(tail)}")
        files = write_study(name, data, folder, look=FIGURE_STYLES[shared.style], stem=name + tail)
    compiling, whole = min(seconds_compiling() - compiled, made - start), time.perf_counter() - start
    took = f", {compiling:.1f} s compiling, {made - start - compiling:.1f} s running, {start + whole - made:.1f} s drawing"
    return tail, data, finding(name, data), [path.name for path in files], took


def _words(tail: str) -> str:
    """What tells a study from the others of one call."""
    return f", {tail[1:]}" if tail else ""


def _made(job: Any, shared: Shared, begin: float, words: str) -> Any:
    """The study; one that is made at once has no points to count on the way."""
    from vibrojax.studies.run import make

    if shared.store is None and job.draws is None:
        with stages(quiet=shared.quiet, since=begin) as say:
            say(f"integrating{words}")
            return make(job)
    with connected(shared.cluster) as client, points_done(job.lanes, quiet=shared.quiet) as progress:
        return make(job, store=shared.store, client=client, progress=progress, notice=lambda text: typer.echo(text, err=True))


def _rig(shared: Shared) -> Rig:
    """The model, the draws of the fit where one is given, and the preset where one is named."""
    from vibrojax.model_file import read_model
    from vibrojax.presets import read_preset
    from vibrojax.studies.draws import read_fit

    if shared.preset is not None:
        preset = read_preset(shared.preset)
        return Rig(preset.model(), None, preset)
    if shared.fit is None:
        return Rig(read_model(shared.model or Path()), None, None)
    fit = read_fit(shared.fit)
    return Rig(fit.model, fit.draw(_DRAWS if shared.draws is None else shared.draws, seed=shared.seed), None)


_MOST = 12
"""Rows of the table."""
_MEASURES = {
    "basin_entropy": "basin entropy S_b",
    "boundary_basin_entropy": "boundary basin entropy S_bb",
    "uncertainty_exponent": "uncertainty exponent",
    "boundary_dimension": "dimension of the boundary",
}


def say_attractors(console: Console, data: Any) -> None:
    """The attractors and the measures of their basins; nothing for other studies."""
    if "attractors" in data.attrs and "share" not in data:
        console.print(_table(json.loads(data.attrs["attractors"])))
        known = [f"{text} {data.attrs[name]:.3g}" for name, text in _MEASURES.items() if math.isfinite(data.attrs.get(name, math.nan))]
        if known:
            console.print(", ".join(known), soft_wrap=True)


def _table(rows: list[dict[str, Any]]) -> Table:
    """One row an attractor."""
    from vibrojax.studies.finding import bears

    table = Table("attractor", "share (95 %)", "section u (mm), u' (m/s)", "bears at the strobe", "largest disc (mm)", "exponent")
    for one in rows[:_MOST]:
        low, high = one["share_ci95"]
        u, v = one["section"]["u"][0], one["section"]["v"][0]
        place = f"{1e3 * u:.4g}, {v:.4g}" if one["period"] else ""
        room, growth = one.get("integrity"), one["lyapunov"]
        table.add_row(
            one["name"],
            f"{100 * one['share']:.2f} % ({100 * low:.2f} to {100 * high:.2f})",
            place,
            "" if room is None else bears(one) or "outside the ranges",
            "" if room is None else f"{1e3 * room['largest_disc']:.3g}",
            "" if growth is None else f"{growth:.3g}",
        )
    return table
