"""Whether the effects of a model are each of one strength, which the records tell."""

import numpy as np

from identification.discrepancy.diagnosis import Disagreement
from identification.discrepancy.disagreement import BY_CHANCE, disagreements
from identification.discrepancy.errors import numbers
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from vibrojax.model import MASS

_NO_CONSTANT = 0.25
"""Scatter between records, beyond their errors, or standard error, over the value from which a strength is none."""
_ANOTHER, _SURELY = 0.5, 6.0
"""What a record alone has it differ by from all together, over the value and over its own standard error, from which it is none either."""


def unsteady(fitted: Fitted, allowed: Tolerance) -> tuple[str, ...]:
    """Names of the model's effects, in the order in which they were found, that are none of one strength.

    A parameter is another one from record to record, or the records do not tell most of them.
    """
    differ = [one for one in disagreements(fitted, allowed) if one.chance < BY_CHANCE]
    values = fitted.model.values() | {MASS.name: fitted.model.mass}
    sizes = {one.name: abs(float(values[one.name])) for one in differ}
    loose = [one.name for one in differ if one.scatter > _NO_CONSTANT * sizes[one.name] or _is_another(one, sizes[one.name])]
    hardly = vague(fitted, allowed)
    return tuple(name for name in fitted.names if name in hardly or any(one.startswith(f"{name}.") for one in loose))


def _is_another(one: Disagreement, size: float) -> bool:
    """Whether some record alone surely tells quite another value, though too few do, or too vaguely, to make the scatter large."""
    value, stderr = np.array(list(one.records.values())).T
    off = np.abs(value - np.average(value, weights=stderr**-2.0))
    return bool(np.any((off > _ANOTHER * size) & (off > _SURELY * stderr)))


def vague(fitted: Fitted, allowed: Tolerance) -> tuple[str, ...]:
    """Effects of which less than half of the estimated parameters are known; of a stop, where it stands says enough.

    What each record has of its own, what was searched for, and what is held, is not asked for.
    """
    aside = {p.name for p in fitted.model.parameters if p.searched} | fitted.prepared.fixed.keys()
    estimated, found = [one for one in numbers(fitted, allowed) if one.name not in aside], []
    for effect in fitted.model.effects:
        own = [one for one in estimated if one.name.startswith(f"{effect.name}.")]
        known = [one for one in own if one.stderr is not None and one.stderr < _NO_CONSTANT * abs(one.value)]
        placed = effect.is_stop or any(one.name == f"{effect.name}.{effect.place}" for one in known)
        if not placed and 2 * len(known) < len(own):
            found.append(effect.name)
    return tuple(found)
