"""Whether the hammer's motion drives what an effect's own states do."""

import numpy as np

from identification.discrepancy.continuity import sound_windows, states_variance
from identification.discrepancy.refit import Fitted
from identification.discrepancy.signature import Course, own_states

_BY_ITSELF = 2.0
"""Own states that windows begin with over the largest driven ones in them, in root mean square, from which they ring by themselves: below 1
for what the motion drives."""
_TINY = np.finfo(float).tiny
_FOLLOWS = 0.15
"""Share of the own states that windows begin with, squared and beyond their errors, that what the motion drives must account for: 0.3 or
more in rigs with such a vibration, pushed by random forces too; less than 0.05 in two without one, in which it stood for these forces."""


def rings_by_itself(fitted: Fitted, courses: tuple[Course, ...]) -> bool:
    """Whether what the newest effect vibrates by is not what the hammer's motion makes it do.

    Every window has initial states of its own, so that a light mass on a spring may stand in for any tone, and for what random forces do
    to a rig: nothing in the records drives it, and no listed effect is that. States that windows begin with are compared with those that
    follow from rest at the start of their record: they ring by themselves where they are far larger than the largest of these in the same
    window, or, where no record begins, hardly nearer to these than to rest. What rang before a record began, and has not died down, is not
    told from a tone.

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
    windows = list(zip(prepared.record, first, length, strict=True))
    begin = np.array([along[record][at, free] for record, at, _ in windows])
    largest = np.array([np.abs(along[record][at : at + count, free]).max(axis=0) for record, at, count in windows])
    wanted, sound = fitted.outcome.estimate.states[:, -len(free) :], sound_windows(fitted)
    far_larger = np.all(np.sum(wanted[sound] ** 2, axis=0) > _BY_ITSELF**2 * np.sum(largest[sound] ** 2, axis=0))
    told = sound & (first > 0)  # what a record begins with was driven before it
    size, off = np.sum(wanted[told] ** 2, axis=0), np.sum((wanted[told] - begin[told]) ** 2, axis=0)
    errors = states_variance(fitted)[told, -len(free) :].sum(axis=0)
    least = (1.0 - _FOLLOWS) * size + _FOLLOWS * errors  # off - errors is so much of size - errors
    follows = np.sum(off / np.maximum(size, _TINY)) <= np.sum(least / np.maximum(size, _TINY))
    return bool(far_larger or not follows)
