"""First-order response of the channels to a small perturbation: variation of constants along the fitted motion."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from identification.likelihood.linearised import Linearised


@dataclasses.dataclass(frozen=True, kw_only=True)
class Perturbation:
    """Perturbation due to an effect along the fitted motion; each of shape (windows, time), SI; readings by channel."""

    force: np.ndarray
    """On the hammer, N."""
    stop_position: np.ndarray
    stop_velocity: np.ndarray
    base_displacement: np.ndarray
    base_acceleration: np.ndarray
    readings: dict[str, np.ndarray]
    """Additions of the sensors to their readings."""


def response(at: Linearised, mass: float, perturbation: Perturbation) -> Float[np.ndarray, "windows time channels"]:
    """First-order change of the residual due to a perturbation.

    dz(t) = X(t) int X(s)^-1 b(s) ds; z is the state (u, u' and the states of effects), X its derivative with respect to the initial one, b
    the added rates, linear from sample to sample. Initial states are free in every window, so dz starts from zero. Sampling limits the
    accuracy where a contact begins and ends.
    """
    p = perturbation
    moved_stop = at.push_by[..., 0] * p.stop_position + at.push_by[..., 1] * p.stop_velocity
    force = p.force + moved_stop
    rates = at.kick * force[..., None]
    rates[..., 1] -= p.base_acceleration
    rates = rates[:, None]
    shown = _shown(at, mass, rates, force[:, None], _constants(at, rates))
    added = dict(p.readings)
    for name, one in (
        ("impact_force", -moved_stop),
        ("hammer_displacement", p.base_displacement),
        ("cart_displacement", p.base_displacement),
        ("cart_acceleration", p.base_acceleration),
    ):
        added[name] = added.get(name, 0.0) + one
    shown |= {name: shown[name] + one[:, None] for name, one in added.items() if name in shown}
    return _residual(at, shown, 1)[:, 0]


def force_responses(
    at: Linearised, mass: float, forces: Float[np.ndarray, "windows forces time"]
) -> Float[np.ndarray, "windows forces time channels"]:
    """First-order change of the residual due to several forces on the hammer, N."""
    rates = at.kick[:, None] * forces[..., None]
    return _residual(at, _shown(at, mass, rates, forces, _constants(at, rates)), forces.shape[1])


def passing_forces(
    at: Linearised, mass: float, forces: Float[np.ndarray, "windows forces time"]
) -> tuple[Float[np.ndarray, "windows forces time channels"], Float[np.ndarray, "windows forces states"]]:
    """As `force_responses`, and the change of a window's initial state with the same motion as the forces give once they have acted."""
    rates = at.kick[:, None] * forces[..., None]
    constants = _constants(at, rates)
    shown = _shown(at, mass, rates, forces, constants)
    return _residual(at, shown, forces.shape[1]), np.stack([one[..., -1] for one in constants], axis=-1)


def state_responses(at: Linearised, mass: float) -> Float[np.ndarray, "windows states time channels"]:
    """First-order change of the residual due to a unit change of each initial value of a window."""
    moved = list(at.fundamental.transpose(2, 0, 3, 1))
    return _residual(at, _channels(at, mass, moved, np.zeros((len(at.u), 1, at.u.shape[1]))), len(moved))


def _shown(
    at: Linearised,
    mass: float,
    rates: Float[np.ndarray, "windows rows time states"],
    force: Float[np.ndarray, "windows rows time"],
    constants: Sequence[Float[np.ndarray, "windows rows time"]],
) -> dict[str, np.ndarray]:
    """First-order change of every recorded channel, (windows, rows or 1, time), due to added rates of the state.

    The rates include those of `force`; `constants` are theirs.
    """
    states = range(rates.shape[-1])
    moved = [np.asarray(sum(at.fundamental[:, None, :, i, j] * constants[j] for j in states)) for i in states]
    forgetful, transitions = at.forgetful
    if len(forgetful):
        stepped = _stepped(transitions, np.diff(at.ts[forgetful], axis=1), rates[forgetful])
        for i in states:
            moved[i][forgetful] = stepped[..., i]
    return _channels(at, mass, moved, force)


def _constants(at: Linearised, rates: Float[np.ndarray, "windows rows time states"]) -> list[Float[np.ndarray, "windows rows time"]]:
    """Components of int X^-1 b dt from the start of each window; X its fundamental matrix, b the added rates."""
    states = range(rates.shape[-1])
    pushed = [j for j in states if rates[..., j].any()]
    return [_integrated(at, rates, i, pushed) for i in states]


def _channels(at: Linearised, mass: float, moved: Sequence[np.ndarray], force: np.ndarray) -> dict[str, np.ndarray]:
    """Change of every recorded channel with that of every state and a force on the hammer; each (windows, rows or 1, time)."""

    def seen(by: Float[np.ndarray, "windows time states"]) -> np.ndarray:
        parts = [by[:, None, :, i] * one for i, one in enumerate(moved) if by[..., i].any()]
        return np.asarray(sum(parts)) if parts else np.zeros((len(by), 1, by.shape[1]))

    def acceleration() -> np.ndarray:
        return seen(at.restoring) + force / mass

    channels: dict[str, Callable[[], np.ndarray]] = {
        "relative_displacement": lambda: moved[0],
        "hammer_displacement": lambda: moved[0] + seen(at.cart_by[..., 0, :]),
        "cart_displacement": lambda: seen(at.cart_by[..., 0, :]),
        "hammer_acceleration": acceleration,
        "cart_acceleration": lambda: seen(at.cart_by[..., 1, :]),
        "impact_force": lambda: seen(at.push_by),
        "reaction_force": lambda: -mass * acceleration(),
    }
    return {name: channels[name]() for name in at.channels}


def _stepped(
    transitions: Float[np.ndarray, "windows steps states states"],
    steps: Float[np.ndarray, "windows steps"],
    rates: Float[np.ndarray, "windows rows time states"],
) -> Float[np.ndarray, "windows rows time states"]:
    """State from zero under added rates, from sample to sample by the trapezoidal rule."""
    found, half = np.zeros(rates.shape), 0.5 * steps[:, None, :, None]
    for k in range(steps.shape[1]):
        before = found[:, :, k] + half[:, :, k] * rates[:, :, k]
        found[:, :, k + 1] = before @ transitions[:, k].transpose(0, 2, 1) + half[:, :, k] * rates[:, :, k + 1]
    return found


def _residual(at: Linearised, shown: dict[str, np.ndarray], rows: int) -> Float[np.ndarray, "windows rows time channels"]:
    """Change of the residual: minus that of the channels, over the noise; each channel is contiguous in memory."""
    found = np.moveaxis(np.empty((len(at.u), rows, len(at.channels), at.u.shape[1])), -2, -1)
    for c, name in enumerate(at.channels):
        np.multiply(shown[name], -at.weight[:, None, :, c], out=found[..., c])
    return found


def _integrated(
    at: Linearised, rates: Float[np.ndarray, "windows rows time states"], i: int, pushed: Sequence[int]
) -> Float[np.ndarray, "windows rows time"]:
    """Component i of int X^-1 b dt from the start of each window; only the components `pushed` of b are not zero."""
    before, after = at.quadrature
    found = np.zeros(rates.shape[:-1])
    for j in pushed:
        found[..., 1:] += before[:, None, :, i, j] * rates[..., :-1, j] + after[:, None, :, i, j] * rates[..., 1:, j]
    np.cumsum(found, axis=-1, out=found)
    return found
