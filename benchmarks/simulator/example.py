"""The embedded example: the records of `data/example`."""

import dataclasses
from pathlib import Path

import numpy as np

from benchmarks.simulator.experiment import RecordPlan, simulate
from benchmarks.simulator.folder import write_table
from benchmarks.simulator.rig import Rig
from benchmarks.simulator.sensors import standard_sensors

FOLDER = Path(__file__).resolve().parents[2] / "data" / "example"
RIG = Rig(m=0.431, f_n=5.2, zeta=0.012, k_i=3.0e6, n=1.5, lambda_i=0.35, base_amplitude=1.5e-3)
PLANS = (
    RecordPlan(file="drop.csv.gz", kind="drop-test", gap=0.0, true_gap=0.006e-3, samples=6001, release=-3.0e-3),
    RecordPlan(
        file="cart1.csv.gz",
        kind="cart-excitation",
        gap=0.5e-3,
        true_gap=0.511e-3,
        samples=12001,
        excitation_frequency=6.5,
        base_phase=0.4,
        transient=14_000,
    ),
    RecordPlan(
        file="cart2.csv.gz",
        kind="cart-excitation",
        gap=1.0e-3,
        true_gap=0.993e-3,
        samples=12001,
        excitation_frequency=8.25,
        base_phase=2.2,
        transient=17_000,
    ),
    RecordPlan(
        file="cart3.csv.gz",
        kind="cart-excitation",
        gap=0.5e-3,
        true_gap=0.496e-3,
        samples=12001,
        excitation_frequency=10.75,
        base_phase=-1.3,
        transient=20_000,
    ),
)
_SEED = 20_240_611
_G = 9.80665
"""m/s^2; the example's accelerometer is in g, its displacements in mm, to show that units are free."""
SENSORS = tuple(
    dataclasses.replace(sensor, **change)
    for sensor, change in zip(
        standard_sensors(),
        (
            {"unit": "mm", "per_si": 1e3, "full_scale": 0.05, "digits": 6},
            {"unit": "mm", "per_si": 1e3, "full_scale": 0.05, "digits": 6},
            {"full_scale": 500.0, "digits": 5},
            {"unit": "g", "per_si": 1.0 / _G, "full_scale": 50.0 * _G, "digits": 6},
        ),
        strict=True,
    )
)


def write_example(folder: Path = FOLDER) -> None:
    """Write the four records; `experiment.toml` beside them is kept by hand."""
    rng = np.random.default_rng(_SEED)
    for plan in PLANS:
        write_table(folder / plan.file, simulate(RIG, plan, SENSORS, rng), SENSORS)
