"""Smoothed relative motion of a record, for the start of a fit; never used as its data."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from identification.experiment import Record
from identification.experiment.samples import bridged

_LONGEST_S, _FEWEST_SAMPLES = 1.5e-3, 3
"""Largest half width of the local polynomials, s; smallest, in samples."""
_BLUNT = 2.5
"""Residual of a local polynomial (rms over its width, in units of the noise) above which it smooths too much."""
_FAR_OFF = 8.0
"""Limit to the residual of a single sample, in units of the noise."""
_ORDER = 3
"""Order of the local polynomials."""
_CONTACT_SIGNIFICANCE = 6.0
"""Force, in standard deviations above zero, above which it counts as contact."""
_FEWEST_IN_FLIGHT = 16
"""Fewest samples clear of the stop that show the usual range of a force in flight."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Kinematics:
    """Smoothed relative displacement, velocity and acceleration, and where the hammer is in contact; all of shape (samples,)."""

    u: np.ndarray
    v: np.ndarray
    a: np.ndarray
    base_acceleration: np.ndarray
    force: np.ndarray | None
    """Contact force of the load cell, N; None without one."""
    inertia: np.ndarray
    """-m x'', or the reaction force on a prescribed path, N: sum of contact force and suspension force."""
    touching: np.ndarray


def relative_displacement(record: Record) -> Float[np.ndarray, " samples"] | None:
    """Relative displacement u = x - y, m, from whichever channels give it; None where no combination does. NaN stretches are linear."""
    # each channel is bridged separately: two channels may have no common samples
    channels = {name: bridged(record.time, values) for name, values in record.channels.items()}
    if "relative_displacement" in channels:
        return channels["relative_displacement"]
    if "hammer_displacement" not in channels:
        return None
    if record.kind != "cart-excitation" and record.base != "measured":
        return channels["hammer_displacement"]
    if "cart_displacement" in channels:
        return channels["hammer_displacement"] - channels["cart_displacement"]
    return None


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
        touching = force > _CONTACT_SIGNIFICANCE * record.noise.get("impact_force", np.inf)
    elif acceleration is None:
        touching |= smooth > record.gap + _CONTACT_SIGNIFICANCE * _displacement_noise(record)
    touching = smooth > record.gap if record.kind == "prescribed" else touching & near
    return Kinematics(u=smooth, v=v, a=a, base_acceleration=base_acceleration, force=force, inertia=inertia, touching=touching)


def _half_width(u: Float[np.ndarray, " samples"], dt: float, noise: float) -> int:
    """Half width of the local polynomials, samples: the largest with a residual of pure noise, even in the shortest contact.

    The noise is the declared one, or that of the shortest polynomials where it is larger.
    """
    half = int(np.clip(round(_LONGEST_S / dt), _FEWEST_SAMPLES, len(u) // 4))
    if half <= _FEWEST_SAMPLES:
        return half
    finest = u - savgol_filter(u, 2 * _FEWEST_SAMPLES + 1, _ORDER)
    own = 1.4826 * float(np.median(np.abs(finest))) / np.sqrt(1.0 - (_ORDER + 1) / (2 * _FEWEST_SAMPLES + 1))
    noise = max(noise, own) if np.isfinite(noise) else own
    while half > _FEWEST_SAMPLES and _left(u, half, noise) > _BLUNT * noise:
        half = max(half // 2, _FEWEST_SAMPLES)
    return half


def _left(u: Float[np.ndarray, " samples"], half: int, noise: float) -> float:
    """Largest residual of local polynomials, as rms over their width; the effect of a single outlier is limited."""
    residual = np.clip(u - savgol_filter(u, 2 * half + 1, _ORDER), -_FAR_OFF * noise, _FAR_OFF * noise)
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
    flight = inertia[~near] if np.sum(~near) >= _FEWEST_IN_FLIGHT else inertia
    middle = np.median(flight)
    return inertia - middle > _CONTACT_SIGNIFICANCE * 1.4826 * np.median(np.abs(flight - middle))
