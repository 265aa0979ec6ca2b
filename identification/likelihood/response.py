"""What the records would show of a small perturbation: variation of constants along the fitted motion."""

import dataclasses

import numpy as np
from jaxtyping import Float

from identification.likelihood.linearised import Linearised


@dataclasses.dataclass(frozen=True, kw_only=True)
class Perturbation:
    """What an effect does along the fitted motion; each of shape (windows, time), SI; readings by channel."""

    force: np.ndarray
    """On the hammer, N."""
    stop_position: np.ndarray
    stop_velocity: np.ndarray
    base_displacement: np.ndarray
    base_acceleration: np.ndarray
    readings: dict[str, np.ndarray]
    """What sensors add of their own."""


def response(at: Linearised, mass: float, perturbation: Perturbation) -> Float[np.ndarray, "windows time channels"]:
    """Change of the residual, to first order.

    (du, du')(t) = X(t) int X(s)^-1 (0, b(s)) ds with X the derivative of the motion in its initial state and b the added
    acceleration; initial states are free in every window, so it starts from zero. Sampling limits its accuracy inside contacts.
    """
    p = perturbation
    moved_stop = at.stiffness * p.stop_position + at.damping * p.stop_velocity
    added = (p.force + moved_stop) / mass - p.base_acceleration
    x = at.fundamental
    determinant = x[..., 0, 0] * x[..., 1, 1] - x[..., 0, 1] * x[..., 1, 0]
    safe = np.where(np.abs(determinant) > 1e-9, determinant, np.inf)
    pulled = np.stack([-x[..., 0, 1] * added, x[..., 0, 0] * added], axis=-1) / safe[..., None]
    dt = np.diff(at.ts, axis=1)[..., None]
    constants = np.concatenate([np.zeros_like(pulled[:, :1]), np.cumsum(0.5 * dt * (pulled[:, 1:] + pulled[:, :-1]), axis=1)], axis=1)
    du = x[..., 0, 0] * constants[..., 0] + x[..., 0, 1] * constants[..., 1]
    dv = x[..., 1, 0] * constants[..., 0] + x[..., 1, 1] * constants[..., 1]
    shown = {
        "relative_displacement": du,
        "hammer_displacement": du + p.base_displacement,
        "cart_displacement": p.base_displacement,
        "hammer_acceleration": at.restoring[..., 0] * du + at.restoring[..., 1] * dv + added + p.base_acceleration,
        "cart_acceleration": p.base_acceleration,
        "impact_force": at.stiffness * du + at.damping * dv - moved_stop,
    }
    shown["reaction_force"] = -mass * shown["hammer_acceleration"]
    columns = [shown[name] + p.readings.get(name, 0.0) for name in at.channels]
    return np.where(at.weight > 0, -np.stack(columns, axis=-1) * at.weight, 0.0)
