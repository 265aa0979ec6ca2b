"""The peer that an engineer would write: Dormand-Prince 5(4) with error control, compiled by numba, lanes in parallel on all cores.

Written as well as a plain adaptive loop goes: first stage reused, one sine a distinct stage time (stages six and seven share theirs), the
power of the contact law computed only in contact, proportional-integral step control, steps that end on the strobes, no allocation, lanes
dealt out dynamically. The contact switch is left to the error control, as in the usual library solvers.
"""

import math

import numpy as np
from numba import njit, prange


@njit(cache=True, inline="always", error_model="numpy")
def _rate(u, v, drive, p):
    """u'' under -y'' = drive; p: m, 2 zeta omega_n, omega_n^2, k_i, n, lambda_i, gap, A0."""
    a = drive - p[1] * v - p[2] * u
    delta = u - p[6]
    if delta > 0.0:
        damping = 1.0 + p[5] * v
        if damping > 0.0:
            a -= p[3] * delta ** p[4] * damping / p[0]
    return a


@njit(cache=True, error_model="numpy")
def _lane(frequency, cycles, p, rtol, atol_u, atol_v, sections):
    omega = 2.0 * math.pi * frequency
    strength = p[7] * omega * omega
    period = 1.0 / frequency
    u, v = 0.0, 0.0
    a1 = _rate(u, v, 0.0, p)
    h, before = 1e-4 * period, 1e-4
    for cycle in range(cycles):
        t = 0.0  # since the strobe, so that the phase stays exact
        while t < period:
            last = t + h >= period
            step = period - t if last else h
            v2 = v + step * (a1 / 5.0)
            a2 = _rate(u + step * (v / 5.0), v2, strength * math.sin(omega * (t + step / 5.0)), p)
            v3 = v + step * (3.0 / 40.0 * a1 + 9.0 / 40.0 * a2)
            a3 = _rate(u + step * (3.0 / 40.0 * v + 9.0 / 40.0 * v2), v3, strength * math.sin(omega * (t + 0.3 * step)), p)
            v4 = v + step * (44.0 / 45.0 * a1 - 56.0 / 15.0 * a2 + 32.0 / 9.0 * a3)
            u4 = u + step * (44.0 / 45.0 * v - 56.0 / 15.0 * v2 + 32.0 / 9.0 * v3)
            a4 = _rate(u4, v4, strength * math.sin(omega * (t + 0.8 * step)), p)
            c1, c2, c3, c4 = 19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0
            v5 = v + step * (c1 * a1 + c2 * a2 + c3 * a3 + c4 * a4)
            a5 = _rate(u + step * (c1 * v + c2 * v2 + c3 * v3 + c4 * v4), v5, strength * math.sin(omega * (t + 8.0 / 9.0 * step)), p)
            end = strength * math.sin(omega * (t + step))
            d1, d2, d3, d4, d5 = 9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0
            v6 = v + step * (d1 * a1 + d2 * a2 + d3 * a3 + d4 * a4 + d5 * a5)
            a6 = _rate(u + step * (d1 * v + d2 * v2 + d3 * v3 + d4 * v4 + d5 * v5), v6, end, p)
            b1, b3, b4, b5, b6 = 35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0
            u7 = u + step * (b1 * v + b3 * v3 + b4 * v4 + b5 * v5 + b6 * v6)
            v7 = v + step * (b1 * a1 + b3 * a3 + b4 * a4 + b5 * a5 + b6 * a6)
            a7 = _rate(u7, v7, end, p)
            e1, e3, e4, e5, e6, e7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
            eu = step * (e1 * v + e3 * v3 + e4 * v4 + e5 * v5 + e6 * v6 + e7 * v7)
            ev = step * (e1 * a1 + e3 * a3 + e4 * a4 + e5 * a5 + e6 * a6 + e7 * a7)
            su = eu / (atol_u + rtol * max(abs(u), abs(u7)))
            sv = ev / (atol_v + rtol * max(abs(v), abs(v7)))
            size = max(math.sqrt(0.5 * (su * su + sv * sv)), 1e-10)
            if size <= 1.0:
                t = period if last else t + step
                u, v, a1 = u7, v7, a7
                factor = 0.9 * size**-0.17 * before**0.04
                before = max(size, 1e-4)
                if not last or factor < 1.0:
                    h = step * min(max(factor, 0.2), 10.0)
            else:
                h = step * max(0.9 * size**-0.2, 0.2)
        sections[cycle, 0], sections[cycle, 1] = u, v


@njit(cache=True, parallel=True, error_model="numpy")
def sweep(frequencies, cycles, p, rtol, atol_u, atol_v, sections):
    """Write (u, v) at every strobe of every lane into `sections`, (lanes, cycles, 2)."""
    for lane in prange(frequencies.size):
        _lane(frequencies[lane], cycles, p, rtol, atol_u, atol_v, sections[lane])


def numba_sweep(frequencies: np.ndarray, cycles: int, p: np.ndarray, rtol: float) -> np.ndarray:
    """Sections of every lane, (lanes, cycles, 2); lanes are shuffled, so that threads get equal shares."""
    order = np.random.default_rng(0).permutation(frequencies.size)
    sections = np.empty((frequencies.size, cycles, 2))
    sweep(frequencies[order], cycles, p, rtol, 1e-3 * rtol, 1e-1 * rtol, sections)
    back = np.empty_like(sections)
    back[order] = sections
    return back
