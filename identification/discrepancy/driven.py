"""Whether the hammer's motion drives what an effect's own states do."""

import numpy as np

from identification.discrepancy.continuity import sound_windows
from identification.discrepancy.refit import Fitted
from identification.discrepancy.signature import Course, own_states

_BY_ITSELF = 2.0
"""Own states that windows begin with over the largest driven ones in them, in root mean square, from which they ring by themselves: below 1
for what the motion drives."""


def rings_by_itself(fitted: Fitted, courses: tuple[Course, ...]) -> bool:
    """Whether the newest effect vibrates far more than the motion of the hammer makes it.

    Every window has initial states of its own, so that a light mass on a spring may stand in for any tone: a force that nothing in the
    records drives, and that no listed effect is. States that windows begin with are compared with the largest in the same window that
    follow from rest at the start of its record. What rang before a record began, and has not died down, is not told from a tone.

    Args:
        fitted: the model with the effect.
        courses: motions along the records, as fitted without it.
    """
    effect, prepared = fitted.model.effects[-1], fitted.prepared
    free = [index for index, state in enumerate(effect.own_states) if state.scale > 0]
    if not free or float(effect.fastest_hz) == 0:
        return False
    along = own_states(effect, courses)
    first, length = (np.concatenate([getattr(group, name) for group in prepared.groups]) for name in ("first", "lengths"))
    windows = zip(prepared.record, first, length, strict=True)
    driven = np.array([np.abs(along[record][begin : begin + count, free]).max(axis=0) for record, begin, count in windows])
    wanted, sound = fitted.outcome.estimate.states[:, -len(free) :], sound_windows(fitted)
    return bool(np.all(np.sum(wanted[sound] ** 2, axis=0) > _BY_ITSELF**2 * np.sum(driven[sound] ** 2, axis=0)))
