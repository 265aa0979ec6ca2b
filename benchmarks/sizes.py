"""`python -m benchmarks.sizes --json FILE`: what `fit-parameters` costs against the amount of data, from reading to the written page.

Each experiment is fitted in a fresh process with an empty compilation cache, then again with the cache that this has filled. The records,
but for those of the embedded example, are simulated (`benchmarks.simulator`) and complete, so that chi-square is known to be about 1.
"""

import argparse
import dataclasses
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.fit.command import cold_and_warm
from benchmarks.machine import machine
from benchmarks.simulator import RecordPlan, draw_rig, simulate, standard_sensors
from benchmarks.simulator.folder import settings, write_table
from benchmarks.simulator.rig import KINDS, Rig

_KIND = "soft"


class Records(NamedTuple):
    """Records of one length and rate: drop tests, then others with a driven cart."""

    drops: int
    driven: int
    seconds: float
    rate_hz: float


class Size(NamedTuple):
    """One experiment; None is the embedded example."""

    title: str
    records: tuple[Records, ...] | None
    aim_s: float | None
    """Wall time that was aimed at with two cores, s."""


SIZES = {
    "example": Size("embedded example", None, None),
    "four": Size("four of 3 s at 4 kHz", (Records(1, 3, 3.0, 4e3),), 8.0),
    "long": Size("one of 20 s and two of 3 s at 10 kHz", (Records(0, 1, 20.0, 1e4), Records(1, 1, 3.0, 1e4)), 30.0),
    "ten_minutes": Size("one of 10 minutes at 10 kHz", (Records(0, 1, 600.0, 1e4),), 120.0),
    "two_thousand": Size("2,000 of 0.5 s at 4 kHz", (Records(1000, 1000, 0.5, 4e3),), 120.0),
}


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    console, found = Console(width=120), {}
    table = Table("experiment", "samples recorded", "cold, s", "warm, s", "of processor, s", "peak memory, GB", "chi-square", "aim, s")
    with tempfile.TemporaryDirectory(prefix="sizes-") as name:
        for key in options.sizes:
            size = SIZES[key]
            folder = None if size.records is None else Path(name) / key
            samples = 0 if folder is None else write(folder, size.records or (), np.random.default_rng(options.seed))
            with console.status(size.title):
                cold, warm = cold_and_warm(folder, repeats=options.repeats)
            found[key] = {"samples": samples, "cold": dataclasses.asdict(cold), "warm": dataclasses.asdict(warm)}
            row = (size.title, samples or "", f"{cold.seconds:.1f}", f"{warm.seconds:.1f}", f"{warm.processor_seconds:.1f}")
            peak = max(cold.peak_mb, warm.peak_mb) / 1e3
            table.add_row(*map(str, row), f"{peak:.2f}", f"{warm.chi_square:.3f}", "" if size.aim_s is None else f"{size.aim_s:g}")
            options.json.write_text(json.dumps({"sizes": found, "machine": machine()}, indent=1) + "\n", encoding="utf-8")
    console.print(table)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.sizes", description=(__doc__ or "").splitlines()[0])
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--sizes", nargs="+", choices=list(SIZES), default=list(SIZES), help="which experiments")
    made.add_argument("--repeats", type=int, default=1, help="warm runs, of which the fastest counts")
    made.add_argument("--seed", type=int, default=0, help="of rig, settings and noise")
    return made


def write(folder: Path, records: tuple[Records, ...], rng: np.random.Generator) -> int:
    """Simulate an experiment into `folder`; returns how many samples its records have together."""
    folder.mkdir(parents=True)
    rig, sensors = draw_rig(rng, _KIND), standard_sensors()
    plans, samples = [], 0
    for plan, rate_hz in _plans(rig, records, rng):
        write_table(folder / plan.file, simulate(rig, plan, sensors, rng, dt=1.0 / rate_hz), sensors)
        plans.append(plan)
        samples += plan.samples
    (folder / "experiment.toml").write_text(settings(folder.name, rig, tuple(plans), sensors), encoding="utf-8")
    return samples


def _plans(rig: Rig, records: tuple[Records, ...], rng: np.random.Generator) -> Iterator[tuple[RecordPlan, float]]:
    """What is recorded, and at which rate; every motion begins with its record."""
    family = KINDS[_KIND]
    for part, (drops, driven, seconds, rate_hz) in enumerate(records):
        samples = round(seconds * rate_hz)
        for number in range(drops):
            file, release = f"drop{part}_{number:04d}.csv", rng.uniform(-3.3e-3, -2.75e-3)
            yield RecordPlan(file=file, kind="drop-test", gap=0.0, true_gap=0.0, samples=samples, release=release), rate_hz
        for number in range(driven):
            gap = float(rng.choice(family.gaps))
            frequency = 0.25 * round(4.0 * rig.f_n * float(rng.choice(family.frequency_ratios)))
            plan = RecordPlan(
                file=f"cart{part}_{number:04d}.csv",
                kind="cart-excitation",
                gap=gap,
                true_gap=gap,
                samples=samples,
                excitation_frequency=frequency,
                base_phase=rng.uniform(-np.pi, np.pi),
            )
            yield plan, rate_hz


if __name__ == "__main__":
    main()
