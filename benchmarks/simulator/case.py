"""A case: one experiment with concealed effects, its truth, and sealed records of other operating points to score predictions."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.simulator.effects import EFFECTS, Setting
from benchmarks.simulator.experiment import RecordPlan, draw_plan, sealed_plans, true_signals
from benchmarks.simulator.folder import sealed_settings, true_values, write_experiment, write_table
from benchmarks.simulator.hidden import Hidden, together
from benchmarks.simulator.rig import Rig, draw_rig
from benchmarks.simulator.sensors import Sensor, standard_sensors
from benchmarks.simulator.unrest import Unrest, with_unrest

WITHOUT: Mapping[str, tuple[str, ...]] = {
    "all": (),
    "no load cell": ("impact_force",),
    "no accelerometer": ("hammer_acceleration",),
    "displacements": ("impact_force", "hammer_acceleration"),
}
"""Channels left out, by the name of what is kept."""
SAMPLES = (6001, 12001)
"""Of the drop test and of each other record."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Order:
    """What the caller wants of a case; all else is drawn."""

    kind: str
    effects: tuple[tuple[str, float], ...] = ()
    """Names of `EFFECTS` and their strengths."""
    noise: float = 1.0
    """Factor on every sensor's noise, which the experiment declares."""
    channels: str = "all"
    """A name in `WITHOUT`."""
    driven: int = 3
    """Records with a moving cart."""
    samples: tuple[int, int] = SAMPLES
    unrest: tuple[str, ...] = ()
    """Names in `unrest.UNREST`, which the experiment does not declare; the sealed records have none of it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Case:
    """Everything about one case."""

    order: Order
    rig: Rig
    plans: tuple[RecordPlan, ...]
    sealed: tuple[RecordPlan, ...]
    sensors: tuple[Sensor, ...]
    parts: tuple[Hidden, ...]
    """What each effect is, in the order's order."""
    unrest: Unrest

    @property
    def hidden(self) -> Hidden:
        """All effects together."""
        return together(self.parts)


def draw_case(rng: np.random.Generator, order: Order) -> Case:
    """A random rig and settings, with the effects of the order."""
    rig = draw_rig(rng, order.kind)
    planned = draw_plan(rng, order.kind, rig.f_n, samples=order.samples)
    plans = planned[: 1 + order.driven]
    left_out = WITHOUT[order.channels]
    chosen = standard_sensors(force="impact_force" not in left_out, acceleration="hammer_acceleration" not in left_out)
    sensors = tuple(dataclasses.replace(sensor, noise=order.noise * sensor.noise) for sensor in chosen)
    sealed = sealed_plans(rng, order.kind, rig.f_n, planned, samples=order.samples[1])
    setting = Setting(rig, plans, tuple(sensor.channel for sensor in sensors), sealed)
    for name, _ in order.effects:
        if missing := EFFECTS[name].needs - set(setting.channels):
            raise ValueError(f"{name} cannot be seen without {', '.join(sorted(missing))}: keep that channel, or choose another effect")
    parts = tuple(EFFECTS[name].draw(rng, setting, strength) for name, strength in order.effects)
    unrest, plans, sensors = with_unrest(rng, order.unrest, rig, plans, sensors)
    return Case(order=order, rig=rig, plans=plans, sealed=sealed, sensors=sensors, parts=parts, unrest=unrest)


def write_case(folder: Path, case: Case, rng: np.random.Generator) -> Path:
    """Write the experiment into `folder`; sealed records and truth go beside it, into `folder` + ".sealed", which is returned."""
    write_experiment(folder, case.rig, case.plans, case.sensors, rng, truth=None, hidden=case.hidden)
    sealed = folder.with_name(f"{folder.name}.sealed")
    sealed.mkdir(parents=True, exist_ok=True)
    all_channels = tuple(dataclasses.replace(sensor, digits=9) for sensor in standard_sensors())
    motion = Hidden(motion=case.hidden.motion)
    for plan in case.sealed:
        write_table(sealed / plan.file, true_signals(case.rig, plan, motion), all_channels)
    (sealed / "experiment.toml").write_text(sealed_settings(folder.name, case.rig, case.sealed, motion, all_channels), encoding="utf-8")
    (sealed / "truth.json").write_text(json.dumps(truth(case), indent=1) + "\n", encoding="utf-8")
    return sealed


def truth(case: Case) -> dict:
    """What is concealed, as plain data."""
    effects = [
        {"name": name, "strength": strength} | part.numbers() for (name, strength), part in zip(case.order.effects, case.parts, strict=True)
    ]
    order = {name: getattr(case.order, name) for name in ("kind", "noise", "channels", "driven")} | case.unrest.numbers()
    nominal = {name: getattr(case.rig, name) for name in ("m", "c", "k", "k_i", "n", "lambda_i")}
    return {"effects": effects, "where": where(case), **order, "nominal": nominal} | true_values(case.rig, case.plans)


def where(case: Case) -> dict | None:
    """Record and time of an effect that begins at an instant."""
    for file, numbers in case.hidden.records.items():
        if "jump_time" in numbers:
            return {"record": file, "time": numbers["jump_time"]}
    return None
