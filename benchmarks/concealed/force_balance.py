"""The force that the simpler methods explain: m x'' from the accelerometer, or from the twice differentiated, smoothed displacement.

Rows are samples. In flight -m x'' is what the suspension does, in contact the stop's force comes on top; a second set of rows compares the
load cell with the force that mass and suspension imply. Every row is divided by its error, a rough one.
"""

import dataclasses
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from identification.experiment import Experiment, Record, load_experiment

_NARROW, _WIDE = 9, 61
"""Window of the local cubics, samples: in contact, and in flight."""
_NEAR = 1e-4
"""m; closer to the stop than this is neither flight nor contact, since the gap is known no better."""
_KEPT = 4
"""One flight sample of so many is kept."""
_CURVE = 0.03
"""Error of a force in contact, as a share of the record's highest: derivatives are poor there."""


@dataclasses.dataclass(frozen=True)
class Samples:
    """Kept samples of one record, SI."""

    record: int
    omega: float
    """Of the drive, rad/s; 0 without."""
    amplitude: float
    """Of the cart's sine, m."""
    t: np.ndarray
    angle: np.ndarray
    """Of the cart's sine, rad."""
    u: np.ndarray
    v: np.ndarray
    delta: np.ndarray
    contact: np.ndarray
    inertia: np.ndarray
    """-m x'', N"""
    sigma: np.ndarray
    """Error of the inertia, N."""
    load: np.ndarray | None
    """What the load cell reads, N."""
    load_sigma: float
    wobble: np.ndarray
    """What the cart does beside its sine, m."""
    memory: np.ndarray
    """Elastic stretch of a Bouc-Wen element that yields at A0, 1 at most."""


@dataclasses.dataclass(frozen=True)
class Balance:
    """All records of one experiment."""

    records: tuple[Samples, ...]
    stop_is_known: bool
    """Whether the declared model has a stop."""


def force_balance(folder: Path) -> Balance:
    """Of the experiment in `folder`."""
    experiment = load_experiment(folder)
    records = tuple(_samples(experiment, record, number) for number, record in enumerate(experiment.records))
    return Balance(records, experiment.law != "none")


def _samples(experiment: Experiment, record: Record, number: int) -> Samples:
    """Smooth, differentiate, and keep flight and contact."""
    t, dt = record.time, float(np.median(np.diff(record.time)))
    omega = 2.0 * np.pi * (record.excitation_frequency or 0.0)
    x, y = record.channels["hammer_displacement"], record.channels["cart_displacement"]
    amplitude, phase = _sine(t, y, omega) if omega else (0.0, 0.0)
    angle = omega * t + phase
    sine = amplitude * np.sin(angle)
    near = np.asarray(savgol_filter(x, _NARROW, 3)) - sine - record.gap
    contact, flight = near > _NEAR, near < -_NEAR
    smooth, rate = (_derivative(x, dt, order, flight) for order in range(2))
    u, v = smooth - sine, rate - amplitude * omega * np.cos(angle)
    delta = u - record.gap
    acceleration, sigma = _acceleration(record, x, dt, flight)
    inertia = -experiment.mass * acceleration
    sigma = np.where(contact, np.hypot(experiment.mass * sigma, _CURVE * np.abs(inertia).max()), experiment.mass * sigma)
    kept = contact | (flight & _clear(flight) & (np.arange(len(t)) % _KEPT == 0))
    load = record.channels.get("impact_force")
    wobble = np.asarray(savgol_filter(y - sine, _NARROW, 1))
    return Samples(
        number,
        omega,
        amplitude,
        t[kept],
        angle[kept],
        u[kept],
        v[kept],
        delta[kept],
        contact[kept],
        inertia[kept],
        sigma[kept],
        None if load is None else load[kept],
        record.noise.get("impact_force", 0.0),
        wobble[kept],
        _stretch(v, dt, amplitude or 1e-3)[kept],
    )


def _acceleration(record: Record, x: np.ndarray, dt: float, flight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the hammer, m/s^2, and its error."""
    if "hammer_acceleration" in record.channels:
        return record.channels["hammer_acceleration"], np.full(len(x), record.noise["hammer_acceleration"])
    errors = [np.sqrt(720.0 / width**5) * record.noise["hammer_displacement"] / dt**2 for width in (_NARROW, _WIDE)]
    return _derivative(x, dt, 2, flight), np.where(flight, errors[1], errors[0])


def _derivative(x: np.ndarray, dt: float, order: int, flight: np.ndarray) -> np.ndarray:
    """Of a smoothed displacement; the wide window in flight, where only samples with nothing but flight in it are kept."""
    narrow, wide = (np.asarray(savgol_filter(x, width, 3, deriv=order, delta=dt)) for width in (_NARROW, _WIDE))
    return np.where(flight, wide, narrow)


def _sine(t: np.ndarray, y: np.ndarray, omega: float) -> tuple[float, float]:
    """Amplitude and phase of the cart at the set frequency."""
    columns = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=1)
    a, b = np.linalg.lstsq(columns, y, rcond=None)[0]
    return float(np.hypot(a, b)), float(np.arctan2(b, a))


def _clear(flight: np.ndarray) -> np.ndarray:
    """Flight samples whose smoothing window holds flight only."""
    window = np.ones(_WIDE)
    return np.convolve(flight, window, mode="same") > 0.999 * np.convolve(np.ones(len(flight)), window, mode="same")


def _stretch(v: np.ndarray, dt: float, yields_at: float) -> np.ndarray:
    """Bouc-Wen's z along a known motion: z' = (v - |v| z / 2 - v |z| / 2) / yields_at, by explicit steps."""
    stretch, z = np.empty(len(v)), 0.0
    for i, rate in enumerate(v.tolist()):
        stretch[i] = z
        z += dt / yields_at * (rate - 0.5 * abs(rate) * z - 0.5 * rate * abs(z))
    return stretch
