"""How fast things are in an experiment, as fitted."""

import jax.numpy as jnp
import numpy as np

from identification.discrepancy.linearised import Linearised
from identification.prepare import Prepared
from vibrojax.contact import AbstractCompliantLaw

_LONGEST_S = 1.5e-3
_OF_CONTACT, _OF_PERIOD = 1 / 3, 1 / 24


def contact_time(prepared: Prepared, at: Linearised, mass: float) -> float:
    """Duration of an impact at the largest speed, s; NaN without impacts, and where the contact law gives them no duration."""
    law, inside = prepared.model.law, np.arange(at.u.shape[1]) < at.lengths[:, None]
    speed = float(np.abs(at.v[inside]).max())
    if not isinstance(law, AbstractCompliantLaw) or not np.any(at.push[inside] > 0) or speed == 0:
        return np.nan
    found = float(law.contact_time(jnp.asarray(mass), jnp.asarray(speed)))
    return found if np.isfinite(found) else np.nan


def resolution(prepared: Prepared, at: Linearised, mass: float) -> float:
    """Half width of a local average that blurs neither a contact nor the vibration, s."""
    f_n = float(prepared.model.values().get("f_n", 0.0))
    scales = (_LONGEST_S, _OF_CONTACT * contact_time(prepared, at, mass), _OF_PERIOD / f_n if f_n > 0 else np.nan)
    return float(np.nanmin(scales))
