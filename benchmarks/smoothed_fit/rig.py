"""The rig of the comparison: simulated records of a drop test and a driven cart for any compliant contact law."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from identification.estimation.simulate import simulate_record
from identification.experiment import Experiment, Record, Sensor, Suspension
from vibrojax.contact import LAWS, AbstractCompliantLaw, AbstractContactLaw
from vibrojax.model import Model
from vibrojax.suspension import Linear

NOISE = {"hammer_displacement": 1e-5, "cart_displacement": 1e-5, "hammer_acceleration": 0.05, "impact_force": 0.3}
"""Standard deviation of the white noise of each sensor, SI."""
_DT = 2.5e-4
_VALUES = {
    "hunt-crossley": {"k_i": 1e6, "n": 1.5, "lambda_i": 0.3},
    "hunt-crossley-separate": {"k_i": 1e6, "n": 1.5, "lambda_i": 0.3, "n_2": 1.5},
    "hertz": {"k_i": 1e6, "n": 1.5},
    "kelvin-voigt": {"k_i": 2e4, "lambda_i": 2e-4},
    "kelvin-voigt-clipped": {"k_i": 2e4, "lambda_i": 2e-4},
    "lankarani-nikravesh": {"k_i": 1e6, "n": 1.5, "e": 0.8},
    "flores": {"k_i": 1e6, "n": 1.5, "e": 0.8},
}
"""Parameters of the law that makes the records; others have the start values of the law."""


def compliant_laws() -> list[str]:
    """Names of all laws with a force that depends on a parameter."""
    return [name for name, law in LAWS.items() if issubclass(law, AbstractCompliantLaw) and law.parameters]


def true_model(law: str) -> Model:
    """The model that makes the records."""
    return Model(mass=0.5, suspension=Linear(damping_ratio=0.02, natural_frequency_hz=4.0), law=_law(law))


def simulated(law: str, *, samples: int, seed: int, noise: float = 1.0) -> Experiment:
    """An experiment whose records a model with this law has made, with white noise.

    Args:
        law: name.
        samples: of each record.
        seed: of the noise.
        noise: standard deviation over `NOISE`, which is what the sensors declare.
    """
    model = true_model(law)
    draws = np.random.default_rng(seed)
    drop: dict[str, Any] = {"gap": 0.0, "initial_displacement": -4e-3, "initial_velocity": 0.0}
    cart: dict[str, Any] = {"gap": 1e-3, "initial_displacement": 0.0, "initial_velocity": 0.0}
    cart |= {"base_amplitude": 2e-3, "base_phase": 0.3, "excitation_frequency": 6.0}
    time = _DT * np.arange(samples)
    records = [
        Record(file="drop.csv", kind="drop-test", time=time, **drop),
        Record(file="cart.csv", kind="cart-excitation", time=time, **cart),
    ]
    noisy = []
    for record in records:
        motion = simulate_record(model, record)
        channels = {name: motion[name] + noise * std * draws.standard_normal(samples) for name, std in NOISE.items()}
        noisy.append(dataclasses.replace(record, channels=channels, noise=dict(NOISE)))
    return Experiment(
        name=law,
        folder=Path("."),
        mass=0.5,
        suspension=Suspension(kind="linear"),
        law=law,
        records=tuple(noisy),
        sensors={name: Sensor(unit=None, noise=std) for name, std in NOISE.items()},
        sha256="",
    )


def _law(name: str) -> AbstractContactLaw:
    kind = LAWS[name]
    numbers: dict[str, Any] = {p.field: _VALUES.get(name, {}).get(p.name, p.start) for p in kind.parameters}
    return kind(**numbers)
