"""SciPy's LSODA and DOP853 around the right-hand side, one lane after the other."""

import math
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp


@njit(cache=True, error_model="numpy")
def _rates(t, y, omega, p):
    """Compiled, so that what is timed is the solver and not Python arithmetic; p as in `Problem.numbers`."""
    u, v = y[0], y[1]
    a = p[7] * omega * omega * math.sin(omega * t) - p[1] * v - p[2] * u
    delta = u - p[6]
    if delta > 0.0:
        a -= p[3] * delta ** p[4] * max(1.0 + p[5] * v, 0.0) / p[0]
    out = np.empty(2)
    out[0], out[1] = v, a
    return out


def scipy_lane(method: str, frequency: float, cycles: int, p: np.ndarray, rtol: float) -> np.ndarray:
    """Sections of one lane, (cycles, 2)."""
    strobes = np.arange(1, cycles + 1) / frequency
    options: Any = dict(rtol=rtol, atol=[1e-3 * rtol, 1e-1 * rtol], args=(2 * np.pi * frequency, p))
    found = solve_ivp(_rates, (0.0, strobes[-1]), [0.0, 0.0], method=method, t_eval=strobes, **options)
    if not found.success:
        raise RuntimeError(f"{method} stopped at {frequency} Hz: {found.message}")
    return found.y.T
