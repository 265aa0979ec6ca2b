"""When an orbit repeats itself."""

import numpy as np


def repeats(u: np.ndarray, v: np.ndarray, scale_u: np.ndarray, scale_v: np.ndarray, tolerance: float, longest: int) -> np.ndarray:
    """After how many cycles each orbit comes back to where it was, all through the last such stretch.

    Arguments:
        u: displacement at successive strobes, m, `(cycles, lanes)`.
        v: velocity there, m/s, `(cycles, lanes)`.
        scale_u: size to which the tolerance is relative, m, `(lanes,)`.
        scale_v: the same of the velocity, m/s, `(lanes,)`.
        tolerance: largest distance that counts as none.
        longest: longest period searched for, cycles; at most half of what is given.

    Returns:
        The shortest period of each lane in cycles; 0 where there is none.

    Example:
        >>> u = np.array([[1.0], [2.0], [1.0], [2.0]])
        >>> repeats(u, u, np.ones(1), np.ones(1), 1e-9, 8)
        array([2])
    """
    period = np.zeros(u.shape[1], dtype=int)
    for q in range(min(longest, u.shape[0] // 2), 0, -1):
        distance = np.maximum(np.abs(u[-q:] - u[-2 * q : -q]) / scale_u, np.abs(v[-q:] - v[-2 * q : -q]) / scale_v)
        period = np.where(np.all(distance < tolerance, axis=0), q, period)
    return period


def continued(values: np.ndarray, period: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Values of cycles that were not integrated, because each lane repeats its last `period` cycles.

    Arguments:
        values: of the last cycles that were, `(cycles, lanes)`.
        period: of each lane, at least 1, `(lanes,)`.
        wanted: cycles counted from the first one after these, `(more, lanes)`; negative ones lie before and repeat as well.

    Returns:
        `(more, lanes)`
    """
    row = values.shape[0] - period[None, :] + np.mod(wanted, period[None, :])
    return np.take_along_axis(values, row, axis=0)
