"""Every number by which a verdict is decided.

Set on development seeds with `python -m benchmarks.concealed` and then left alone.
"""

ALPHA = 1e-4
"""Chance of noise and random force alone passing for one kind of effect, for a free-form term, for a random force, and for a parameter that
varies between records. Some thirty are tried in a diagnosis."""
RELEVANT = 0.01
"""Share of the misfit of the nominal model, as chi-square, from which what explains it matters: a further effect beside those already in the
model, and a free-form term that says that named effects are not the whole cause. That is a tenth of its root mean square."""
MOST_EFFECTS = 3
"""Listed effects in one model."""
