"""Every number by which a verdict is decided.

Set on development seeds with `python -m benchmarks.concealed` and then left alone.
"""

import math

ALPHA = 1e-4
"""Chance of noise and random force alone passing for one kind of effect, for a free-form term, for a random force, and for a parameter that
varies between records. Some thirty are tried in a diagnosis."""
WITHIN_CHANCE = -2.0 * math.log(ALPHA)
"""Difference of the information criteria of two models that chance at this level may make: the records do not separate them."""
RELEVANT = 0.01
"""Share of the nominal model's misfit, as chi-square, from which a further effect, or a free-form term beside named effects, matters.

It is a tenth of the root mean square."""
MOST_EFFECTS = 3
"""Listed effects in one model."""
