"""Writing an experiment folder, and beside it, never in it, the truth."""

import gzip
import json
from pathlib import Path

import numpy as np

from benchmarks.simulator import kernel
from benchmarks.simulator.experiment import RecordPlan, parameter_vector, simulate
from benchmarks.simulator.hidden import NOTHING, Hidden
from benchmarks.simulator.rig import SCATTERED, Rig
from benchmarks.simulator.sensors import Sensor


def write_experiment(
    folder: Path,
    rig: Rig,
    plans: tuple[RecordPlan, ...],
    sensors: tuple[Sensor, ...],
    rng: np.random.Generator,
    *,
    truth: Path | None,
    hidden: Hidden = NOTHING,
) -> None:
    """Simulate all records into `folder` with their `experiment.toml`, and write the true values to the file `truth` if given."""
    folder.mkdir(parents=True, exist_ok=True)
    for plan in plans:
        write_table(folder / plan.file, simulate(rig, plan, sensors, rng, hidden), sensors)
    (folder / "experiment.toml").write_text(settings(folder.name, rig, plans, sensors, law=hidden.law), encoding="utf-8")
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


def settings(name: str, rig: Rig, plans: tuple[RecordPlan, ...], sensors: tuple[Sensor, ...], *, law: str | None = None) -> str:
    """Text of `experiment.toml`."""
    lines = _head(name, rig, law)
    for sensor in sensors:
        lines += ["", f"[sensors.{sensor.channel}]", f'unit = "{sensor.unit}"', f"noise = {sensor.noise}"]
    for plan in plans:
        lines += _record(plan, plan.gap)
    return "\n".join(lines) + "\n"


def sealed_settings(name: str, rig: Rig, plans: tuple[RecordPlan, ...], hidden: Hidden, sensors: tuple[Sensor, ...]) -> str:
    """The same for noise-free records that begin at rest: true gap, base motion and initial state are stated."""
    lines = _head(name, rig, None)
    for sensor in sensors:
        lines += ["", f"[sensors.{sensor.channel}]", f'unit = "{sensor.unit}"', f"noise = {sensor.noise}"]
    for plan in plans:
        y, y1, _ = kernel.base_motion(0.0, parameter_vector(rig, plan, hidden))
        lines += _record(plan, plan.true_gap)
        lines += [f"base_amplitude = {rig.base_amplitude!r}", f"base_phase = {plan.base_phase!r}"]
        lines += [f"initial_displacement = {0.0 - float(y)!r}", f"initial_velocity = {0.0 - float(y1)!r}"]
    return "\n".join(lines) + "\n"


def _head(name: str, rig: Rig, law: str | None) -> list[str]:
    """All tables that are not about channels or records."""
    lines = ["schema = 1", "", "[experiment]", f'name = "{name}"', "", "[hammer]", f"mass = {rig.m:.17g}"]
    lines += ["", "[suspension]", 'kind = "linear"']
    return lines if law is None else [*lines, "", "[contact]", f'law = "{law}"']


def _record(plan: RecordPlan, gap: float) -> list[str]:
    """One record's table."""
    lines = ["", "[[record]]", f'file = "{plan.file}"', f'kind = "{plan.kind}"', f"gap = {gap}"]
    return [*lines, f"excitation_frequency = {plan.excitation_frequency}"] if plan.excitation_frequency > 0.0 else lines


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
            | ({name: plan.own_rig.fitted[name] for name in SCATTERED} if plan.own_rig else {})
            for plan in plans
        },
    }
