"""Awkward experiments with a complete model: carts that were not recorded, weak impacts, records of different rates, no load cell."""

import dataclasses
from pathlib import Path

import numpy as np

from benchmarks.simulator import KINDS, Rig, draw_plan, draw_rig, simulate, standard_sensors
from benchmarks.simulator.experiment import RecordPlan
from benchmarks.simulator.folder import settings, write_table

_SERIES = 32_001
"""First word of every seed here: no other simulated experiment is drawn with it."""
_WEAK_RELEASE = (-0.8e-3, -0.3e-3)
"""Where the hammer of a drop test is let go, m: its impacts are a tenth as strong as usual."""
_EVERY = (1, 2, 4)
"""Intervals of the recorded samples, in steps of the simulator's recorder: 4, 2 and 1 kHz."""
_SAMPLES = (4001, 8001)
"""Of the drop test and of each other record, before some are left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """One experiment; soft and stiff rigs in turn."""

    seed: int
    """Of all experiments."""
    index: int
    samples: tuple[int, int] = _SAMPLES

    @property
    def key(self) -> str:
        """Its name among all."""
        return f"{self.seed}-{self.index:03d}"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Awkward:
    """What was drawn."""

    rig: Rig
    plans: tuple[RecordPlan, ...]
    unseen: tuple[str, ...]
    """Files of the records whose cart was not recorded."""
    every: tuple[int, ...]
    """Interval of each record's samples, in steps of the simulator's recorder."""
    accelerometer: bool

    def numbers(self) -> dict:
        """What is awkward, as plain data."""
        return {"unseen": list(self.unseen), "every": list(self.every), "accelerometer": self.accelerometer}


def write_awkward(folder: Path, job: Job) -> Awkward:
    """Simulate a drop test with weak impacts and two records of a driven cart, at different rates and without a load cell, into `folder`.

    The cart of the last record, or of both, was not recorded; half of these records begin with the hammer at rest, so that its first
    impacts are weak. Every other pair of experiments has an accelerometer.
    """
    rng = np.random.default_rng([_SERIES, job.seed, job.index])
    kind = list(KINDS)[job.index % len(KINDS)]
    rig = draw_rig(rng, kind)
    drop, *driven = draw_plan(rng, kind, rig.f_n, samples=job.samples)[:3]
    drop = dataclasses.replace(drop, release=rng.uniform(*_WEAK_RELEASE))
    plans = (drop, *(dataclasses.replace(one, transient=0, at_rest=True) if rng.random() < 0.5 else one for one in driven))
    unseen = tuple(one.file for one in (driven if rng.random() < 0.5 else driven[-1:]))
    every = tuple(int(rng.choice(_EVERY)) for _ in plans[:-1])
    every = (*every, int(rng.choice([one for one in _EVERY if one != every[-1]])))
    accelerometer = job.index // len(KINDS) % 2 == 1
    sensors = standard_sensors(force=False, acceleration=accelerometer)
    for plan, step in zip(plans, every, strict=True):
        seen = tuple(one for one in sensors if one.channel != "cart_displacement" or plan.file not in unseen)
        readings = simulate(rig, plan, seen, rng)
        write_table(folder / plan.file, {name: values[::step] for name, values in readings.items()}, seen)
    (folder / "experiment.toml").write_text(settings(job.key, rig, plans, sensors), encoding="utf-8")
    return Awkward(rig=rig, plans=plans, unseen=unseen, every=every, accelerometer=accelerometer)
