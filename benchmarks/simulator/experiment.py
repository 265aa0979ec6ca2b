"""From a rig to the records of one experiment: a drop test and three records with a driven cart."""

import dataclasses

import numpy as np

from benchmarks.simulator import kernel
from benchmarks.simulator.rig import KINDS, Rig
from benchmarks.simulator.sensors import Sensor

SAMPLING_STEP = 0.25e-3
"""s"""
_GAP_ERROR = 0.01e-3
"""Standard deviation of the operator's gap setting, m."""
_RELEASE = (-3.3e-3, -2.75e-3)
"""Where the hammer of a drop test is let go, m."""
_FREQUENCY_STEP = 0.25
"""Resolution of the drive, Hz."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RecordPlan:
    """One record: what the operator wrote down, and what was really so."""

    file: str
    kind: str
    gap: float
    """As set, m."""
    true_gap: float
    samples: int
    excitation_frequency: float = 0.0
    """Hz; 0 for a cart at rest."""
    base_phase: float = 0.0
    """rad, at the record's first sample."""
    release: float = 0.0
    """Hammer position at the start of the motion, m, at the speed of the cart."""
    transient: int = 0
    """Samples of motion before the record begins."""


def draw_plan(rng: np.random.Generator, kind: str, f_n: float, *, suffix: str = ".csv", samples: tuple[int, int] = (6001, 12001)):
    """Random settings of the four records of a rig of this kind; `samples` of the drop test and of each other record."""
    family = KINDS[kind]
    plans = [_plan(rng, file=f"drop{suffix}", kind="drop-test", gap=0.0, samples=samples[0], release=rng.uniform(*_RELEASE))]
    ratios = rng.choice(family.frequency_ratios, 3, replace=False)
    for number, (gap, ratio) in enumerate(zip(family.gaps, ratios, strict=True), start=1):
        plans.append(
            _plan(
                rng,
                file=f"cart{number}{suffix}",
                kind="cart-excitation",
                gap=gap,
                samples=samples[1],
                excitation_frequency=float(_FREQUENCY_STEP * np.round(ratio * f_n / _FREQUENCY_STEP)),
                base_phase=rng.uniform(-np.pi, np.pi),
                transient=int(rng.uniform(3.0, 5.0) / SAMPLING_STEP),
            )
        )
    return tuple(plans)


def simulate(rig: Rig, plan: RecordPlan, sensors: tuple[Sensor, ...], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """One record: time in s and every sensor's reading in SI."""
    signals = true_signals(rig, plan)
    return {"time": signals["time"]} | {sensor.channel: sensor.read(signals[sensor.channel], rng) for sensor in sensors}


def true_signals(rig: Rig, plan: RecordPlan) -> dict[str, np.ndarray]:
    """Noise-free channels of one record, SI, and the hammer's velocity; time counts from the record's first sample."""
    p = parameter_vector(rig, plan)
    time = SAMPLING_STEP * np.arange(-plan.transient, plan.samples)
    base = np.array([kernel.base_motion(t, p) for t in time])
    initial = np.zeros(kernel.STATES)
    initial[:2] = plan.release + base[0, 0], base[0, 1]
    states, accelerations, forces = kernel.sampled(time[0], SAMPLING_STEP, len(time), initial, p)
    signals = {
        "time": time,
        "hammer_displacement": states[:, 0],
        "hammer_velocity": states[:, 1],
        "cart_displacement": base[:, 0],
        "cart_acceleration": base[:, 2],
        "hammer_acceleration": accelerations,
        "impact_force": forces,
    }
    return {name: signal[plan.transient :] for name, signal in signals.items()}


def parameter_vector(rig: Rig, plan: RecordPlan) -> np.ndarray:
    """Parameters of the kernel for one record."""
    driven = plan.excitation_frequency > 0.0
    values = {
        "m": rig.m,
        "c": rig.c,
        "k": rig.k,
        "k_i": rig.k_i,
        "n": rig.n,
        "lambda_i": rig.lambda_i,
        "gap": plan.true_gap,
        "base_amplitude": rig.base_amplitude if driven else 0.0,
        "omega_exc": 2.0 * np.pi * plan.excitation_frequency,
        "base_phase": plan.base_phase,
    }
    return np.array([values[name] for name in kernel.PARAMETERS])


def _plan(rng: np.random.Generator, *, gap: float, **settings) -> RecordPlan:
    """A record whose true gap differs from the set one as it does when set by hand."""
    return RecordPlan(gap=gap, true_gap=gap + rng.normal(0.0, _GAP_ERROR), **settings)
