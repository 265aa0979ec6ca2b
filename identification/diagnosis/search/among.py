"""Limits on request: the effects that a search may add to the model."""

from collections.abc import Collection, Sequence
from difflib import get_close_matches

from identification.diagnosis.diagnosis import LIMITED
from identification.wording.numbers import joined
from vibrojax.effects import EFFECTS
from vibrojax.errors import InputError

ON_REQUEST = frozenset(
    (
        *("quintic_stiffness", "power_law_damping", "sensor_high_pass", "recorder_low_pass"),
        *("nonlinear_reading", "reading_tone", "clock_drift"),
    )
)
"""Listed effects that are looked for only where `only` names them: to score them takes every step of a search a third more time."""
SEARCHED = tuple(name for name in EFFECTS if name not in ON_REQUEST)
"""Those that are looked for unasked."""


def among_effects(only: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of the effects that may be added: `only` these, or all that are looked for unasked, `without` those.

    Raises:
        InputError: an unknown name, a single text in place of several names, or no effect is left.

    Example:
        >>> among_effects(only=["hysteresis", "quadratic_drag"], without=["hysteresis"])
        ('quadratic_drag',)
    """
    for given in (only, without):
        if isinstance(given, str):
            raise InputError(f"{given!r} is one text: expected a list of names of effects, such as [{given!r}]")
        for name in given:
            if name not in EFFECTS:
                near = get_close_matches(name, EFFECTS, n=1)
                expected = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(EFFECTS)}"
                raise InputError(f"no effect is called {name!r}: {expected}")
    found = tuple(name for name in EFFECTS if name in (only or SEARCHED) and name not in without)
    if not found:
        raise InputError(f"without {joined(list(without))} no effect is left to look for: exclude fewer of them")
    return found


def limit_warning(among: Collection[str]) -> tuple[str, ...]:
    """Warning for the reader of a diagnosis that did not look for all that it would unasked; empty otherwise."""
    absent = [name for name in SEARCHED if name not in among]
    if not absent:
        return ()
    names = [name for name in EFFECTS if name in among]
    text = f"only {joined(names)} could be named" if len(names) < len(absent) else f"{joined(absent)} could not be named"
    return (f"{LIMITED}: of the listed effects, {text}",)
