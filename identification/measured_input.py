"""Recorded cart motion and recorded force as inputs of the model."""

import numpy as np
from scipy.interpolate import CubicSpline, splev, splrep

from identification.experiment import ExperimentError, Record
from identification.kinematics import bridged
from vibrojax.excitation import CubicSignal, SampledForce, SampledMotion


def measured_motion(record: Record) -> SampledMotion:
    """Motion of the cart as recorded.

    The displacement is a quintic smoothing spline through the recorded one, whose residual equals the noise (the sensor's noise is no
    motion of the cart); without a sensor it is the integrated acceleration with its straight line removed. The acceleration is the
    recorded one, or the second derivative of that spline.
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
        smooth = splrep(time, bridged(time, channels["cart_displacement"]), k=5, s=len(time) * noise**2)
    recorded = bridged(time, channels["cart_acceleration"]) if "cart_acceleration" in channels else splev(time, smooth, der=2)
    acceleration = CubicSpline(time, recorded)
    if smooth is not None:
        position = CubicSpline(time, splev(time, smooth))
    else:
        drifting = acceleration.antiderivative(2)(time)
        position = CubicSpline(time, drifting - np.polyval(np.polyfit(time, drifting, 1), time))
    return SampledMotion(position=_signal(position), second_derivative=_signal(acceleration))


def measured_force(record: Record) -> SampledForce:
    """Force on the hammer as recorded."""
    return SampledForce(signal=_signal(CubicSpline(record.time, bridged(record.time, record.channels["applied_force"]))))


def part(signal: CubicSignal, first: int, samples: int) -> CubicSignal:
    """The pieces of a signal under one window, padded with its last piece to `samples` knots."""
    wanted = np.minimum(np.arange(first, first + samples), len(signal.knots) - 1)
    pieces = np.minimum(wanted[:-1], signal.coefficients.shape[1] - 1)
    knots = signal.knots[wanted] + np.maximum(np.arange(first, first + samples) - (len(signal.knots) - 1), 0) * 1.0
    return CubicSignal(knots=knots, coefficients=signal.coefficients[:, pieces])


def _signal(spline: CubicSpline) -> CubicSignal:
    """Interpolant with one piece between any two samples."""
    return CubicSignal(knots=np.asarray(spline.x), coefficients=np.asarray(spline.c))
