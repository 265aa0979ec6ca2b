"""Motion of hammer and cart as recorded: smoothed for first guesses, as a sine, and as an input that drives the model."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline, make_interp_spline, splev, splrep
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from identification.experiment import MOTION_CHANNELS, ExperimentError, Record, signals
from identification.experiment.channels import CART_CHANNELS
from identification.experiment.clock import LONG
from identification.experiment.samples import bridged
from identification.experiment.signals import CONTACT
from vibrojax.excitation import CubicSignal, SampledForce, SampledMotion

_NARROWEST, _ORDER = 3, 3
"""Smallest half width, in samples, and order of the local polynomials."""
_DEGREE = 9
"""Of the spline through a recorded input: it passes on 99.9 % of a sine of three samples a period, where one of degree 3 loses 6 %."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Kinematics:
    """Smoothed relative displacement, velocity and acceleration, and where the hammer is in contact; all of shape (samples,), SI.

    `force` is that of the load cell, None without one; `inertia` is -m x'', or the reaction force on a prescribed path: the sum of contact
    force and suspension force.
    """

    u: np.ndarray
    v: np.ndarray
    a: np.ndarray
    base_acceleration: np.ndarray
    force: np.ndarray | None
    inertia: np.ndarray
    touching: np.ndarray


def relative_displacement(record: Record) -> Float[np.ndarray, " samples"] | None:
    """Relative displacement u = x - y, m, from whichever channels give it; None where no combination does. NaN stretches are linear."""
    # each channel is bridged separately: two channels may have no common samples
    channels = {name: bridged(record.time, values) for name, values in record.channels.items()}
    return signals.relative_displacement(dataclasses.replace(record, channels=channels))


def kinematics(record: Record, *, mass: float, base_acceleration: Float[np.ndarray, " samples"]) -> Kinematics | None:
    """Smoothed relative motion from local cubic fits to the displacement; None where displacement was not recorded."""
    u = relative_displacement(record)
    if u is None:
        return None
    dt = float(np.median(np.diff(record.time)))
    half = _half_width(u, dt, _displacement_noise(record))
    smooth, v, a = (np.asarray(savgol_filter(u, 2 * half + 1, _ORDER, deriv=order, delta=dt)) for order in range(3))
    acceleration = record.channels.get("hammer_acceleration")
    inertia = -mass * (a + base_acceleration if acceleration is None else bridged(record.time, acceleration))
    if "reaction_force" in record.channels:
        inertia = bridged(record.time, record.channels["reaction_force"])
    near = smooth > record.gap - 0.05 * np.ptp(smooth)
    force, touching = None, stands_out(inertia, near)
    if "impact_force" in record.channels:
        force = bridged(record.time, record.channels["impact_force"])
        touching = force > CONTACT * record.noise.get("impact_force", np.inf)
    elif acceleration is None:
        touching |= smooth > record.gap + CONTACT * _displacement_noise(record)
    touching = smooth > record.gap if record.kind == "prescribed" else touching & near
    return Kinematics(u=smooth, v=v, a=a, base_acceleration=base_acceleration, force=force, inertia=inertia, touching=touching)


