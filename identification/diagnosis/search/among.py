"""Limits on request: the effects that a search may add to the model."""

from collections.abc import Collection, Sequence
from difflib import get_close_matches

from identification.diagnosis.diagnosis import LIMITED
from identification.wording.numbers import joined
from vibrojax.effects import EFFECTS
from vibrojax.errors import InputError


def among_effects(only: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of the effects that may be added: `only` these, or all listed ones, `without` those.

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
    found = tuple(name for name in EFFECTS if (name in only or not only) and name not in without)
    if not found:
        raise InputError(f"without {joined(list(without))} no effect is left to look for: exclude fewer of them")
    return found


def limit_warning(among: Collection[str]) -> tuple[str, ...]:
    """Warning for the reader of a diagnosis that did not look for all listed effects; empty otherwise."""
    absent = [name for name in EFFECTS if name not in among]
    if not absent:
        return ()
    names = [name for name in EFFECTS if name in among]
    text = f"only {joined(names)} could be named" if len(names) < len(absent) else f"{joined(absent)} could not be named"
    return (f"{LIMITED}: of the listed effects, {text}",)
