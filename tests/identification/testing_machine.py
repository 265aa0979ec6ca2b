"""Records of a testing machine, written down in closed form."""

from pathlib import Path

import numpy as np

from identification.experiment import Experiment, Record, Suspension

STIFFNESS, DAMPING, MASS = 4000.0, 60.0, 10.0
"""The mass moves nothing in a prescribed record: it only turns k and c into f_n and zeta."""
K_I, N, LAMBDA_I, GAP = 3e5, 1.5, 0.5, 6e-3
NOISE = {"relative_displacement": 2e-7, "reaction_force": 0.2}


def machine(frequency: float, seed: int) -> Record:
    """A sine of 8 mm into a Hunt-Crossley stop, written down in closed form; the stop stands 0.1 mm behind its setting."""
    time = np.arange(1500) / 500.0
    u, v = 8e-3 * np.sin(2 * np.pi * frequency * time), 8e-3 * 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * time)
    delta = np.maximum(u - GAP - 1e-4, 0.0)
    force = STIFFNESS * u + DAMPING * v + np.maximum(K_I * delta**N * (1.0 + LAMBDA_I * v), 0.0)
    rng = np.random.default_rng(seed)
    clean = {"relative_displacement": u, "reaction_force": force}
    channels = {name: values + NOISE[name] * rng.standard_normal(1500) for name, values in clean.items()}
    return Record(file=f"sine-{seed}.csv", kind="prescribed", gap=GAP, time=time, channels=channels, noise=NOISE)


def experiment(*records: Record, law: str | None = None) -> Experiment:
    return Experiment(name="machine", folder=Path(), mass=MASS, suspension=Suspension(kind="linear"), law=law, records=records, sha256="")
