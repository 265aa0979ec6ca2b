"""How the presets' unknown numbers follow from what the thesis's front matter states. Equations: docs/presets.md."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import root_scalar

from vibrojax.errors import NoConvergenceError
from vibrojax.presets.single_impact import SingleImpact

GRID_HZ = 0.25
"""Every frequency that the front matter states is a multiple of this: taken as the step of the experiment's sweeps."""


def fits_labels(f_n: float, labels: Sequence[float]) -> bool:
    """Whether every printed Omega/omega is a frequency of the grid over f_n, rounded to the one decimal that is printed."""
    ratios = np.round(np.arange(1, 200) * GRID_HZ / f_n, 1)
    return all(np.any(np.abs(ratios - label) < 1e-9) for label in labels)


def natural_frequencies(labels: Sequence[float], low: float, high: float, step: float = 2e-4) -> list[tuple[float, float]]:
    """Intervals of f_n, Hz, that `fits_labels` allows.

    Example:
        >>> natural_frequencies([2.0, 4.1], 1.0, 1.4)[0]
        (1.0242, 1.0256)
    """
    trials = np.arange(low, high, step)
    good = np.array([fits_labels(trial, labels) for trial in trials])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
    return [(round(float(trials[a]), 6), round(float(trials[b - 1]), 6)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def least_restitution(points: Sequence[tuple[float, float]], damping_ratio: float) -> float:
    """Least e at which z = 1/1 is stable at every point (Omega/omega, gap/A0): where impact and no impact are said to coexist.

    Raises:
        NoConvergenceError: no e below 0.99 does.
    """
    for restitution in np.arange(0.3, 0.99, 0.01):
        motions = [(SingleImpact(damping_ratio=damping_ratio, restitution=float(restitution), gap=gap, cycles=1), r) for r, gap in points]
        if all(motion.is_stable(ratio) for motion, ratio in motions):
            return round(float(restitution), 2)
    raise NoConvergenceError(f"no restitution below 0.99 makes z = 1/1 stable at {list(points)} with zeta = {damping_ratio:g}")


def gap_ratio(band_end: float, damping_ratio: float, restitution: float) -> float:
    """gap / A0 at which the band z = 1/1 ends at Omega/omega = `band_end`, between 1 and 2.

    Example:
        >>> round(gap_ratio(1.65, 0.01, 0.75), 1)
        5.6
    """

    def miss(gap: float) -> float:
        motion = SingleImpact(damping_ratio=damping_ratio, restitution=restitution, gap=gap, cycles=1)
        end = motion.band_end()
        return (end if np.isfinite(end) else 1.0) - band_end  # far behind a stop there is no band

    return float(root_scalar(miss, bracket=(0.2, 40.0), method="bisect", xtol=1e-3).root)


def clipped_dashpot(restitution: float, stiffness: float, mass: float) -> float:
    """lambda_i, s, that gives `KelvinVoigtClipped` a restitution, by its closed form e(zeta) for zeta < 1.

    Example:
        >>> f"{clipped_dashpot(0.75, 1e6, 1.0):.3e}"
        '1.943e-04'
    """

    def miss(zeta: float) -> float:
        r = np.sqrt(1.0 - zeta**2)
        return float(np.exp(-zeta * (np.pi - np.arctan2(2.0 * zeta * r, 1.0 - 2.0 * zeta**2)) / r)) - restitution

    zeta = float(root_scalar(miss, bracket=(1e-9, 0.999), method="bisect").root)
    return 2.0 * zeta / float(np.sqrt(stiffness / mass))
