"""Whether channels that show one motion show it on one scale: a unit mistaken for another is reported before anything is fitted."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float
from scipy.signal import detrend
from scipy.signal.windows import hann

from identification.experiment.channels import CHANNELS
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.record import Record
from identification.experiment.units import FACTORS, STAND_INS, STANDARD_GRAVITY, factor_to_si, is_stand_in

# How near a ratio must come to that of two units; no calibration is so far off that it would be taken for one of them.
NEAR = 0.1
# Beyond this ratio of impact force to inertia no calibration is off: mass or unit is wrong.
FAR = 10.0
# Of units that are easily mistaken in a sensitivity.
SLIPS = (1e3, 1e-3, 1e6, 1e-6, STANDARD_GRAVITY, 1.0 / STANDARD_GRAVITY)
# Below this correlation two channels do not show the same.
ALIKE = 0.95
# A force that is strong for a larger part of the samples is an offset rather than impacts.
MOSTLY_APART = 0.5
# Times the scatter between records beyond which a factor is the same in all of them.
SURE = 5.0
# Slowest lines of a spectrum, which the window smears and an accelerometer does not feel, and what counts beside the strongest line.
SLOWEST, STRONG = 4, 1e-2
# A record whose time stamps are less even than this is not compared.
EVEN = 1e-3
PAIRS = (("hammer_displacement", "hammer_acceleration"), ("cart_displacement", "cart_acceleration"))


def check_scales(record: Record, units: dict[str, str | None], mass: float | None, through: frozenset[str] = frozenset()) -> None:
    """Compare accelerations with displacements, and the force of the impacts with the deceleration of the hammer.

    Args:
        record: with its channels.
        units: declared for its channels; None where the file states one. What is written in a stand-in for an SI unit is not compared.
        mass: of the hammer, kg; None where it is not known.
        through: channels that are read through a sensitivity.

    Raises:
        ExperimentError: a channel is as much too large or too small as if its unit were another one, or points the other way.
    """
    for one, other, ratio in _ratios(record, mass):
        if is_stand_in(units[one]) or is_stand_in(units[other]):
            continue
        if ratio < 0.0:
            raise ExperimentError(
                f"{one} and {other} point opposite ways in record {shown(record.file)}: expected both to grow towards the stop, and the "
                f"impact force to be positive in compression; {_turned(record, one, other)}"
            )
        if through & {one, other}:
            _check_sensitivities(record, one, other, ratio, through)
        for channel, factor in ((one, ratio), (other, 1.0 / ratio)) if not through & {one, other} else ():
            if unit := mistaken_unit(channel, factor, units[channel]):
                unit += " or its time in ms" if abs(abs(ratio) * 1e-6 - 1.0) < NEAR else ""
                raise ExperimentError(
                    f"{channel} is {abs(factor):.2g} times what {other if channel == one else one} gives for it in record "
                    f"{shown(record.file)}, as if its numbers were in {unit}: expected one motion; correct 'unit' in [sensors.{channel}], "
                    f"or 'units' of the record{', or mass in [hammer]' if one == 'impact_force' else ''}"
                )
        if one == "impact_force" and not 1.0 / FAR < ratio < FAR:
            raise ExperimentError(
                f"impact_force is {ratio:.2g} times mass times deceleration in record {shown(record.file)}: expected about the same; "
                "correct 'mass' in [hammer], which is in kg, or the unit of the load cell or of the accelerometer"
            )


def _check_sensitivities(record: Record, one: str, other: str, ratio: float, through: frozenset[str]) -> None:
    """Two channels, at least one of them read through a sensitivity, differ by a factor between units: mV for V, or m/s^2 for g."""
    if any(abs(ratio / slip - 1.0) < NEAR for slip in SLIPS):
        where = " or ".join(
            f"sensitivity or unit in [sensors.{name}]" if name in through else f"unit in [sensors.{name}]" for name in (one, other)
        )
        raise ExperimentError(
            f"{one} is {ratio:.3g} times what {other} gives for it in record {shown(record.file)}, a factor between units: expected one "
            f"motion; correct {where}{', or mass in [hammer]' if one == 'impact_force' else ''}"
        )


def disagreements(records: Sequence[Record], mass: float | None) -> tuple[str, ...]:
    """Say which channels show the same motion on scales that differ, by a factor that is the same in all records and is no unit.

    Args:
        records: with their channels.
        mass: of the hammer, kg; None where it is not known.

    Returns:
        One sentence for each pair. A factor within the usual error of calibrations is not reported, nor one that changes between records.
    """
    found: dict[tuple[str, str], list[float]] = {}
    for record in records:
        for one, other, ratio in _ratios(record, mass):
            found.setdefault((one, other), []).append(ratio)
    said = []
    for (one, other), ratios in found.items():
        mean, scatter = float(np.mean(ratios)), float(np.std(ratios))
        if abs(mean - 1.0) > max(NEAR, SURE * scatter):
            expected = "mass times deceleration" if one == "impact_force" else f"what {other} gives for it"
            said.append(
                f"{one} is {mean:.3g} times {expected}, in {len(ratios)} record{'s' if len(ratios) > 1 else ''}: check the calibration of "
                "both; `vibrojax diagnose` tells which of them is off (gain_error)."
            )
    return tuple(said)


def _turned(record: Record, one: str, other: str) -> str:
    """Which of two channels is to be turned round: the load cell, whose pushes are positive, tells; else the operator has to."""
    force = record.channels.get("impact_force")
    if force is None:
        return f"set sign = -1 in [sensors.{one}] or in [sensors.{other}]"
    rest = force - np.nanmedian(force)
    upright = np.nanmax(rest) > -np.nanmin(rest)
    return f"set sign = -1 in [sensors.{'hammer_acceleration' if upright and one.startswith(('impact', 'hammer')) else one}]"


def _ratios(record: Record, mass: float | None) -> Iterator[tuple[str, str, float]]:
    """Pairs of channels that show the same, and the first over what the second gives for it."""
    channels = record.channels
    for displacement, acceleration in PAIRS:
        if displacement in channels and acceleration in channels:
            ratio = motion_ratio(record.time, channels[displacement], channels[acceleration])
            if ratio is not None:
                yield acceleration, displacement, ratio
    if mass is not None and {"impact_force", "hammer_acceleration"} <= channels.keys():
        force, inertia = channels["impact_force"], -mass * channels["hammer_acceleration"]
        known = np.isfinite(force) & np.isfinite(inertia)
        if known.any():
            strong = known & (np.abs(force) > 0.3 * np.max(np.abs(force[known])))
            if 3 <= strong.sum() < MOSTLY_APART * known.sum() and abs(_correlation(inertia[strong], force[strong])) > ALIKE:
                yield "impact_force", "hammer_acceleration", _slope(inertia[strong], force[strong])


def motion_ratio(
    time: Float[np.ndarray, " samples"], displacement: Float[np.ndarray, " samples"], acceleration: Float[np.ndarray, " samples"]
) -> float | None:
    """How many times an acceleration is the second derivative of a displacement; None where they do not show the same."""
    pair = _spectra(time, displacement, acceleration)
    return _slope(*pair) if pair and abs(_correlation(*pair)) > ALIKE else None


def _spectra(
    time: Float[np.ndarray, " samples"], displacement: Float[np.ndarray, " samples"], acceleration: Float[np.ndarray, " samples"]
) -> tuple[np.ndarray, np.ndarray] | None:
    """Strong lines of a displacement's second derivative and of an acceleration; None where samples are missing or unevenly spaced."""
    steps = np.diff(time)
    usable = len(time) > 4 * SLOWEST and np.ptp(steps) < EVEN * steps.mean() and np.isfinite(displacement + acceleration).all()
    if not usable:
        return None
    window = hann(len(time))
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(time), float(steps.mean()))
    moved, felt = (np.fft.rfft(window * detrend(values)) for values in (displacement, acceleration))
    size = np.abs(moved)
    size[:SLOWEST] = 0.0
    strong = size > STRONG * size.max()
    return -(omega[strong] ** 2) * moved[strong], felt[strong]


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Between -1 and 1; without a mean, because both rest at zero."""
    return float(np.vdot(a, b).real / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))


def _slope(a: np.ndarray, b: np.ndarray) -> float:
    """How many times `a` is in `b`, by least squares."""
    return float(np.vdot(a, b).real / np.vdot(a, a).real)


def mistaken_unit(channel: str, factor: float, declared: str | None) -> str:
    """The unit that the numbers would have to be in for a channel that reads `factor` times too much; empty where there is none."""
    if declared is None:
        return ""
    dimension = CHANNELS[channel]
    read = factor_to_si(declared, dimension, f"[sensors.{channel}]")
    others = {unit: true for unit, true in FACTORS[dimension].items() if true != read and unit not in STAND_INS}
    nearest = min(others, key=lambda unit: abs(factor * others[unit] / read - 1.0))
    return nearest if abs(factor * others[nearest] / read - 1.0) < NEAR else ""
