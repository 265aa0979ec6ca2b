"""Amplitude and phase of the cart's sine."""

import numpy as np
from jaxtyping import Float

from identification.experiment import Record


def harmonic_start(record: Record) -> tuple[float, float]:
    """Amplitude A0, m, and phase, rad, of y = A0 sin(2 pi f t + phase), by linear least squares on the cart's channel.

    Zero for a cart at rest. Where neither displacement nor acceleration of the cart was recorded, the hammer's displacement replaces them:
    its amplitude is of the same order, and the fit corrects it.
    """
    if record.kind != "cart-excitation" or record.excitation_frequency is None:
        return 0.0, 0.0
    omega = 2 * np.pi * record.excitation_frequency
    for name, factor in (("cart_displacement", 1.0), ("cart_acceleration", -(omega**-2)), ("hammer_displacement", 1.0)):
        if name in record.channels:
            return _sine(record.time, factor * record.channels[name], omega)
    return 1e-3, 0.0


def harmonic_acceleration(record: Record, amplitude: float, phase: float) -> Float[np.ndarray, " samples"]:
    """y'' of the cart's sine at the record's samples, m/s^2; zero for a cart at rest."""
    if record.kind != "cart-excitation" or record.excitation_frequency is None:
        return np.zeros_like(record.time)
    omega = 2 * np.pi * record.excitation_frequency
    return -amplitude * omega**2 * np.sin(omega * record.time + phase)


def _sine(time: np.ndarray, values: np.ndarray, omega: float) -> tuple[float, float]:
    """Amplitude and phase of the least-squares sine with an offset."""
    usable = np.isfinite(values)
    t, values = time[usable], values[usable]
    basis = np.stack([np.sin(omega * t), np.cos(omega * t), np.ones_like(t)], axis=1)
    (a, b, _), *_ = np.linalg.lstsq(basis, values, rcond=None)
    return float(np.hypot(a, b)), float(np.arctan2(b, a))
