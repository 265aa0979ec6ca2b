"""What was done in a record, guessed from its channels."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from identification.experiment.noise import estimate_noise
from identification.experiment.plausibility.impulses import CONTACT
from identification.experiment.plausibility.sine import Sine, fit_sine
from identification.inspection.mapping import Mapped, is_angle

AT_REST = 5.0
"""Noises: a channel whose standard deviation is less stands still."""
REST_SHARE = 0.02
"""Of the hammer's standard deviation: a cart that moves less stands still, though impacts shake it."""
IMPACT_ACCELERATION = 10.0
"""Typical deviations that an acceleration reaches in an impact."""
PULL_SHARE, FEWEST_PULLS = 0.2, 2
"""Of the deepest pull, which a force passes in an impact; and how many impacts, for one may be a glitch."""
SINE_SHARE = 0.5


@dataclass(frozen=True, kw_only=True)
class Guess:
    """The guessed kind of a record.

    Attributes:
        kind: one of the experiment's kinds.
        why: a sentence.
        sine: of the cart, for a harmonic excitation.
        impacts: whether impacts are seen; None where no channel shows it.
        measured: whether the recorded cart motion had better drive the model, because it is no sine.
    """

    kind: str
    why: str
    sine: Sine | None = None
    measured: bool = False
    impacts: bool | None = None


def guess_kind(seconds: Float64[np.ndarray, " samples"], mapped: tuple[Mapped, ...]) -> Guess:
    """Guess the kind of a record.

    Args:
        seconds: time stamps, shape (samples,).
        mapped: its channels.

    Returns:
        The guess and its reason.
    """
    channels = {one.channel: one.column.values * one.factor for one in mapped}
    for name in ("cart_displacement", "cart_acceleration"):
        if name in channels and _moves(channels[name], channels.get(name.replace("cart", "hammer"))):
            return _excited(seconds, channels[name], name)
    impacts = _impacts(channels)
    if "applied_force" in channels and _moves(channels["applied_force"], None):
        return Guess(kind="forced", why="an applied force is recorded and no cart moves", impacts=impacts)
    cart = any(name.startswith("cart") for name in channels)
    rest = "the cart is at rest" if cart else "no motion of a cart is recorded"
    if impacts is None and "relative_displacement" in channels and not cart and any(map(is_angle, mapped)):
        return Guess(kind="free-decay", why=f"{rest}, and an angle is")
    if impacts is None:
        return Guess(kind="drop-test", why=f"{rest}; these channels do not show whether impacts occur")
    if impacts:
        return Guess(kind="drop-test", why=f"{rest} and impacts occur")
    return Guess(kind="free-decay", why=f"{rest} and no impact is seen", impacts=False)


def _excited(seconds: np.ndarray, cart: np.ndarray, name: str) -> Guess:
    """A moving cart: a sine, or not."""
    sine = fit_sine(seconds, cart)
    if sine is None or sine.share < SINE_SHARE:
        share = 0.0 if sine is None else sine.share
        why = f"{name} moves, but a sine explains only {100 * share:.0f} % of it: its recorded motion had better drive the model"
        return Guess(kind="cart-excitation", why=why, measured=True)
    why = f"{name} is a sine to {100 * sine.share:.4g} %, of {sine.frequency:.7g} Hz, standard error {sine.stderr:.1g} Hz"
    return Guess(kind="cart-excitation", why=why, sine=sine)


def _moves(values: np.ndarray, beside: np.ndarray | None) -> bool:
    """Whether a channel is more than noise, and more than a trace of what happens beside it."""
    spread = float(np.nanstd(values)) if np.isfinite(values).any() else 0.0
    noise = estimate_noise(np.where(np.isfinite(values), values, np.nan)) or 0.0
    trace = 0.0 if beside is None or not np.isfinite(beside).any() else REST_SHARE * float(np.nanstd(beside))
    return spread > max(AT_REST * noise, trace)


def reads_pulls(one: Mapped) -> bool:
    """Whether a channel is a load cell that reads impacts as pulls.

    Args:
        one: a channel of a record.

    Returns:
        False for other channels, and where no impact is seen.
    """
    force = one.column.values
    if one.channel != "impact_force" or not np.isfinite(force).any():
        return False
    level = max(PULL_SHARE * float(np.nanmax(-force)), _contact(force))
    pulls, pushes = (int(np.sum(np.diff((signed > level).astype(int)) == 1)) for signed in (-force, force))
    return pulls >= FEWEST_PULLS and pulls > pushes


def _contact(force: np.ndarray) -> float:
    """The force beyond which a load cell feels a contact, above its noise."""
    return CONTACT * (estimate_noise(np.where(np.isfinite(force), force, np.nan)) or 0.0)


def _impacts(channels: dict[str, np.ndarray]) -> bool | None:
    """Whether impacts occur; None where no channel shows it."""
    force = channels.get("impact_force")
    if force is not None and np.isfinite(force).any():
        off = np.abs(force - np.nanmedian(force))
        return float(np.nanmax(off)) > _contact(force)
    acceleration = channels.get("hammer_acceleration")
    if acceleration is not None and np.isfinite(acceleration).any():
        off = np.abs(acceleration - np.nanmedian(acceleration))
        return float(np.nanmax(off)) > IMPACT_ACCELERATION * float(np.nanmedian(off))
    return None
