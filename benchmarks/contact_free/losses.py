"""`python -m benchmarks.contact_free.losses --count 20 --json FILE`: fitted losses beside the truth and the Cramer-Rao bound.

Each rig is observed by a camera, an encoder or a laser, with dry friction or quadratic drag. The program is asked for that loss and, where
the sensor has them, for the curved characteristic and the tone. It has to estimate the noise, the damping, f_n and the rest. The error that
it states stands beside the Cramer-Rao bound: that of an unbiased fit of whole records to which the noise, the sampling instants, the
frequency of the tone and the parts of the characteristic that are absent are known besides.
"""

import dataclasses
import json
import tempfile
import time
import zlib
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from scipy.signal import lfilter

from benchmarks.contact_free.seen import Seen, draw_seen, write_seen
from benchmarks.contact_free.sensors import SENSORS, coloured, prediction
from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

LOSSES = {"coulomb_friction": "friction_force", "quadratic_drag": "drag"}
"""Effects, and what the simulator calls their size."""
_SERIES = 61_009
"""First word of every seed."""
_STEP = 1e-4
"""Of difference quotients, over a parameter."""


def bound(seen: Seen, name: str) -> float:
    """Least standard error of a parameter of the loss: inverse of Fisher's information of all that the program estimates."""
    amplitude, errors = seen.sensor.amplitude, seen.errors
    levels = coloured(errors, 200_000, np.random.default_rng(0))
    noise = errors.size * amplitude * float(np.std(lfilter(prediction(errors), [1.0], levels)[10:]))

    def with_rig(**changes: float) -> Seen:
        parts = [{key: changes.get(key, value) for key, value in part.items()} for part in (seen.rig, seen.loss)]
        return dataclasses.replace(seen, rig=parts[0], loss=parts[1])

    information = 0.0
    shared = {"c": seen.rig["c"], "k": seen.rig["k"], name: seen.loss[name]}
    for record in range(len(seen.starts)):
        columns = []
        for key, value in shared.items():
            up, down = (with_rig(**{key: value * (1.0 + sign * _STEP)}).readings(record) for sign in (1.0, -1.0))
            columns.append((up - down) / (2.0 * _STEP * value))
        path, angle = seen.path(record) / amplitude, 2.0 * np.pi * errors.tone_frequency * seen.f_n * seen.instants[record]
        columns += [path**2] * bool(errors.square) + [path**3] * bool(errors.cube)
        own = [np.ones_like(path)]
        own += [np.sin(angle), np.cos(angle)] if errors.tone else []
        size = _STEP * amplitude
        moved = [
            dataclasses.replace(seen, starts=tuple(s + sign * size * (i == record) for i, s in enumerate(seen.starts))) for sign in (1, -1)
        ]
        own.append((moved[0].readings(record) - moved[1].readings(record)) / (2.0 * size))
        speed = 2.0 * np.pi * seen.f_n * size
        own.append((seen.readings(record, speed) - seen.readings(record, -speed)) / (2.0 * speed))
        rows = np.column_stack([lfilter(prediction(errors), [1.0], column) for column in (*columns, *own)]) / noise
        scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        gram = (rows / scale).T @ (rows / scale) + 1e-12 * np.eye(len(scale))
        a, b = slice(None, len(columns)), slice(len(columns), None)
        kept = gram[a, a] - gram[a, b] @ np.linalg.solve(gram[b, b], gram[b, a])
        information = information + kept * scale[a, None] * scale[None, a]
    unit = np.sqrt(np.diag(information))
    return float(np.sqrt(np.linalg.inv(information / unit / unit[:, None])[2, 2]) / unit[2])


def fitted(kind: str, loss: str, seed: int, index: int) -> dict:
    """One rig; a failure is a result too."""
    from identification.estimation.estimate import fit_experiment
    from identification.experiment import load_experiment

    rng = np.random.default_rng([_SERIES, zlib.crc32(f"{kind}-{loss}".encode("ascii")), seed, index])
    seen, name = draw_seen(kind, loss, rng), LOSSES[loss]
    effects = [loss] + ["nonlinear_reading"] * bool(seen.errors.square or seen.errors.cube) + ["reading_tone"] * bool(seen.errors.tone)
    row = {"kind": kind, "loss": loss, "index": index, "effects": effects, "truth": seen.loss[name], "bound": bound(seen, name)}
    before = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        write_seen(Path(folder), f"{kind}-{index}", seen, rng)
        try:
            result = fit_experiment(load_experiment(Path(folder)), effects=effects)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted
            return row | {"failure": f"{type(error).__name__}: {error}"}
    size = next(p for p in result.parameters if p.spec.name in (f"{loss}.friction_force", f"{loss}.drag_coefficient"))
    found = {"value": size.value, "stderr": size.stderr, "converged": result.converged, "seconds": time.perf_counter() - before}
    if not size.stderr:
        return row | found | {"failure": f"no standard error: {size.status}"}
    return row | found | {"z": (size.value - row["truth"]) / size.stderr, "over_bound": size.stderr / row["bound"]}


def main(
    count: Annotated[int, typer.Option(help="Rigs with each loss; cameras, encoders and lasers in turn.")] = 20,
    seed: Annotated[int, typer.Option(help="Of the rigs.")] = 0,
    json_file: Annotated[Path | None, typer.Option("--json", help="File for the result.")] = None,
) -> None:
    """Fit the losses of rigs without a stop."""
    prepare_jax()
    kinds, console = list(SENSORS), Console(highlight=False)
    rows = []
    for loss in LOSSES:
        for index in range(count):
            rows.append(fitted(kinds[index % len(kinds)], loss, seed, index))
            row = rows[-1]
            said = row.get("failure") or f"z {row['z']:+.1f}, error {row['over_bound']:.2f} of the bound, {row['seconds']:.0f} s"
            console.print(f"{row['kind']} {' '.join(row['effects'])}: {said}", markup=False)
    table = Table("loss", "rigs", "within 2 standard errors", "error at most twice the bound", "rms z", "median error over bound")
    for loss in LOSSES:
        mine = [row for row in rows if row["loss"] == loss and "z" in row]
        z, ratio = np.array([row["z"] for row in mine]), np.array([row["over_bound"] for row in mine])
        cells = (int((np.abs(z) < 2).sum()), int((ratio < 2).sum()), f"{np.sqrt(np.mean(z**2)):.2f}", f"{np.median(ratio):.2f}")
        table.add_row(loss, str(count), *map(str, cells))
    console.print(table)
    if json_file is not None:
        json_file.write_text(json.dumps({"machine": machine(), "seed": seed, "rigs": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
