"""How a camera, an encoder and a laser read a displacement: autocorrelated errors, a curved characteristic, a tone, sampling jitter."""

import dataclasses

import numpy as np
from scipy.signal import lfilter


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sensor:
    """A displacement sensor, and the rigs that it observes.

    Attributes:
        rate: samples per second.
        natural: least and greatest natural frequency of these rigs, Hz.
        amplitude: of the first swing, m.
        periods: length of a record.
        counts: steps of a converter over the amplitude; 0 for none.
        forced: whether one record is pushed by a recorded force.
    """

    rate: float
    natural: tuple[float, float]
    amplitude: float
    periods: float
    counts: int
    forced: bool


_SETTLING = 1000
"""Samples before a record, in which its noise becomes stationary."""
SENSORS = {
    "video": Sensor(rate=30.0, natural=(0.4, 1.5), amplitude=0.2, periods=40.0, counts=0, forced=False),
    "encoder": Sensor(rate=200.0, natural=(0.6, 2.5), amplitude=0.1, periods=30.0, counts=4000, forced=True),
    "laser": Sensor(rate=1000.0, natural=(5.0, 20.0), amplitude=2e-3, periods=60.0, counts=0, forced=True),
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Errors:
    """Of one sensor in one experiment; sizes over the amplitude.

    Attributes:
        size: rms of an autoregressive error of the second order, 0.2 to 1 %.
        resonance: its frequency over the sampling rate.
        damping: its damping ratio.
        square, cube: of the characteristic at the amplitude; 0 in half of the experiments each.
        tone: amplitude of a tone, 0 in half of the experiments; its phase differs between records.
        tone_frequency: over the natural frequency.
        jitter: rms of the sampling instants over the interval.
    """

    size: float
    resonance: float
    damping: float
    square: float
    cube: float
    tone: float
    tone_frequency: float
    jitter: float


def drawn(rng: np.random.Generator) -> Errors:
    """Errors of one experiment."""
    return Errors(
        size=float(np.exp(rng.uniform(np.log(0.002), np.log(0.01)))),
        resonance=rng.uniform(0.1, 0.4),
        damping=rng.uniform(0.2, 0.8),
        square=rng.uniform(0.005, 0.02) * rng.choice([-1.0, 1.0]) * bool(rng.integers(2)),
        cube=rng.uniform(0.005, 0.02) * rng.choice([-1.0, 1.0]) * bool(rng.integers(2)),
        tone=rng.uniform(0.003, 0.01) * bool(rng.integers(2)),
        tone_frequency=rng.uniform(1.3, 4.0),
        jitter=rng.uniform(0.0, 0.05),
    )


def instants(sensor: Sensor, errors: Errors, samples: int, rng: np.random.Generator) -> np.ndarray:
    """Instants of the samples, s; the record gives even ones."""
    return (np.arange(samples) + errors.jitter * np.clip(rng.standard_normal(samples), -3.0, 3.0)) / sensor.rate


def read(sensor: Sensor, errors: Errors, tone: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Readings of displacements, m, without noise; `tone` is the angle of the tone at each, rad."""
    share = values / sensor.amplitude
    return sensor.amplitude * (share + errors.square * share**2 + errors.cube * share**3 + errors.tone * np.sin(tone))


def coloured(errors: Errors, samples: int, rng: np.random.Generator) -> np.ndarray:
    """Autoregression of the second order with the given resonance and damping, of unit variance."""
    noise = np.asarray(lfilter([1.0], prediction(errors), rng.standard_normal(samples + _SETTLING)))[_SETTLING:]
    return noise / np.std(noise)


def prediction(errors: Errors) -> list[float]:
    """Filter that whitens it."""
    angle = 2.0 * np.pi * errors.resonance
    radius, turn = np.exp(-angle * errors.damping), angle * np.sqrt(1.0 - errors.damping**2)
    return [1.0, float(-2.0 * radius * np.cos(turn)), float(radius**2)]
