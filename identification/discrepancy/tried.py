"""What has been fitted beside a model is not fitted again where a search begins anew from there."""

import dataclasses
from collections.abc import Callable, Hashable

import numpy as np

from identification.discrepancy.memory import give_back
from identification.discrepancy.refit import Fitted
from vibrojax.errors import NoConvergenceError


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Attempt:
    beside: Fitted
    """Kept, so that no other model takes its identity."""
    fitted: Fitted | None
    limit: float
    """Cost up to which it would have been fitted."""


class Tried:
    """The fits of one diagnosis, each made once."""

    def __init__(self) -> None:
        self._attempts: dict[tuple[int, Hashable], _Attempt] = {}

    def has(self, beside: Fitted, what: Hashable) -> bool:
        """Whether it has been fitted, or given up, beside this very fit."""
        return (id(beside), what) in self._attempts

    def fitted(self, beside: Fitted, what: Hashable, limit: float, fit: Callable[[], Fitted | None]) -> Fitted | None:
        """The fit, made unless it has been; None where it is given up above `limit`, or cannot be integrated.

        What has been given up is fitted again where more is allowed now.
        """
        key = (id(beside), what)
        known = self._attempts.get(key)
        if known is not None and (known.fitted is not None or limit <= known.limit):
            return known.fitted
        try:
            made = _Attempt(beside=beside, fitted=fit(), limit=limit)
        except NoConvergenceError:
            made = _Attempt(beside=beside, fitted=None, limit=np.inf)
        finally:
            give_back()
        self._attempts[key] = made
        return made.fitted
