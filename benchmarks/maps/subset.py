"""`python -m benchmarks.maps.subset --sides 100 200 400`: a Peterka map from continued orbits beside plain iteration at random cells.

Away from chaos means what it means in `benchmarks.maps.agreement`: no aperiodic motion in the cell, by either, or within a hundredth of the
map's width and height of it, by the map. There kind, p and q have to be the same; "same or both" counts cells where iteration ends on an
orbit that the map names beside its own, too. Every map is timed, and so is the iteration of the same map's cells, by wall clock and by the
processor time of the process, which other jobs on the machine disturb less.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from rich.console import Console
from scipy.ndimage import maximum_filter

from benchmarks.machine import machine
from benchmarks.maps.cases import AMPLITUDE, MODEL, plane
from vibrojax.cli.environment import prepare_jax
from vibrojax.studies.base import APERIODIC, NO_IMPACT, PERIODIC


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.maps.subset", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sides", type=int, nargs="*", default=[100, 200, 400], help="points a side")
    parser.add_argument("--sample", type=int, default=4000, help="cells that are iterated")
    parser.add_argument("--cycles", type=int, default=300, help="transient cycles of the iteration")
    parser.add_argument("--seed", type=int, default=0, help="of the cells")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    options = parser.parse_args()
    prepare_jax()
    console, rows = Console(), []
    made(16, options.cycles)
    iterated(made(16, options.cycles)[0], np.arange(64), options.cycles)
    for side in options.sides:
        data, wall, processor = made(side, options.cycles)
        cells = np.sort(np.random.default_rng(options.seed).choice(side**2, min(options.sample, side**2), replace=False))
        motion, wall_each, processor_each = iterated(data, cells, options.cycles)
        costs = {"seconds": wall, "processor_seconds": processor}
        costs |= {f"{name}_of_iteration": each * side**2 for name, each in zip(costs, (wall_each, processor_each), strict=True)}
        rows.append({"side": side, **costs, **compared(data, cells, motion)})
        console.print(rows[-1])
    if options.json is not None:
        options.json.write_text(json.dumps({"maps": rows, "machine": machine()}, indent=1) + "\n", encoding="utf-8")


def made(side: int, cycles: int) -> tuple[xr.Dataset, float, float]:
    """The map, and its seconds by wall clock and processor."""
    from vibrojax.batch import Span
    from vibrojax.studies import peterka

    wall, processor = time.perf_counter(), time.process_time()
    axes = plane(side)
    data = peterka(MODEL, clearance=axes["clearance"], ratio=axes["ratio"], base_amplitude=AMPLITUDE, span=Span(transient=cycles))
    return data, time.perf_counter() - wall, time.process_time() - processor


def iterated(data: xr.Dataset, cells: np.ndarray, cycles: int) -> tuple[np.ndarray, float, float]:
    """Codes of the motions by iteration from rest: 1000 p + q, 0 without impacts, -1 aperiodic; and seconds a cell, exponents left out."""
    from vibrojax.batch import Points, Span, integrate
    from vibrojax.studies.base import classify, natural_frequency

    row, column = np.divmod(cells, data.sizes["ratio"])
    frequency = data["ratio"].values[column] * natural_frequency(MODEL, "a map")
    values = {"frequency_hz": frequency, "gap": data["clearance"].values[row] * AMPLITUDE, "base_amplitude": AMPLITUDE}
    wall, processor = time.perf_counter(), time.process_time()
    found = integrate(MODEL, Points(coords={"cell": cells.astype(float)}, values=values), span=Span(transient=cycles))
    seconds = time.perf_counter() - wall, time.process_time() - processor
    return codes(*classify(found, AMPLITUDE, frequency)), seconds[0] / cells.size, seconds[1] / cells.size


def codes(kind: np.ndarray, impacts: np.ndarray, period: np.ndarray) -> np.ndarray:
    """One number for each motion."""
    return np.where(kind == PERIODIC, 1000 * impacts + period, np.where(kind == NO_IMPACT, 0, -1))


def compared(data: xr.Dataset, cells: np.ndarray, motion: np.ndarray) -> dict[str, Any]:
    """In what part of the cells away from chaos the map says the same, or names the motion beside its own."""
    wild = data["kind"].values == APERIODIC
    near = np.asarray(maximum_filter(wild, size=2 * round(wild.shape[0] / 100) + 1, mode="nearest"))
    away = np.logical_not(near.ravel()[cells]) & (motion != -1)
    own = codes(*(data[name].values for name in ("kind", "impacts", "period"))).ravel()[cells]
    beside = (data["other_code"].values.reshape(wild.size, -1)[cells] == motion[:, None]).any(axis=1)
    same = own == motion
    return {
        "cells": int(cells.size),
        "away_from_chaos": int(away.sum()),
        "share_same": float(same[away].mean()),
        "share_same_or_both": float((same | beside)[away].mean()),
        "aperiodic_by_iteration_periodic_in_the_map": int(((motion == -1) & (own != -1)).sum()),
        "periodic_by_iteration_aperiodic_in_the_map": int(((motion != -1) & (own == -1)).sum()),
    }


if __name__ == "__main__":
    main()
