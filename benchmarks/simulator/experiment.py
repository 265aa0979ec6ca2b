"""From a rig to the records of one experiment: a drop test and up to three records with a driven cart."""

import dataclasses

import numpy as np

from benchmarks.simulator import kernel
from benchmarks.simulator.faults import ClockRate, Delay, ceiling
from benchmarks.simulator.hidden import NOTHING, Hidden
from benchmarks.simulator.random_force import RandomForce
from benchmarks.simulator.rig import KINDS, Rig
from benchmarks.simulator.sensors import SAMPLING_STEP, Sensor

_ROOM = 0.1
"""The hammer may go so far, m."""
_AFTER = 20
"""Samples of motion after the record's end, for channels that are early."""
_FINER = 8
"""Steps of the motion in a sample of a channel that is late."""
_MEMORY = [kernel.BW_FORCE, kernel.STOP_MASS, kernel.CART_MASS, kernel.MODE_MASS, kernel.WEAR]
"""Parameters of effects with states of their own."""
_GAP_ERROR = 0.01e-3
"""Standard deviation of the operator's gap setting, m."""
_RELEASE = (-3.3e-3, -2.75e-3)
"""Where the hammer of a drop test is let go, m."""
_FREQUENCY_STEP = 0.25
"""Resolution of the drive, Hz."""
_FORCE_STEP = SAMPLING_STEP / kernel.COARSE
"""s; a random force is linear in between, and no step of the integration is longer."""


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
    at_rest: bool = False
    """Whether the hammer stands still in the room at the start of the motion, at zero, instead of moving with the cart."""
    random_force: RandomForce | None = None
    """On the hammer."""
    own_rig: Rig | None = None
    """What the rig is in this record, where it scatters between records."""


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
                excitation_frequency=_frequency(ratio, f_n),
                base_phase=rng.uniform(-np.pi, np.pi),
                transient=int(rng.uniform(3.0, 5.0) / SAMPLING_STEP),
            )
        )
    return tuple(plans)


def sealed_plans(
    rng: np.random.Generator, kind: str, f_n: float, plans: tuple[RecordPlan, ...], *, samples: int = 12001
) -> tuple[RecordPlan, ...]:
    """Two more records at frequencies that no record of `plans` has: all at rest at t = 0, where the cart's sine starts at once."""
    family = KINDS[kind]
    used = {plan.excitation_frequency for plan in plans}
    choice = sorted({_frequency(ratio, f_n) for ratio in family.frequency_ratios} - used)
    frequencies = rng.choice(choice, 2, replace=False)
    return tuple(
        _plan(
            rng,
            file=f"cart{number}.csv",
            kind="cart-excitation",
            gap=gap,
            samples=samples,
            excitation_frequency=float(frequency),
            at_rest=True,
        )
        for number, gap, frequency in zip((4, 5), family.gaps[1::-1], frequencies, strict=True)
    )


def simulate(
    rig: Rig,
    plan: RecordPlan,
    sensors: tuple[Sensor, ...],
    rng: np.random.Generator,
    hidden: Hidden = NOTHING,
    *,
    dt: float = SAMPLING_STEP,
) -> dict[str, np.ndarray]:
    """One record: time in s and every sensor's reading in SI, every `dt` s."""
    recorded = slice(plan.transient, plan.transient + plan.samples)
    signals = motion(rig, plan, hidden, dt=dt)
    readings = {"time": signals["time"][recorded]}
    for sensor in sensors:
        faults = [fault for fault in hidden.faults if fault.channel == sensor.channel]
        is_late = any(isinstance(fault, Delay | ClockRate) for fault in faults)
        finer = _FINER if is_late and plan.random_force is None else 1
        shown = _finely(rig, plan, hidden, dt, finer) if finer > 1 else signals
        signal = shown[sensor.channel]
        for fault in faults:
            signal = fault.distort(plan.file, shown["time"], signal)
        readings[sensor.channel] = sensor.read(signal[::finer][recorded], rng, ceiling=ceiling(sensor.channel, hidden.faults))
    return readings


def _finely(rig: Rig, plan: RecordPlan, hidden: Hidden, dt: float, finer: int) -> dict[str, np.ndarray]:
    """The motion in finer steps: what a channel shows between samples is then not guessed across the kink of an impact."""
    samples = finer * (plan.samples + _AFTER) - _AFTER
    return motion(rig, dataclasses.replace(plan, transient=finer * plan.transient, samples=samples), hidden, dt=dt / finer)


