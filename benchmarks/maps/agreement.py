"""`python -m benchmarks.maps.agreement --side 100`: z by the fast path beside z by the switch model, cell by cell of a Peterka map.

The switch model of order eight (`Sampled(Switch())`) shares no step with the fast path. Away from chaos means: neither of the two sees an
aperiodic motion in the cell, or within a hundredth of the map's width and height of it (the eight neighbours on 100 x 100). There the kind
of motion, p and q have to be the same; borders between two z count like all other cells. From rest a chaotic transient may decide between
motions that coexist, and no two methods follow it alike: so each cell that differs is asked once more, by the fast path from where the
switch model ended. If it stays on the switch model's motion, both motions exist for both. The aim of 99.5 % is that of cells with the same
motion or both; the share of the first alone is printed too. The maps go into Zarr stores, so that the same command resumes.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from rich.console import Console

from benchmarks.machine import machine
from benchmarks.maps.cases import AMPLITUDE, MODEL, plane
from vibrojax.cli.environment import prepare_jax
from vibrojax.cli.progress import points_done
from vibrojax.studies.base import APERIODIC, FAILED, PERIODIC

AIM = 0.995
_SAMPLES = 400


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.maps.agreement", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--side", type=int, default=100, help="points a side; 100 is the whole benchmark, fewer a subset of it")
    parser.add_argument("--cycles", type=int, default=300, help="transient cycles")
    parser.add_argument("--tile", type=int, default=256, help="points that are made and stored at a time")
    parser.add_argument("--stores", type=Path, metavar="DIR", help="folder of the two stores; an unfinished run is resumed")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    parser.add_argument("--plot", type=Path, metavar="PNG", help="map with the cells that disagree")
    options = parser.parse_args()
    prepare_jax()
    maps = both_maps(options.side, options.cycles, stores=options.stores, tile=options.tile)
    found = compare(*maps)
    found["same_or_both"] = found["same"] + both_exist(*maps, options.cycles)
    found["share_same_or_both"] = found["same_or_both"] / max(found["away_from_chaos"], 1)
    size = f"{options.side} x {options.side}" + ("" if options.side == 100 else ", a subset of 100 x 100")
    console = Console()
    console.print(found)
    shares = f"the same motion in {100 * found['share']:.2f} %, the same or both in {100 * found['share_same_or_both']:.2f} %"
    console.print(f"map of {size}: {shares} of {found['away_from_chaos']} cells away from chaos", soft_wrap=True)
    if options.json is not None:
        report = found | {"map": size, "cycles": options.cycles, "aim": AIM, "machine": machine()}
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if options.plot is not None:
        draw(*maps, options.plot)
    sys.exit(0 if found["share_same_or_both"] >= AIM else 1)


def both_maps(side: int, cycles: int, *, stores: Path | None = None, tile: int | None = None) -> tuple[xr.Dataset, xr.Dataset]:
    """The same map by the fast path and by the switch model."""
    from vibrojax.batch import Sampled, Span
    from vibrojax.integrate import Switch
    from vibrojax.studies.job import Job
    from vibrojax.studies.run import make

    settings: dict[str, Any] = {"base_amplitude": AMPLITUDE, "span": Span(transient=cycles), "lyapunov_cycles": 0, "follow": False}
    found = []
    for name, more in (("fast", {}), ("switch", {"engine": Sampled(Switch(), samples=_SAMPLES)})):
        job = Job(study="peterka", model=MODEL, axes=plane(side), settings=settings | more, points=tile)
        if stores is not None:
            stores.mkdir(parents=True, exist_ok=True)
        with points_done(job.lanes, quiet=False) as progress:
            found.append(make(job, store=None if stores is None else stores / f"{name}-{side}.zarr", progress=progress))
    return found[0], found[1]


def compare(ours: xr.Dataset, theirs: xr.Dataset) -> dict[str, Any]:
    """How many cells are away from chaos, in how many of those the motion is the same, and what the others are."""
    away, same = _away_from_chaos(ours, theirs), _same(ours, theirs)
    periodic = away & (ours["kind"].values == PERIODIC) & (theirs["kind"].values == PERIODIC)
    wrong = np.argwhere(away & ~same)
    return {
        "cells": int(away.size),
        "away_from_chaos": int(away.sum()),
        "same": int((away & same).sum()),
        "share": float((away & same).sum() / max(away.sum(), 1)),
        "same_z_of_periodic": float((periodic & same).sum() / max(periodic.sum(), 1)),
        "aperiodic_in_both": int(((ours["kind"] == APERIODIC) & (theirs["kind"] == APERIODIC)).sum()),
        "aperiodic_in_one": int(((ours["kind"] == APERIODIC) != (theirs["kind"] == APERIODIC)).sum()),
        "disagreements": [
            {name: round(float(ours[name][place]), 4) for name, place in (("clearance", int(i)), ("ratio", int(j)))}
            | {"fast": _motion(ours, i, j), "switch": _motion(theirs, i, j)}
            for i, j in wrong
        ],
    }


def both_exist(ours: xr.Dataset, theirs: xr.Dataset, cycles: int) -> int:
    """In how many of the cells that differ the fast path stays on the switch model's motion when it starts there."""
    from vibrojax.batch import Points, Sampled, Span, integrate
    from vibrojax.integrate import Switch
    from vibrojax.studies.base import classify, natural_frequency

    wrong = np.argwhere(_away_from_chaos(ours, theirs) & ~_same(ours, theirs))
    if wrong.size == 0:
        return 0
    frequency = ours["ratio"].values[wrong[:, 1]] * natural_frequency(MODEL, "a map")
    gap = ours["clearance"].values[wrong[:, 0]] * AMPLITUDE
    values = {"frequency_hz": frequency, "gap": gap, "base_amplitude": AMPLITUDE}
    points, span = Points(coords={"cell": np.arange(float(len(wrong)))}, values=values), Span(transient=cycles)
    ended = integrate(MODEL, points, span=span, engine=Sampled(Switch(), samples=_SAMPLES)).state
    again = classify(integrate(MODEL, points, span=span, start=ended), AMPLITUDE, frequency)
    there = [theirs[name].values[wrong[:, 0], wrong[:, 1]] for name in ("kind", "impacts", "period")]
    z = (again.impacts == there[1]) & (again.period == there[2])
    return int(np.sum((again.kind == there[0]) & (z | (there[0] != PERIODIC))))


