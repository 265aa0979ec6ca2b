"""When a misfit is more than noise."""

from scipy.special import chdtri

_FALSE_ALARM = 1e-3
OVERALL, ONE_CHANNEL = 0.05, 0.1
"""Relative excess of chi-square that an imperfect noise figure may cause: of all records together, of a single channel."""


def chi2_limit(degrees: int, allowance: float) -> float:
    """Reduced chi-square that pure noise exceeds once in a thousand times, with an allowance for what is known of the noise.

    Example:
        >>> round(chi2_limit(100_000, 0.0), 4)
        1.0139
    """
    return float(chdtri(max(degrees, 1), _FALSE_ALARM)) / max(degrees, 1) * (1.0 + allowance)