def true_signals(rig: Rig, plan: RecordPlan, hidden: Hidden = NOTHING) -> dict[str, np.ndarray]:
    """Noise-free channels of one record, SI, and the hammer's velocity; time counts from the record's first sample."""
    recorded = slice(plan.transient, plan.transient + plan.samples)
    return {name: signal[recorded] for name, signal in motion(rig, plan, hidden).items()}


def motion(
    rig: Rig, plan: RecordPlan, hidden: Hidden = NOTHING, *, refinement: int = 1, dt: float = SAMPLING_STEP
) -> dict[str, np.ndarray]:
    """The same from the start of the motion to a little after the record's end; `refinement` divides the steps.

    A random force needs the usual `dt`. Raises `ArithmeticError` where the hammer runs away (a softening spring lets it).
    """
    p = parameter_vector(rig, plan, hidden)
    time = dt * np.arange(-plan.transient, plan.samples + _AFTER)
    base = np.array([kernel.base_motion(t, p) for t in time])
    states, slopes, forces = kernel.sampled(time[0], dt, len(time), initial_state(plan, base[0], p), p, refinement)
    if not np.all(np.abs(states[:, kernel.X]) < _ROOM):
        raise ArithmeticError(f"the hammer runs away in {plan.file}: choose a weaker effect")
    if states.shape[1] > kernel.PLAIN:  # the cart's recoil
        base = base + np.stack([states[:, kernel.R], states[:, kernel.RD], slopes[:, kernel.RD]], axis=1)
    return {
        "time": time,
        "hammer_displacement": states[:, kernel.X],
        "hammer_velocity": states[:, kernel.V],
        "cart_displacement": base[:, 0],
        "cart_velocity": base[:, 1],
        "cart_acceleration": base[:, 2],
        "hammer_acceleration": slopes[:, kernel.V],
        "impact_force": forces,
    }


def initial_state(plan: RecordPlan, base: np.ndarray, p: np.ndarray) -> np.ndarray:
    """All at rest relative to the cart, or to the room; a second mode without tension; only the states that are needed."""
    states = np.zeros(kernel.STATES)
    start = (0.0, 0.0) if plan.at_rest else (plan.release + base[0], base[1])
    states[[kernel.X, kernel.V]] = states[[kernel.X2, kernel.X2D]] = start
    return states if np.any(p[_MEMORY]) else states[: kernel.PLAIN]


def parameter_vector(rig: Rig, plan: RecordPlan, hidden: Hidden = NOTHING) -> np.ndarray:
    """Parameters of the kernel for one record."""
    rig = plan.own_rig or rig
    driven = plan.excitation_frequency > 0.0
    return kernel.vector(
        m=rig.m,
        c=rig.c,
        k=rig.k,
        k_i=rig.k_i,
        n=rig.n,
        lambda_i=rig.lambda_i,
        gap=plan.true_gap,
        base_amplitude=rig.base_amplitude if driven else 0.0,
        omega_exc=2.0 * np.pi * plan.excitation_frequency,
        base_phase=plan.base_phase,
        force=force_samples(plan),
        **hidden.parameters(plan.file),
    )


def force_samples(plan: RecordPlan) -> np.ndarray | None:
    """Start (s), step (s) and values (N) of the record's random force, from the start of the motion to its end; None without."""
    if plan.random_force is None:
        return None
    count = kernel.COARSE * (plan.transient + plan.samples + _AFTER) + 1
    return np.append([-plan.transient * SAMPLING_STEP, _FORCE_STEP], plan.random_force.values(count, _FORCE_STEP))


def _frequency(ratio: float, f_n: float) -> float:
    """As it can be set on the drive, Hz."""
    return float(_FREQUENCY_STEP * np.round(ratio * f_n / _FREQUENCY_STEP))


def _plan(rng: np.random.Generator, *, gap: float, **settings) -> RecordPlan:
    """A record whose true gap differs from the set one as it does when set by hand."""
    return RecordPlan(gap=gap, true_gap=gap + rng.normal(0.0, _GAP_ERROR), **settings)
