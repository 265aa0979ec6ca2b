"""From the search to a verdict: listed effects, a learned term, or nothing."""

import dataclasses
from collections.abc import Callable

from identification.discrepancy.diagnosis import ADEQUATE, MISSING, UNLISTED
from identification.discrepancy.prune import pruned
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import BUDGET, MOSTLY, Search
from identification.discrepancy.steadiness import ADDS, steadily

_FINDING = 0.5
"""Share of the misfit that a learned term must explain to be shown."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Explanation:
    """What the verdict rests on.

    Attributes:
        verdict: `ADEQUATE`, `MISSING` or `UNLISTED`.
        fitted: the model that explains most, fitted.
        formula: of a learned term; empty where there is none.
        share: of the misfit beyond noise, that the asserted effects explain; 1 where what they leave is noise or a trifle.
    """

    verdict: str
    fitted: Fitted
    formula: str = ""
    share: float = 1.0


def explanation(start: Fitted, found: Search, allowed: Tolerance, *, progress: Callable[[str], None] = lambda stage: None) -> Explanation:
    """Listed effects that leave nothing but noise; else those that leave little, if no learned term leaves much less; else a learned term.

    A real rig never repeats itself exactly, and no effect is modelled to the last digit: what is left is then more than the sensors'
    noise although the cause has been found. A cause that is not listed shows in that a term free in its form explains more, by a share that
    would be asserted of a further effect.

    Args:
        start: the nominal model, where the search began.
        found: by the search.
        allowed: tolerance of its windows.
        progress: told each stage.
    """
    if found.explained and not found.fitted.names:
        return Explanation(verdict=ADEQUATE, fitted=start)
    if found.explained:
        progress("taking out what later effects have made needless")
        return Explanation(verdict=MISSING, fitted=pruned(found.fitted, allowed))
    learned = found.learned
    most, share = steadily(found, allowed)
    by_term = 0.0 if learned is None else learned.explained
    if most is not None and share >= max(MOSTLY, by_term - ADDS) and found.ended != BUDGET:
        return Explanation(verdict=MISSING, fitted=pruned(most, allowed), share=share)
    if learned is None or by_term < _FINDING:
        return Explanation(verdict=UNLISTED, fitted=start)
    return Explanation(verdict=UNLISTED, fitted=learned.fitted, formula=learned.formula)
