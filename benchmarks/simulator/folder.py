"""Writing an experiment folder, and beside it, never in it, the truth."""

import gzip
import json
from pathlib import Path

import numpy as np

from benchmarks.simulator.experiment import RecordPlan, simulate
from benchmarks.simulator.rig import Rig
from benchmarks.simulator.sensors import Sensor


def write_experiment(
    folder: Path, rig: Rig, plans: tuple[RecordPlan, ...], sensors: tuple[Sensor, ...], rng: np.random.Generator, *, truth: Path | None
) -> None:
    """Simulate all records into `folder` with their `experiment.toml`, and write the true values to the file `truth` if given."""
    folder.mkdir(parents=True, exist_ok=True)
    for plan in plans:
        write_table(folder / plan.file, simulate(rig, plan, sensors, rng), sensors)
    (folder / "experiment.toml").write_text(settings(folder.name, rig, plans, sensors), encoding="utf-8")
    if truth is not None:
        truth.write_text(json.dumps(true_values(rig, plans), indent=1) + "\n", encoding="utf-8")


def write_table(path: Path, channels: dict[str, np.ndarray], sensors: tuple[Sensor, ...]) -> None:
    """One record as comma-separated values, compressed if the name ends in .gz; the same numbers give the same bytes."""
    columns = [("time", channels["time"], "%.5f")]
    columns += [(s.channel, s.per_si * channels[s.channel] + 0.0, f"%.{s.digits}g") for s in sensors]
    header = ",".join(name for name, _, _ in columns)
    row = ",".join(form for _, _, form in columns)
    lines = [row % values for values in zip(*(column.tolist() for _, column, _ in columns), strict=True)]
    text = ("\n".join([header, *lines]) + "\n").encode("ascii")
    path.write_bytes(gzip.compress(text, 9, mtime=0) if path.suffix == ".gz" else text)


def settings(name: str, rig: Rig, plans: tuple[RecordPlan, ...], sensors: tuple[Sensor, ...]) -> str:
    """Text of `experiment.toml`."""
    lines = [
        "schema = 1",
        "",
        "[experiment]",
        f'name = "{name}"',
        "",
        "[hammer]",
        f"mass = {rig.m:.17g}",
        "",
        "[suspension]",
        'kind = "linear"',
    ]
    for sensor in sensors:
        lines += ["", f"[sensors.{sensor.channel}]", f'unit = "{sensor.unit}"', f"noise = {sensor.noise}"]
    for plan in plans:
        lines += ["", "[[record]]", f'file = "{plan.file}"', f'kind = "{plan.kind}"', f"gap = {plan.gap}"]
        if plan.excitation_frequency > 0.0:
            lines.append(f"excitation_frequency = {plan.excitation_frequency}")
    return "\n".join(lines) + "\n"


def true_values(rig: Rig, plans: tuple[RecordPlan, ...]) -> dict:
    """What a fit should find."""
    return {
        "parameters": rig.fitted,
        "records": {
            plan.file: {
                "gap_error": plan.true_gap - plan.gap,
                "base_amplitude": rig.base_amplitude if plan.excitation_frequency > 0.0 else 0.0,
                "base_phase": plan.base_phase,
            }
            for plan in plans
        },
    }
