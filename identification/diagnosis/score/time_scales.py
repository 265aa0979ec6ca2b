"""Time scales of an experiment, as fitted."""

import jax.numpy as jnp
import numpy as np

from identification.likelihood.linearised import Linearised
from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw

_LONGEST_S = 1.5e-3
"""Largest half width of a local average, s."""
_OF_CONTACT, _OF_PERIOD = 1 / 3, 1 / 24
"""Largest half width of a local average over the duration of a contact, and over the period of the vibration."""


def contact_time(law: AbstractContactLaw, at: Linearised, mass: float) -> float:
    """Duration of an impact at the largest speed, s; NaN without impacts, or where the contact law gives them no duration."""
    speed = float(np.abs(at.v[at.inside]).max())
    if not isinstance(law, AbstractCompliantLaw) or not np.any(at.push[at.inside] > 0) or speed == 0:
        return np.nan
    found = float(law.contact_time(jnp.asarray(mass), jnp.asarray(speed)))
    return found if np.isfinite(found) else np.nan


def resolution(at: Linearised) -> float:
    """Half width of a local average that resolves contact and vibration, s."""
    scales = [_LONGEST_S]
    contact, interval = at.in_contact & at.inside, float(np.median(np.diff(at.ts[:, :2], axis=1)))
    if touches := int(np.sum(contact[:, 1:] & ~contact[:, :-1])):
        scales.append(_OF_CONTACT * interval * float(contact.sum()) / touches)
    flight = at.inside & ~at.in_contact
    stiffness = -float(np.median(at.restoring[..., 0][flight])) if flight.any() else 0.0
    if stiffness > 0:
        scales.append(_OF_PERIOD * 2.0 * np.pi / np.sqrt(stiffness))
    return float(min(scales))
