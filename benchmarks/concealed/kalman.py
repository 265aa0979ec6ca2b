"""An extended Kalman filter for the hammer in free flight with a random force: state u, u', f; times sampled, readings one at a time.

Source: A. H. Jazwinski, Stochastic Processes and Filtering Theory (1970), chapter 8.
"""

import numba
import numpy as np

_V_SMALL = 3e-3
"""m/s; the sign of the velocity is smoothed over this."""
FORCES = 8
"""Coefficients of what else acts: friction, drag, cubic spring, constant force, and the second and third harmonic of the cart."""
_OTHERS = 6
"""Place of their first among the estimates, after omega, zeta, sigma, tau and the noise of displacement and acceleration."""
_WIDE = (1e-2, 0.05)
"""Standard deviations of u and u' where a flight begins, m and m/s."""


@numba.njit(cache=True)
def _acceleration(u: float, v: float, f: float, angle: float, cart: np.ndarray, mass: float, p: np.ndarray) -> float:
    """u'', m/s^2."""
    c = p[_OTHERS:]
    force = f - c[0] * np.tanh(v / _V_SMALL) - c[1] * v * abs(v) - c[2] * u**3 + c[3]
    if c[4] != 0.0 or c[5] != 0.0 or c[6] != 0.0 or c[7] != 0.0:
        force += c[4] * np.sin(2.0 * angle) + c[5] * np.cos(2.0 * angle) + c[6] * np.sin(3.0 * angle) + c[7] * np.cos(3.0 * angle)
    return -2.0 * p[1] * p[0] * v - p[0] ** 2 * u + cart[0] * cart[1] ** 2 * np.sin(angle) + force / mass


@numba.njit(cache=True)
def _slopes(u: float, v: float, mass: float, p: np.ndarray) -> tuple[float, float]:
    """Derivatives of u'' in u and u'."""
    c = p[_OTHERS:]
    by_u = -(p[0] ** 2) - 3.0 * c[2] * u**2 / mass
    by_v = -2.0 * p[1] * p[0] - 2.0 * c[1] * abs(v) / mass
    if c[0] != 0.0:
        by_v -= c[0] / (mass * _V_SMALL * np.cosh(min(abs(v) / _V_SMALL, 300.0)) ** 2)
    return by_u, by_v


@numba.njit(cache=True)
def _read(m: np.ndarray, c: np.ndarray, row: tuple[float, float, float], error: float, variance: float) -> float:
    """Take one reading in: mean m and covariance c of the state are changed; returns its log-density."""
    r0, r1, r2 = row
    t0 = c[0, 0] * r0 + c[0, 1] * r1 + c[0, 2] * r2
    t1 = c[0, 1] * r0 + c[1, 1] * r1 + c[1, 2] * r2
    t2 = c[0, 2] * r0 + c[1, 2] * r1 + c[2, 2] * r2
    total = r0 * t0 + r1 * t1 + r2 * t2 + variance
    share = error / total
    m[0] += t0 * share
    m[1] += t1 * share
    m[2] += t2 * share
    c[0, 0] -= t0 * t0 / total
    c[0, 1] -= t0 * t1 / total
    c[0, 2] -= t0 * t2 / total
    c[1, 1] -= t1 * t1 / total
    c[1, 2] -= t1 * t2 / total
    c[2, 2] -= t2 * t2 / total
    return -0.5 * (error * share + np.log(2.0 * np.pi * total))


