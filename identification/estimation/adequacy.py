"""Goodness of fit: upper limit of the reduced chi-square of pure noise."""

from scipy.special import chdtri

BY_NOISE = 1e-3
"""Probability that noise exceeds the limit."""
OVERALL, ONE_CHANNEL = 0.05, 0.1
"""Relative excess of chi-square allowed for an imperfect noise figure: of all records together, of a single channel."""


def chi2_limit(degrees: int, allowance: float, *, chance: float = BY_NOISE) -> float:
    """Reduced chi-square that pure noise exceeds with probability `chance`, times 1 + `allowance` for an imperfect noise figure.

    Example:
        >>> round(chi2_limit(100_000, 0.0), 4)
        1.0139
    """
    return float(chdtri(max(degrees, 1), chance)) / max(degrees, 1) * (1.0 + allowance)
