"""Limits on request: the effects that a search may add to the model."""

from collections.abc import Collection, Sequence

from identification.experiment.errors import suggestion
from identification.wording.lists import joined
from vibrojax.effects import EFFECTS
from vibrojax.errors import InputError


def among_effects(only: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of the effects that may be added: `only` these, or all listed ones, `without` those.

    Raises:
        InputError: an unknown name, or none is left.

    Example:
        >>> among_effects(only=["hysteresis", "quadratic_drag"], without=["hysteresis"])
        ('quadratic_drag',)
    """
    for name in (*only, *without):
        if name not in EFFECTS:
            raise InputError(f"no effect is called {name!r}{suggestion(name, EFFECTS)}")
    found = tuple(name for name in EFFECTS if (name in only or not only) and name not in without)
    if not found:
        raise InputError("no effect is left to look for: expected at least one that is asked for and not excluded")
    return found


def limits(among: Collection[str]) -> tuple[str, ...]:
    """Warning for the reader of a diagnosis where the search was limited; empty otherwise."""
    absent = [name for name in EFFECTS if name not in among]
    if not absent:
        return ()
    only = len(among) < len(absent)
    text = f"nothing but {joined(list(among))} could be found" if only else f"{joined(absent)} could not be found"
    return (f"the search was limited on request: {text}",)