def _half_width(u: Float[np.ndarray, " samples"], dt: float, noise: float) -> int:
    """Half width of the local polynomials, samples: the largest, up to 1.5 ms, with a residual of pure noise, even in the shortest contact.

    The noise is the declared one, or that of the shortest polynomials where it is larger.
    """
    half = int(np.clip(round(1.5e-3 / dt), _NARROWEST, len(u) // 4))
    if half <= _NARROWEST:
        return half
    finest = u - savgol_filter(u, 2 * _NARROWEST + 1, _ORDER)
    own = 1.4826 * float(np.median(np.abs(finest))) / np.sqrt(1.0 - (_ORDER + 1) / (2 * _NARROWEST + 1))
    noise = max(noise, own) if np.isfinite(noise) else own
    while half > _NARROWEST and _largest_residual(u, half, noise) > 2.5 * noise:  # it smooths too much
        half = max(half // 2, _NARROWEST)
    return half


def _largest_residual(u: Float[np.ndarray, " samples"], half: int, noise: float) -> float:
    """Largest residual of local polynomials, as rms over their width; the effect of a single outlier is limited."""
    residual = np.clip(u - savgol_filter(u, 2 * half + 1, _ORDER), -8.0 * noise, 8.0 * noise)
    return float(np.sqrt(uniform_filter1d(residual**2, 2 * half + 1).max()))


def _displacement_noise(record: Record) -> float:
    """Noise of u, m; infinite where it is not known."""
    if "relative_displacement" in record.channels:
        return record.noise.get("relative_displacement", np.inf)
    cart = record.noise.get("cart_displacement", 0.0) if record.kind == "cart-excitation" else 0.0
    return float(np.hypot(record.noise.get("hammer_displacement", np.inf), cart))


def stands_out(inertia: Float[np.ndarray, " samples"], near: Bool[np.ndarray, " samples"]) -> Bool[np.ndarray, " samples"]:
    """Samples whose inertia force is far above its usual range in flight, as in an impact; `near` marks samples close to or in the stop.

    The usual range comes from samples that are not near, since a record may hold little but one long contact.
    """
    flight = inertia[~near] if np.sum(~near) >= 16 else inertia  # enough to show it
    middle = np.median(flight)
    return inertia - middle > CONTACT * 1.4826 * np.median(np.abs(flight - middle))


def drive_omega(record: Record) -> float:
    """Frequency of a cart that moves as a sine, as set, rad/s; 0 for a cart at rest."""
    return 2.0 * np.pi * (record.excitation_frequency or 0.0) if record.kind == "cart-excitation" else 0.0


def cart_is_unseen(record: Record) -> bool:
    """Whether the cart moves as a sine that no sensor recorded."""
    driven = record.base == "sine" and drive_omega(record) > 0.0
    return driven and not record.channels.keys() & set(CART_CHANNELS)


def harmonic_start(record: Record) -> tuple[float, float]:
    """Amplitude A0, m, and phase, rad, of y = A0 sin(2 pi f t + phase), by linear least squares on the cart's channel.

    Zero for a cart at rest. Where neither displacement nor acceleration of the cart was recorded, the hammer's displacement replaces them:
    its amplitude is of the same order, and the fit corrects it.
    """
    omega = drive_omega(record)
    if omega == 0.0:
        return 0.0, 0.0
    for name, factor in (("cart_displacement", 1.0), ("cart_acceleration", -(omega**-2)), ("hammer_displacement", 1.0)):
        if name in record.channels:
            return signals.sine_at(record.time, factor * record.channels[name], omega / (2.0 * np.pi))[:2]
    return 1e-3, 0.0


def harmonic_acceleration(record: Record, amplitude: float, phase: float) -> Float[np.ndarray, " samples"]:
    """y'' of the cart's sine at the record's samples, m/s^2; zero for a cart at rest."""
    omega = drive_omega(record)
    return -amplitude * omega**2 * np.sin(omega * record.time + phase)


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
    cart = CART_CHANNELS if record.base == "measured" else ()
    motion = MOTION_CHANNELS if record.kind == "prescribed" else ()
    return frozenset(("applied_force", *cart, *motion))


def driven_by(record: Record) -> frozenset[str]:
    """Recorded inputs that move a hammer which is free to move: the force on it, and the motion of the cart."""
    if record.kind == "prescribed":
        return frozenset()
    force = ("applied_force",) if record.kind == "forced" else ()
    cart = CART_CHANNELS if record.base == "measured" else ()
    return frozenset((*force, *cart)) & set(record.channels)


def input_noise(record: Record) -> tuple[float, float]:
    """Intensity of the declared noise of a recorded force, N^2 s, and of a recorded acceleration of the cart, (m/s^2)^2 s.

    Variance times sampling interval; 0 of an input without a declared noise: what looks like noise may well drive the hammer.
    """
    declared, dt = driven_by(record) - record.noise_estimated, float(np.median(np.diff(record.time)))
    force, base = (record.noise.get(name, 0.0) if name in declared else 0.0 for name in ("applied_force", "cart_acceleration"))
    return force**2 * dt, base**2 * dt


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
    displacement sensor it is the integral of a cubic spline through the acceleration, less its straight line. The acceleration is the
    recorded one (`band_limited`), or the second derivative of the smoothing spline.
    """
    time, displacement, recorded = record.time, *(record.channels.get(name) for name in CART_CHANNELS)
    given = None if recorded is None else bridged(time, recorded)
    if displacement is not None:
        smooth = _smoothing(time, bridged(time, displacement), record.noise.get("cart_displacement", 0.0))
        position = CubicSpline(time, splev(time, smooth))
        acceleration = _signal(CubicSpline(time, splev(time, smooth, der=2))) if given is None else band_limited(time, given)
    elif given is not None:
        acceleration, drifting = band_limited(time, given), CubicSpline(time, given).antiderivative(2)(time)
        position = CubicSpline(time, drifting - np.polyval(np.polyfit(time, drifting, 1), time))
    else:
        raise ExperimentError(
            f'record {record.file!r} says base = "measured" but holds neither cart_displacement nor cart_acceleration:'
            ' record one of them or set base = "sine"'
        )
    return SampledMotion(position=_signal(position), second_derivative=acceleration)


def measured_force(record: Record) -> SampledForce:
    """Recorded force on the hammer (`band_limited`)."""
    return SampledForce(signal=band_limited(record.time, bridged(record.time, record.channels["applied_force"])))


def band_limited(time: Float[np.ndarray, " samples"], values: Float[np.ndarray, " samples"]) -> CubicSignal:
    """What a recorder with an anti-aliasing filter has seen between its samples: nothing above half its rate.

    A spline of high degree through the samples is close to that; in each sampling interval the nearest cubic takes its place, by least
    squares, which passes on its mean and lowest moments, and so nearly all that moves a rig. It may miss the samples, and jump there, by
    some hundredths of what is close to half the rate. An input that jumps overshoots by 13 % and rings over some ten samples. Where the
    clock pauses or changes its rate, a cubic spline through the samples it is.

    Arguments:
        time: s, strictly increasing.
        values: at these times, without gaps.

    Example: at three samples a period, a quarter of a period behind a crest, the sine is nought.
        >>> wave = band_limited(np.arange(60.0), np.cos(2.0 * np.pi * np.arange(60.0) / 3.0))
        >>> abs(float(wave(np.asarray(30.75)))) < 0.02
        True

    Source: A. Aldroubi, M. Unser, M. Eden, Signal Processing 28 (1992) 127-138 (splines of growing degree tend to the band-limited
    interpolant).
    """
    steps = np.diff(time)
    if max(steps.max() / np.median(steps), np.median(steps) / steps.min()) > LONG:
        return _signal(CubicSpline(time, values))
    over = min(2 * _DEGREE, len(time) - 1)
    knots, through = (np.pad(one, over, mode="reflect", reflect_type="odd") for one in (time, values))
    spline = make_interp_spline(knots, through, k=_DEGREE)
    nodes, weights = np.polynomial.legendre.leggauss(_DEGREE - 1)  # exact for the product of spline and cubic
    powers = np.vander(0.5 * (1.0 + nodes), 4)
    nearest = np.linalg.solve(powers.T * weights @ powers, powers.T * weights)
    inside = spline(time[:-1, None] + 0.5 * steps[:, None] * (1.0 + nodes))
    return CubicSignal(knots=np.asarray(time), coefficients=(nearest @ inside.T) / steps ** np.arange(3, -1, -1)[:, None])


def parts(signal: CubicSignal, first: Int[np.ndarray, " parts"], samples: int) -> CubicSignal:
    """The pieces of a signal under stretches that begin with the piece `first`; the last piece goes on to fill up `samples` knots."""
    last = signal.coefficients.shape[1] - 1
    index = first[:, None] + np.arange(samples)
    pieces = np.minimum(index, last)
    knots = signal.knots[pieces] + np.maximum(index - np.maximum(first, last)[:, None], 0)
    return CubicSignal(knots=knots, coefficients=np.moveaxis(np.asarray(signal.coefficients)[:, pieces[:, :-1]], 0, 1))


def _smoothing(time: np.ndarray, values: np.ndarray, noise: float) -> Any:
    """Quintic spline, in the form of SciPy's `splrep`, whose residual equals the noise."""
    return splrep(time, values, k=5, s=len(time) * noise**2)


def _signal(spline: CubicSpline) -> CubicSignal:
    """Interpolant with one piece per sampling interval."""
    return CubicSignal(knots=np.asarray(spline.x), coefficients=np.asarray(spline.c))
