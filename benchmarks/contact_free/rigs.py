"""Rigs without a stop: a mass on a spring, or one that rolls freely; let go twice, then pushed by a recorded force.

Two kinds are seen by an ideal sensor with white noise, the others by a real one (`seen`).
"""

import dataclasses
import zlib
from pathlib import Path

import numpy as np

from benchmarks.contact_free.seen import NO_STOP, draw_seen, multisine, write_seen
from benchmarks.contact_free.sensors import SENSORS
from benchmarks.simulator import kernel

STEP = 2e-3
"""Sampling interval, s."""
_SAMPLES = 4001
_NOISE = {"hammer_displacement": 1e-5, "applied_force": 2e-3}
"""Standard deviations of the sensors' noise, m and N."""
_FRICTION_SPEED = 1e-4
"""Speed, m/s, at which simulated dry friction reaches 76 % of its force."""
_SERIES = 61_007
"""First word of every seed here: no other simulated experiment is drawn with it."""
CONCEALED = {
    "sprung": ("coulomb_friction", "quadratic_drag", "constant_force", "cubic_stiffness"),
    "unsprung": ("coulomb_friction", "quadratic_drag", "constant_force"),
    **dict.fromkeys(SENSORS, ("coulomb_friction", "quadratic_drag", "power_law_damping")),
}
"""Effects by kind of rig; without a spring there is none that could harden. Real sensors look at losses."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """One rig.

    Attributes:
        kind: of `CONCEALED`.
        effect: concealed; None for a complete rig.
        seed: of the series.
        index: among the rigs of this kind and effect.
    """

    kind: str
    effect: str | None
    seed: int
    index: int

    @property
    def key(self) -> str:
        """Its name among all."""
        return f"{self.kind}-{self.effect or 'complete'}-{self.seed}-{self.index:03d}"


def write_rig(folder: Path, job: Job) -> dict:
    """Simulate the three records of a rig into `folder`, with their `experiment.toml`; return what is concealed, SI."""
    rng = np.random.default_rng([_SERIES, zlib.crc32(job.key.encode("ascii"))])
    if job.kind in SENSORS:
        return write_seen(folder, job.key, draw_seen(job.kind, job.effect, rng), rng)
    mass, f_n, zeta = rng.uniform(0.3, 0.6), rng.uniform(1.6, 6.4), rng.uniform(0.006, 0.015)
    omega = 2.0 * np.pi * f_n
    sprung = job.kind == "sprung"
    nominal = {"m": mass, "gap": NO_STOP, "k": mass * omega**2 * sprung, "c": 2.0 * zeta * mass * omega * sprung}
    starts = [(rng.uniform(5e-3, 8e-3), 0.0), (-rng.uniform(3e-3, 5e-3), 0.0)] if sprung else [(0.0, 0.3), (0.0, -0.15)]
    effect = _effect(rng, job, mass, omega)
    lines = ["schema = 1", "", "[experiment]", f'name = "{job.key}"', "", "[hammer]", f"mass = {mass:.17g}", "", "[suspension]"]
    lines += [f'kind = "{"linear" if sprung else "free"}"', "", "[contact]", 'law = "none"']
    for channel, unit in (("hammer_displacement", "m"), ("applied_force", "N")):
        lines += ["", f"[sensors.{channel}]", f'unit = "{unit}"', f"noise = {_NOISE[channel]}"]
    for number, start in enumerate((*starts, (0.0, 0.0)), start=1):
        push = _push(rng, mass, f_n if sprung else 1.0, (omega**2 * 4e-3 * 0.1) if sprung else 0.5) if number == 3 else None
        force = np.zeros(_SAMPLES) if push is None else push
        vector = kernel.vector(force=np.append([0.0, STEP], force), **nominal, **effect)
        states, _, _ = kernel.sampled(0.0, STEP, _SAMPLES, np.array(start), vector)
        columns = {"time": STEP * np.arange(_SAMPLES), "hammer_displacement": states[:, kernel.X]}
        columns |= {} if push is None else {"applied_force": push}
        noisy = {name: values + rng.normal(0.0, _NOISE.get(name, 0.0), len(values)) for name, values in columns.items()}
        np.savez_compressed(folder / f"record{number}.npz", **noisy)
        kind = "free-decay" if push is None else "forced"
        lines += ["", "[[record]]", f'file = "record{number}.npz"', f'kind = "{kind}"', f"gap = {NO_STOP}"]
    (folder / "experiment.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return effect


def _effect(rng: np.random.Generator, job: Job, mass: float, omega: float) -> dict[str, float]:
    """Parameters of the concealed effect: 2 to 6 % of the spring's force at 5 mm; without a spring, 0.02 to 0.06 m/s^2."""
    if job.effect is None:
        return {}
    size = rng.uniform(0.02, 0.06)
    amplitude, speed = (5e-3, 5e-3 * omega) if job.kind == "sprung" else (0.1, 0.2)
    force = mass * size * (omega**2 * amplitude if job.kind == "sprung" else 1.0)
    return {
        "coulomb_friction": {"friction_force": force, "friction_speed": _FRICTION_SPEED},
        "quadratic_drag": {"drag": force / speed**2},
        "constant_force": {"constant_force": force},
        "cubic_stiffness": {"cubic": force / amplitude**3},
    }[job.effect]


def _push(rng: np.random.Generator, mass: float, f_n: float, acceleration: float) -> np.ndarray:
    """Multisine of ten lines from 0.3 to 3 f_n, N, with the given rms acceleration of the mass."""
    return multisine(rng, STEP * np.arange(_SAMPLES), f_n, mass * acceleration)
