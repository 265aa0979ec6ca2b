"""Thresholds that decide a verdict.

They were set by judgement on development rigs. `python -m benchmarks.concealed.level` computes the level of chance from complete rigs.
"""

import math

ALPHA = 1e-4
"""Significance level: probability that noise and random force alone pass for one kind of effect, for a free-form term, for a random force,
or for a parameter that varies between records. A diagnosis makes some thirty such tests.
"""
WITHIN_CHANCE = -2.0 * math.log(ALPHA)
"""BIC difference, -2 ln ALPHA, below which the records do not separate two models."""
RELEVANT = 0.01
"""Smallest relevant share of the nominal model's misfit (chi-square) for a further effect, or for a free-form term beside named effects.

It is a tenth of the root mean square.
"""
MOST_EFFECTS = 3
"""Largest number of listed effects in one model."""
