"""Free flights of an experiment: what a model without a contact can be fitted to."""

import dataclasses

import numpy as np
from scipy.signal import savgol_filter

from identification.experiment import Experiment, Record

_NARROW, _NEAR, _CLEAR, _SHORTEST = 9, 1e-4, 4, 40
"""Smoothing, samples; distance from the stop, m; samples left out at either end of a flight; samples of the shortest flight."""
_CUBIC = 25
"""Samples through which a cubic tells the velocity with which a flight begins."""


@dataclasses.dataclass(frozen=True)
class Flights:
    """Samples of all free flights, one after the other, SI."""

    first: np.ndarray
    """Index of each flight's first sample; the last is the count of samples."""
    t: np.ndarray
    x: np.ndarray
    """Displacement of the hammer."""
    a: np.ndarray
    """Its acceleration, NaN where there is no accelerometer."""
    v: np.ndarray
    """Velocity u' with which each flight begins, roughly: of a cubic through its first samples."""
    cart: np.ndarray
    """Amplitude, angular frequency and phase of the cart's sine; (flights, 3)."""
    noise: tuple[float, float]
    """Of displacement and acceleration."""
    mass: float
    f_n: float
    """First guess, Hz."""

    @property
    def count(self) -> int:
        """Readings."""
        return len(self.x) + int(np.isfinite(self.a).sum())


def flights(experiment: Experiment) -> Flights:
    """All free flights of an experiment; motions of the cart are its sine."""
    parts = [part for record in experiment.records for part in _of_record(record)]
    noise = experiment.records[0].noise
    lengths = [len(t) for t, *_ in parts]
    return Flights(
        first=np.concatenate([[0], np.cumsum(lengths)]),
        t=np.concatenate([t for t, *_ in parts]),
        x=np.concatenate([x for _, x, *_ in parts]),
        a=np.concatenate([a for _, _, a, _ in parts]),
        v=np.array([_beginning(t, x, cart) for t, x, _, cart in parts]),
        cart=np.array([cart for *_, cart in parts]),
        noise=(noise["hammer_displacement"], noise.get("hammer_acceleration", np.nan)),
        mass=experiment.mass,
        f_n=_natural(parts),
    )


def _of_record(record: Record) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float, float]]]:
    t, x = record.time, record.channels["hammer_displacement"]
    omega = 2.0 * np.pi * (record.excitation_frequency or 0.0)
    amplitude, phase = 0.0, 0.0
    if omega:
        columns = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=1)
        a, b = np.linalg.lstsq(columns, record.channels["cart_displacement"], rcond=None)[0]
        amplitude, phase = float(np.hypot(a, b)), float(np.arctan2(b, a))
    away = np.asarray(savgol_filter(x, _NARROW, 3)) - amplitude * np.sin(omega * t + phase) - record.gap < -_NEAR
    edges = np.flatnonzero(np.diff(np.pad(away.astype(int), 1)))
    acceleration = record.channels.get("hammer_acceleration", np.full(len(t), np.nan))
    found = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        inside = slice(first + _CLEAR, last - _CLEAR)
        if last - first >= _SHORTEST + 2 * _CLEAR:
            found.append((t[inside], x[inside], acceleration[inside], (amplitude, omega, phase)))
    return found


def _beginning(t: np.ndarray, x: np.ndarray, cart: tuple[float, float, float]) -> float:
    """u' at the first sample, m/s."""
    amplitude, omega, phase = cart
    slope = np.polynomial.Polynomial.fit(t[:_CUBIC], x[:_CUBIC], 3).deriv()(t[0])
    return float(slope - amplitude * omega * np.cos(omega * t[0] + phase))


def _natural(parts: list[tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float, float]]]) -> float:
    """Hz, by regression of the smoothed acceleration on the displacement."""
    above, below = 0.0, 0.0
    for t, x, _, (amplitude, omega, phase) in parts:
        width = min(61, len(t) // 2 * 2 - 1)
        sine = amplitude * np.sin(omega * t + phase)
        u = np.asarray(savgol_filter(x, width, 3)) - sine
        inertia = np.asarray(savgol_filter(x, width, 3, deriv=2, delta=float(np.median(np.diff(t)))))
        inner = slice(width // 2, len(t) - width // 2)
        above, below = above - float(u[inner] @ inertia[inner]), below + float(u[inner] @ u[inner])
    return float(np.sqrt(max(above, 1e-12) / below)) / (2.0 * np.pi)
