"""Recorded motion and recorded force as inputs of the model."""

import dataclasses
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, splev, splrep

from identification.experiment import MOTION_CHANNELS, ExperimentError, Record
from identification.experiment.samples import bridged
from identification.windows.kinematics import relative_displacement
from vibrojax.excitation import CubicSignal, SampledForce, SampledMotion


@dataclasses.dataclass(frozen=True, kw_only=True)
class Inputs:
    """Recorded inputs that drive the model along one record; None where the input is not recorded."""

    cart: SampledMotion | None = None
    applied: SampledForce | None = None
    prescribed: SampledMotion | None = None


def inputs_of(record: Record) -> Inputs:
    """Recorded inputs of a record."""
    return Inputs(
        cart=measured_motion(record) if record.base == "measured" else None,
        applied=measured_force(record) if record.kind == "forced" else None,
        prescribed=prescribed_motion(record) if record.kind == "prescribed" else None,
    )


def driving_channels(record: Record) -> frozenset[str]:
    """Channels that drive the model in this record; they are inputs, not data to fit."""
    cart = ("cart_displacement", "cart_acceleration") if record.base == "measured" else ()
    motion = MOTION_CHANNELS if record.kind == "prescribed" else ()
    return frozenset(("applied_force", *cart, *motion))


def prescribed_motion(record: Record) -> SampledMotion:
    """Recorded motion of the hammer relative to the cart: a quintic smoothing spline whose residual equals the noise."""
    u = relative_displacement(record)
    name = next((name for name in MOTION_CHANNELS if name in record.channels), None)
    if u is None or name is None:
        raise ExperimentError(f"record {record.file!r} is prescribed but its motion is not recorded: record {MOTION_CHANNELS[0]}")
    smooth = _smoothing(record.time, u, record.noise.get(name, 0.0))
    position, curvature = (CubicSpline(record.time, splev(record.time, smooth, der=order)) for order in (0, 2))
    return SampledMotion(position=_signal(position), second_derivative=_signal(curvature))


def measured_motion(record: Record) -> SampledMotion:
    """Recorded motion of the cart.

    The displacement is a quintic smoothing spline whose residual equals the noise (the sensor's noise is no motion of the cart); without a
    displacement sensor it is the integrated acceleration, less its straight line. The acceleration is the recorded one, or the second
    derivative of that spline.
    """
    time, channels = record.time, record.channels
    if "cart_displacement" not in channels and "cart_acceleration" not in channels:
        raise ExperimentError(
            f'record {record.file!r} says base = "measured" but holds neither cart_displacement nor cart_acceleration:'
            ' record one of them or set base = "sine"'
        )
    smooth = None
    if "cart_displacement" in channels:
        noise = record.noise.get("cart_displacement", 0.0)
        smooth = _smoothing(time, bridged(time, channels["cart_displacement"]), noise)
    recorded = bridged(time, channels["cart_acceleration"]) if "cart_acceleration" in channels else splev(time, smooth, der=2)
    acceleration = CubicSpline(time, recorded)
    if smooth is not None:
        position = CubicSpline(time, splev(time, smooth))
    else:
        drifting = acceleration.antiderivative(2)(time)
        position = CubicSpline(time, drifting - np.polyval(np.polyfit(time, drifting, 1), time))
    return SampledMotion(position=_signal(position), second_derivative=_signal(acceleration))


def measured_force(record: Record) -> SampledForce:
    """Recorded force on the hammer."""
    return SampledForce(signal=_signal(CubicSpline(record.time, bridged(record.time, record.channels["applied_force"]))))


def part(signal: CubicSignal, first: int, samples: int) -> CubicSignal:
    """The pieces of a signal under a stretch, padded to `samples` knots: the last piece goes on, also at the last sample."""
    index, last = np.arange(first, first + samples), signal.coefficients.shape[1] - 1
    pieces = np.minimum(index, last)
    knots = signal.knots[pieces] + np.maximum(index - max(first, last), 0) * 1.0
    return CubicSignal(knots=knots, coefficients=signal.coefficients[:, pieces[:-1]])


def _smoothing(time: np.ndarray, values: np.ndarray, noise: float) -> Any:
    """Quintic spline, in the form of SciPy's `splrep`, whose residual equals the noise."""
    return splrep(time, values, k=5, s=len(time) * noise**2)


def _signal(spline: CubicSpline) -> CubicSignal:
    """Interpolant with one piece per sampling interval."""
    return CubicSignal(knots=np.asarray(spline.x), coefficients=np.asarray(spline.c))
