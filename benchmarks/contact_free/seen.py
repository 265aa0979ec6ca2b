"""A rig without a stop that a camera, an encoder or a laser observes: three swings with viscous damping and another loss."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.contact_free.sensors import SENSORS, Errors, Sensor, coloured, drawn, instants, read
from benchmarks.simulator import kernel

NO_STOP = 1e3
"""Gap, m."""
_PUSH = 0.05
"""Rms of a push over the spring's force at the amplitude."""
_FINEST = 200.0
"""Samples in a period between which the path is a cubic."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Seen:
    """A rig, its sensor, and what happens in its records.

    Attributes:
        sensor, errors: that observe it.
        f_n: natural frequency, Hz.
        rig, loss: parameters of the simulator, SI.
        starts: displacement at the beginning of each record, m; 0 where it is pushed.
        pushes: applied force by record, N, at the even samples.
        instants: at which the sensor reads, s, by record.
        phases: of the tone, by record.
    """

    sensor: Sensor
    errors: Errors
    f_n: float
    rig: dict[str, float]
    loss: dict[str, float]
    starts: tuple[float, ...]
    pushes: tuple[np.ndarray, ...]
    instants: tuple[np.ndarray, ...]
    phases: tuple[float, ...]

    def path(self, record: int, velocity: float = 0.0) -> np.ndarray:
        """Displacement at the sensor's instants, m, from a start with some velocity, m/s."""
        rate = self.sensor.rate * int(np.ceil(max(1.0, _FINEST * self.f_n / self.sensor.rate)))
        count = round(len(self.pushes[record]) * rate / self.sensor.rate)
        vector = kernel.vector(force=np.append([0.0, 1.0 / self.sensor.rate], self.pushes[record]), **self.rig, **self.loss)
        states, _, _ = kernel.sampled(0.0, 1.0 / rate, count, np.array([self.starts[record], velocity]), vector)
        return CubicSpline(np.arange(count) / rate, states[:, kernel.X])(self.instants[record])

    def readings(self, record: int, velocity: float = 0.0) -> np.ndarray:
        """What the sensor shows of it without noise, m."""
        angle = 2.0 * np.pi * self.errors.tone_frequency * self.f_n * self.instants[record] + self.phases[record]
        return read(self.sensor, self.errors, angle, self.path(record, velocity))


def draw_seen(kind: str, loss: str | None, rng: np.random.Generator) -> Seen:
    """A rig for one of `SENSORS`."""
    sensor, errors = SENSORS[kind], drawn(rng)
    mass, f_n, zeta = rng.uniform(0.3, 3.0), float(np.exp(rng.uniform(*np.log(sensor.natural)))), rng.uniform(0.002, 0.006)
    omega, amplitude = 2.0 * np.pi * f_n, sensor.amplitude
    damping, samples = 2.0 * zeta * mass * omega, int(sensor.periods / f_n * sensor.rate)
    starts = (amplitude, amplitude * rng.uniform(0.4, 0.8), 0.0 if sensor.forced else amplitude * rng.uniform(0.2, 0.4))
    even = np.arange(samples) / sensor.rate
    pushes = [np.zeros(samples) if start else multisine(rng, even, f_n, _PUSH * mass * omega**2 * amplitude) for start in starts]
    return Seen(
        sensor=sensor,
        errors=errors,
        f_n=f_n,
        rig={"m": mass, "gap": NO_STOP, "k": mass * omega**2, "c": damping},
        loss=_loss(rng, loss, damping, amplitude * omega),
        starts=starts,
        pushes=tuple(pushes),
        instants=tuple(instants(sensor, errors, samples, rng) for _ in starts),
        phases=tuple(rng.uniform(0.0, 2.0 * np.pi, len(starts))),
    )


def write_seen(folder: Path, name: str, seen: Seen, rng: np.random.Generator) -> dict:
    """Write the records as an experiment that states no noise; return what is concealed, SI."""
    sensor, errors = seen.sensor, seen.errors
    lines = ["schema = 1", "", "[experiment]", f'name = "{name}"', "", "[hammer]", f"mass = {seen.rig['m']:.17g}"]
    lines += ["", "[suspension]", 'kind = "linear"', "", "[contact]", 'law = "none"']
    for channel, unit in (("hammer_displacement", "m"), *((("applied_force", "N"),) if sensor.forced else ())):
        lines += ["", f"[sensors.{channel}]", f'unit = "{unit}"']
    for record, start in enumerate(seen.starts):
        found = seen.readings(record) / sensor.amplitude + errors.size * coloured(errors, len(seen.pushes[record]), rng)
        found = np.round(found * sensor.counts) / sensor.counts if sensor.counts else found
        columns: dict[str, Any] = {"time": np.arange(len(found)) / sensor.rate, "hammer_displacement": sensor.amplitude * found}
        columns |= {"applied_force": seen.pushes[record]} if sensor.forced else {}
        np.savez_compressed(folder / f"record{record + 1}.npz", **columns)
        kind = "free-decay" if start else "forced"
        lines += ["", "[[record]]", f'file = "record{record + 1}.npz"', f'kind = "{kind}"', f"gap = {NO_STOP}"]
    (folder / "experiment.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return {"rig": seen.rig | {"f_n": seen.f_n}, "effect": seen.loss, "errors": dataclasses.asdict(errors)}


def multisine(rng: np.random.Generator, time: np.ndarray, f_n: float, rms: float) -> np.ndarray:
    """Ten lines of equal height from 0.3 to 3 f_n."""
    found = np.zeros(len(time))
    for frequency in np.geomspace(0.3, 3.0, 10) * f_n:
        found += np.cos(2.0 * np.pi * frequency * time + rng.uniform(0.0, 2.0 * np.pi))
    return rms * found / np.sqrt(np.mean(found**2))


def _loss(rng: np.random.Generator, effect: str | None, damping: float, speed: float) -> dict[str, float]:
    """A loss that takes 0.5 to 2 times what the damper takes in the first swing (equivalent linearisation)."""
    force = float(rng.uniform(0.5, 2.0)) * damping * speed
    match effect:
        case None:
            return {}
        case "coulomb_friction":
            return {"friction_force": np.pi / 4.0 * force, "friction_speed": 1e-3 * speed}
        case "quadratic_drag":
            return {"drag": 3.0 * np.pi / 8.0 * force / speed**2}
        case "power_law_damping":
            exponent = float(rng.choice([0.5, 1.5]))
            return {"power_loss": force / speed**exponent, "power_exponent": exponent, "power_speed": 1e-3 * speed}
        case _:
            raise ValueError(f"no loss is called {effect!r}: expected one of CONCEALED")
