"""Whether a fitted model leaves nothing but noise."""

import numpy as np

from identification.adequacy import BY_NOISE, OVERALL, chi2_limit
from identification.discrepancy.continuity import jump_variance
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance

_ASTRAY, _LEAST_ASTRAY = 0.02, 25.0
"""Share of the windows that may have settled wrongly without a verdict being drawn from them, and the misfit that tells them."""
_JUMP = 10.0
"""Mean squared jump of an effect's own states, in standard errors, above which it has not been followed but chosen anew by each window."""


def adequate(fitted: Fitted, allowed: Tolerance, *, allowance: float = OVERALL, chance: float = BY_NOISE) -> bool:
    """Whether chi-square is that of noise, a few windows apart that have settled on a wrong number of impacts or were lost.

    An effect with memory must also carry it from window to window. `allowance`: for a noise figure that is not exact; `chance`: of
    noise failing.
    """
    cost, samples = fitted.outcome.equations.cost, allowed.samples
    told = samples > 0
    x = np.where(np.isfinite(cost) & told, 2.0 * cost, np.inf)[told] / samples[told]
    most = np.isfinite(x) & (x <= max(np.quantile(x, 1.0 - _ASTRAY, method="lower"), _LEAST_ASTRAY))
    free = np.concatenate([np.full(len(group.record), group.prescribed is None) for group in fitted.prepared.groups])
    degrees = int(samples[told][most].sum()) - fitted.unknowns - fitted.prepared.layout.states * int(free[told][most].sum())
    if np.mean(~most) > _ASTRAY or degrees <= 0:
        return False
    is_noise = float(2.0 * cost[told][most].sum()) / degrees <= chi2_limit(degrees, allowance, chance=chance)
    return is_noise and jump_variance(fitted) <= _JUMP
