"""Every number by which a verdict is decided.

Set on development seeds with `python -m benchmarks.concealed` and then left alone.
"""

ALPHA = 1e-4
"""Chance of noise and random force alone passing for one kind of effect, for a free-form term, for a random force, and for a parameter that
varies between records. Some thirty are tried in a diagnosis."""
RELEVANT = 0.1
"""Log-likelihood gain of a free-form term, over that of the named effects and the term together, from which the effects are not the whole
cause; and share of a strength that may vary between records."""
MOST_EFFECTS = 3
"""Listed effects in one model."""
