"""Significance of a log-likelihood gain: p-values with a correction for the number of tests."""

from scipy.special import chdtrc


def chance(gain: float, degrees: int, trials: int) -> float:
    """P-value of a gain in twice the log-likelihood, as the best of `trials` candidates (Bonferroni: an upper bound).

    Example:
        >>> chance(0.0, 1, 10)
        1.0
        >>> round(chance(30.0, 1, 10), 9)
        4.32e-07
    """
    return float(min(1.0, trials * chdtrc(max(degrees, 1), max(gain, 0.0))))


def chance_of_force(gain: float) -> float:
    """P-value of a gain in twice the log-likelihood due to a random force.

    Under noise alone its size lies at the edge of its range; the gain is then distributed half as chi-square with no degree of freedom,
    half with one.

    Source: S. G. Self, K.-Y. Liang, JASA 82 (1987) 605-610.

    Example:
        >>> round(chance_of_force(2.706), 3)
        0.05
    """
    return 0.5 * float(chdtrc(1, max(gain, 0.0))) if gain > 0 else 1.0
