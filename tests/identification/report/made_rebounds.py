"""Records of single collisions in closed form, beside a fitted motion that leaves the stop at another speed."""

import numpy as np

from identification.result.result import RecordFit
from vibrojax.contact import HuntCrossley
from vibrojax.model import Model
from vibrojax.suspension import Free, Linear

DT, NOISE, CONTACT = 5e-4, 1e-6, 8
"""s; m; samples."""
LAW = HuntCrossley(impact_stiffness=1e6, impact_exponent=1.5, impact_damping=0.5)
"""Which the fitted motions here know nothing of."""
ON_A_SPRING = Model(mass=0.5, suspension=Linear(damping_ratio=0.02, natural_frequency_hz=6.0), law=LAW)
FREE = Model(mass=0.5, suspension=Free(), law=LAW)


def collision(
    speed: float,
    measured: float,
    fitted: float,
    *,
    model: Model = ON_A_SPRING,
    samples: int = 120,
    seed: int = 0,
    channel: str = "",
    contact: int = CONTACT,
) -> RecordFit:
    """Flight at `speed` to the stop at u = 0 and back: recorded with one restitution, fitted with another and 2 % too fast."""
    middle = samples // 2
    t = DT * (np.arange(samples) - middle)
    channel = channel or "relative_displacement"
    (u, _), (shown, rate) = (_flown(t, v, ratio, model, DT * contact) for v, ratio in ((speed, measured), (1.02 * speed, fitted)))
    noisy = u + NOISE * np.random.default_rng(seed).standard_normal(samples)
    in_contact = np.zeros(samples, bool)
    in_contact[middle + 1 : middle + contact] = True
    return RecordFit(
        file=f"at-{speed:g}.csv",
        kind="drop-test",
        gap=0.0,
        nuisances=(),
        time=t + 1.0,
        measured={channel: noisy},
        predicted={channel: shown, "relative_displacement": shown},
        noise={channel: NOISE},
        nrmse={channel: 0.1},
        chi2_reduced={channel: 10.0},
        relative_displacement=shown,
        relative_velocity=rate,
        in_contact=in_contact,
        window=np.zeros(samples, int),
    )


def _flown(t: np.ndarray, speed: float, restitution: float, model: Model, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity, at zero with `speed` when contact begins and minus `restitution` times that at its `end`, s.

    In contact the hammer stands still here, and its velocity changes evenly.
    """
    values = model.values()
    omega, zeta = 2 * np.pi * values.get("f_n", 0.0), values.get("zeta", 0.0)
    since = np.where(t <= 0, t, np.maximum(t - end, 0.0))
    begin = np.where(t <= 0, speed, -restitution * speed)
    damped = omega * np.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * omega * since)
    u = begin * decay * (np.sin(damped * since) / damped if omega else since)
    v = begin * decay * (np.cos(damped * since) - zeta * omega * np.sin(damped * since) / damped if omega else np.ones_like(since))
    return u, np.where((t > 0) & (t < end), speed - (1.0 + restitution) * speed * t / max(end, DT), v)
