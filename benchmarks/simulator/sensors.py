"""The simulator's sensor chain: white noise, then a 16-bit converter that saturates."""

import dataclasses
from collections.abc import Sequence

import numpy as np

_LEVELS = 2**15


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sensor:
    """One channel of the recorder."""

    channel: str
    noise: float
    """Standard deviation before the converter, SI; what the operator declares."""
    full_scale: float
    """The converter reads from minus this to plus this, SI."""
    unit: str
    per_si: float = 1.0
    """How many of `unit` make one SI unit."""
    digits: int = 7
    """Significant digits in the file."""

    def read(self, signal: np.ndarray, rng: np.random.Generator, *, ceiling: float = np.inf) -> np.ndarray:
        """What the recorder writes for a true signal in SI, in SI; an amplifier that saturates passes nothing above `ceiling`."""
        step = self.full_scale / _LEVELS
        noisy = np.minimum(signal + rng.normal(0.0, self.noise, signal.shape), ceiling)
        return step * np.clip(np.round(noisy / step), -_LEVELS, _LEVELS - 1)


def standard_sensors(*, force: bool = True, acceleration: bool = True) -> tuple[Sensor, ...]:
    """Displacements of hammer and cart, and the load cell and the accelerometer if wanted."""
    chosen: Sequence[Sensor] = (
        Sensor(channel="hammer_displacement", noise=1e-5, full_scale=0.1, unit="m"),
        Sensor(channel="cart_displacement", noise=1e-5, full_scale=0.1, unit="m"),
        Sensor(channel="impact_force", noise=0.15, full_scale=2000.0, unit="N", digits=4),
        Sensor(channel="hammer_acceleration", noise=0.05, full_scale=2000.0, unit="m/s^2", digits=4),
    )
    left_out = {"impact_force": not force, "hammer_acceleration": not acceleration}
    return tuple(sensor for sensor in chosen if not left_out.get(sensor.channel, False))
