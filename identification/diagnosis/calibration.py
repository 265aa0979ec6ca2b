"""Thresholds that decide a verdict.

ALPHA is that at which a candidate passes on 0.3 % of complete rigs. On the first 20 rigs of

    python -m benchmarks.concealed --seed 7 --null 40 --unrest force colour scatter --no-baselines --json FILE
    python -m benchmarks.concealed.level --rate 0.003 FILE

the level is 1.1e-4, with a 95 % interval of 6.5e-6 to 2.1e-3, and the tail of the chances is 1.05 times as long as that of an exact test.
Twenty rigs determine it to a factor of some twenty either way. The others were set by judgement on development rigs.
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
