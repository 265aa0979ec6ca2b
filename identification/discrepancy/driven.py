"""Whether the hammer's motion drives what an effect's own states do."""

import numpy as np

from identification.discrepancy.refit import Fitted
from identification.discrepancy.signature import Course, own_states

_BY_ITSELF = 2.5
"""Root mean square of own states over that of driven ones from which they ring by themselves; about 1 for what the motion drives."""


def rings_by_itself(fitted: Fitted, courses: tuple[Course, ...]) -> bool:
    """Whether the newest effect vibrates far more than the motion of the hammer makes it.

    Every window has initial states of its own, so that a light mass on a spring may stand in for any tone: a force that nothing in the
    records drives, and that no listed effect is. States that the fit wants are compared with those that follow from rest at the start of
    every record.

    Args:
        fitted: the model with the effect.
        courses: motions along the records, as fitted without it.
    """
    effect = fitted.model.effects[-1]
    free = [index for index, state in enumerate(effect.own_states) if state.scale > 0]
    if not free or float(effect.fastest_hz) == 0:
        return False
    wanted = fitted.outcome.estimate.states[:, -len(free) :]
    driven = [own[:, free] for own in own_states(effect, courses)]
    records = np.unique(fitted.prepared.record)
    usual = np.sqrt(np.mean([np.mean(driven[record] ** 2, axis=0) for record in records], axis=0))
    return bool(np.all(np.sqrt(np.mean(wanted**2, axis=0)) > _BY_ITSELF * usual))
