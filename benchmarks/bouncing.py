"""A body that bounces on a rigid stop until it rests: restitution and random force from simulated records of three sampling rates.

    python -m benchmarks.bouncing --experiments 20 --json bouncing.json

The simulation is independent of the program: a free body on an incline flies exact parabolas between impacts and rests once a flight is
lower than 1e-12 m. Every experiment has two records with restitution, slope, heights and noise of its own.
"""

import json
import math
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

MASS, DURATION = 0.2, 3.0
"""kg; s, of a record."""
RATES = (20.0, 100.0, 1000.0)
"""Hz"""
GRAVITY = 9.80665
"""m/s^2"""
_LOWEST = 1e-12
"""m; a flight that is lower is rest."""


def bounced(times: np.ndarray, height: float, restitution: float, acceleration: float) -> np.ndarray:
    """u at given times, m, of a body that starts at rest `height` before a stop at 0 and is drawn towards it.

    Between impacts u = v t + a t^2 / 2 with v < 0 after an impact; the speed falls by the factor e at each.
    """
    touch = math.sqrt(2.0 * height / acceleration)
    u = np.where(times < touch, -height + 0.5 * acceleration * times**2, 0.0)
    speed = restitution * acceleration * touch
    while 0.5 * speed**2 / acceleration > _LOWEST and touch < times[-1]:
        flight = 2.0 * speed / acceleration
        t = times - touch
        u = np.where((t >= 0.0) & (t < flight), -speed * t + 0.5 * acceleration * t**2, u)
        touch, speed = touch + flight, restitution * speed
    return u


def experiment(seed: int, rate: float):
    """An experiment and its true restitution."""
    from identification.experiment import Experiment, Load, Record, Suspension

    rng = np.random.default_rng([seed, round(rate)])
    restitution, incline, noise = rng.uniform(0.6, 0.9), rng.uniform(0.02, 0.1), 10.0 ** rng.uniform(-4.3, -3.3)
    times = np.arange(round(DURATION * rate)) / rate
    records = []
    for index in range(2):
        u = bounced(times, rng.uniform(0.05, 0.15), restitution, GRAVITY * math.sin(incline))
        read = {"hammer_displacement": u + noise * rng.standard_normal(len(times))}
        noises = {"hammer_displacement": noise}
        records.append(Record(file=f"bounce-{index}.csv", kind="drop-test", gap=0.0, time=times, channels=read, noise=noises))
    made = Experiment(
        name="bouncing",
        folder=Path(),
        sha256="",
        mass=MASS,
        suspension=Suspension(kind="free"),
        law="newton",
        load=Load(incline=incline, constant_force=0.0),
        records=tuple(records),
    )
    return made, restitution


def fitted(seed: int, rate: float) -> dict:
    """One experiment; a failure is a result too."""
    from identification.trajectory.fit import fit
    from identification.trajectory.start import problem_of

    before, (made, restitution) = time.perf_counter(), experiment(seed, rate)
    known = {"rate_hz": rate, "seed": seed, "restitution": restitution, "noise": next(iter(made.records[0].noise.values()))}
    try:
        problem = problem_of(made)
        found = fit(problem)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted
        return known | {"failure": f"{type(error).__name__}: {error}"}
    value, stderr = problem.values(found.at)["e"], float(found.stderr[0])
    return known | {
        "converged": found.converged,
        "rounds": found.rounds,
        "seconds": time.perf_counter() - before,
        "start": problem.values(problem.start)["e"],
        "found": value,
        "stderr": stderr,
        "sigmas": (value - restitution) / stderr,
        "force_share": found.variances.force.std / problem.scales.force,
        "reading": found.variances.readings[0].std,
    }


def main(
    experiments: Annotated[int, typer.Option(help="Experiments at each rate.")] = 20,
    json_file: Annotated[Path | None, typer.Option("--json", help="File for the result.")] = None,
) -> None:
    """Fit simulated bounces at every rate."""
    prepare_jax()
    table, found, console = Table("Hz", "converged", "rms, standard errors", "largest", "largest force", "s"), [], Console(highlight=False)
    for rate in RATES:
        rows = [fitted(seed, rate) for seed in range(experiments)]
        found += rows
        done = [row for row in rows if row.get("converged")]
        sigmas = np.array([row["sigmas"] for row in done])
        for row in rows:
            if not row.get("converged") or abs(row["sigmas"]) > 3.0:
                console.print(row)
        if not done:
            table.add_row(f"{rate:g}", f"0 of {len(rows)}")
            continue
        table.add_row(
            f"{rate:g}",
            f"{len(done)} of {len(rows)}",
            f"{np.sqrt(np.mean(sigmas**2)):.2f}",
            f"{np.abs(sigmas).max():.2f}",
            f"{max(row['force_share'] for row in done):.1e}",
            f"{np.median([row['seconds'] for row in done]):.1f}",
        )
    console.print(table)
    if json_file is not None:
        json_file.write_text(json.dumps({"machine": machine(), "fits": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