def draw(ours: xr.Dataset, theirs: xr.Dataset, path: Path) -> None:
    """The fast path's map; cells away from chaos in which the switch model says otherwise are circled."""
    from vibrojax.drawing import save, style
    from vibrojax.studies.figures import FIGURES

    wrong = np.argwhere(_away_from_chaos(ours, theirs) & ~_same(ours, theirs))
    with style():
        figure = FIGURES["peterka"](ours)
        x, y = ours["ratio"].values[wrong[:, 1]], ours["clearance"].values[wrong[:, 0]]
        left = figure.axes[0]
        left.plot(x, y, "o", mfc="none", mec="#ff0000", ms=7, mew=1.4)
        left.set_title(f"red circles: the switch model disagrees ({len(wrong)})", loc="left", fontsize=9)
        save(figure, path)


def _same(ours: xr.Dataset, theirs: xr.Dataset) -> np.ndarray:
    """Kind, p and q alike; a motion without impact has no p and q to compare, and what neither could integrate agrees in nothing."""
    kind = (ours["kind"].values == theirs["kind"].values) & (ours["kind"].values != FAILED)
    z = (ours["impacts"].values == theirs["impacts"].values) & (ours["period"].values == theirs["period"].values)
    return kind & (z | (ours["kind"].values != PERIODIC))


def _away_from_chaos(ours: xr.Dataset, theirs: xr.Dataset) -> np.ndarray:
    from scipy.ndimage import maximum_filter

    wild = (ours["kind"].values == APERIODIC) | (theirs["kind"].values == APERIODIC)
    return np.logical_not(maximum_filter(wild, size=2 * round(wild.shape[0] / 100) + 1, mode="nearest"))


def _motion(data: xr.Dataset, i: int, j: int) -> str:
    here = data.isel(clearance=i, ratio=j)
    return f"{int(here['impacts'])}/{int(here['period'])}" if here["kind"] == PERIODIC else f"kind {int(here['kind'])}"


if __name__ == "__main__":
    main()