@numba.njit(cache=True)
def _advance(m: np.ndarray, c: np.ndarray, t: float, h: float, cart: np.ndarray, mass: float, p: np.ndarray) -> None:
    """One sample on: the mean by a Runge-Kutta step, its covariance by the derivative half way."""
    u, v, f = m[0], m[1], m[2]
    half, whole = np.exp(-0.5 * h / p[3]), np.exp(-h / p[3])
    angle = cart[1] * t + cart[2]
    turn = cart[1] * h
    a1 = _acceleration(u, v, f, angle, cart, mass, p)
    v2 = v + 0.5 * h * a1
    a2 = _acceleration(u + 0.5 * h * v, v2, f * half, angle + 0.5 * turn, cart, mass, p)
    v3 = v + 0.5 * h * a2
    a3 = _acceleration(u + 0.5 * h * v2, v3, f * half, angle + 0.5 * turn, cart, mass, p)
    v4 = v + h * a3
    a4 = _acceleration(u + h * v3, v4, f * whole, angle + turn, cart, mass, p)
    by_u, by_v = _slopes(u + 0.5 * h * v2, v3, mass, p)
    m[0] = u + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
    m[1] = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    m[2] = f * whole
    g = np.zeros((3, 3))  # I + A h + (A h)^2 / 2 of the motion; the force dies down by itself
    g[0, 0], g[0, 1], g[0, 2] = 1.0 + 0.5 * h * h * by_u, h + 0.5 * h * h * by_v, 0.5 * h * h / mass
    g[1, 0], g[1, 1] = h * by_u + 0.5 * h * h * by_u * by_v, 1.0 + h * by_v + 0.5 * h * h * (by_u + by_v * by_v)
    g[1, 2], g[2, 2] = (h + 0.5 * h * h * by_v) / mass * half, whole
    old = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            old[i, j] = c[min(i, j), max(i, j)]
    for i in range(3):
        for j in range(i, 3):
            total = 0.0
            for k in range(3):
                for n in range(3):
                    total += g[i, k] * old[k, n] * g[j, n]
            c[i, j] = total
    power = 2.0 * p[2] ** 2 / p[3] * h / 6.0  # Simpson's rule for the diffusion that has come in
    m0, m1, m2 = 0.125 * h * h / mass, 0.5 * h / mass, half
    e0, e1, e2 = 0.5 * h * h / mass, h / mass, whole
    c[0, 0] += power * (4.0 * m0 * m0 + e0 * e0)
    c[0, 1] += power * (4.0 * m0 * m1 + e0 * e1)
    c[0, 2] += power * (4.0 * m0 * m2 + e0 * e2)
    c[1, 1] += power * (4.0 * m1 * m1 + e1 * e1)
    c[1, 2] += power * (4.0 * m1 * m2 + e1 * e2)
    c[2, 2] += power * (1.0 + 4.0 * m2 * m2 + e2 * e2)


@numba.njit(cache=True)
def log_density(
    first: np.ndarray, times: np.ndarray, x: np.ndarray, a: np.ndarray, v: np.ndarray, carts: np.ndarray, mass: float, p: np.ndarray
) -> float:
    """Log-likelihood of all readings, sample by sample; each flight begins anew. Acceleration is NaN where it was not read."""
    found, m, c = 0.0, np.zeros(3), np.zeros((3, 3))
    for flight in range(len(first) - 1):
        cart, begin = carts[flight], first[flight]
        m[:] = 0.0
        m[0], m[1] = x[begin] - cart[0] * np.sin(cart[1] * times[begin] + cart[2]), v[flight]
        c[:] = 0.0
        c[0, 0], c[1, 1], c[2, 2] = _WIDE[0] ** 2, _WIDE[1] ** 2, p[2] ** 2
        for k in range(begin, first[flight + 1]):
            angle = cart[1] * times[k] + cart[2]
            sine = cart[0] * np.sin(angle)
            found += _read(m, c, (1.0, 0.0, 0.0), x[k] - sine - m[0], p[4] ** 2)
            if np.isfinite(a[k]):
                by_u, by_v = _slopes(m[0], m[1], mass, p)
                seen = _acceleration(m[0], m[1], m[2], angle, cart, mass, p) - cart[1] ** 2 * sine
                found += _read(m, c, (by_u, by_v, 1.0 / mass), a[k] - seen, p[5] ** 2)
            if k + 1 < first[flight + 1]:
                _advance(m, c, times[k], times[k + 1] - times[k], cart, mass, p)
    return found
