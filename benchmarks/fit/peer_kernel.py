"""A compiled simulator for the fit's peer: exact flight, Runge-Kutta in contact, landing on every touch and release.

Written as well as one would write it by hand for this one rig (linear suspension, harmonic cart, Hunt-Crossley): flight costs ten
multiplications a sample, the number of contact steps does not depend on the parameters (so finite differences see a smooth function),
windows run in parallel. It knows nothing of the program's solver.
"""

import math

import numpy as np
from numba import njit, prange

HAMMER, CART, ACCELERATION, FORCE = range(4)
"""Codes of the channels."""


@njit(cache=True, inline="always")
def _transition(t, zeta, omega):
    """Matrix that takes free (u, u') on by t."""
    root = omega * math.sqrt(max(1.0 - zeta * zeta, 1e-12))
    decay, c, s = math.exp(-zeta * omega * t), math.cos(root * t), math.sin(root * t) / root
    return decay * (c + zeta * omega * s), decay * s, -decay * omega * omega * s, decay * (c - zeta * omega * s)


@njit(cache=True, inline="always")
def _flown(tau, a, b, sine, cosine, p, q, zeta, omega, drive):
    """(u, u') after flying for tau from the free part (a, b), where the drive's angle has that sine and cosine at the start."""
    m11, m12, m21, m22 = _transition(tau, zeta, omega)
    turn_s, turn_c = math.sin(drive * tau), math.cos(drive * tau)
    s, c = sine * turn_c + cosine * turn_s, cosine * turn_c - sine * turn_s
    return m11 * a + m12 * b + p * s + q * c, m21 * a + m22 * b + drive * (p * c - q * s)


@njit(cache=True, inline="always")
def _pushed(t, u, v, x):
    """Relative acceleration in contact; x: m, zeta, omega_n, k_i, n, lambda_i, gap, A0, Omega, phase."""
    delta = max(u - x[6], 0.0)
    force = x[3] * delta ** x[4] * max(1.0 + x[5] * v, 0.0)
    return x[7] * x[8] * x[8] * math.sin(x[8] * t + x[9]) - force / x[0] - 2.0 * x[1] * x[2] * v - x[2] * x[2] * u


@njit(cache=True, inline="always")
def _runge_kutta(t, u, v, h, x):
    a1 = _pushed(t, u, v, x)
    v2 = v + 0.5 * h * a1
    a2 = _pushed(t + 0.5 * h, u + 0.5 * h * v, v2, x)
    v3 = v + 0.5 * h * a2
    a3 = _pushed(t + 0.5 * h, u + 0.5 * h * v2, v3, x)
    v4 = v + h * a3
    a4 = _pushed(t + h, u + h * v3, v4, x)
    return u + h / 6.0 * (v + 2.0 * (v2 + v3) + v4), v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)


@njit(cache=True)
def _touch_time(h, a, b, sine, cosine, p, q, x, u1, v1):
    """Time at which the flight from (a, b) reaches the gap within h, where it stands at (u1, v1); negative if it does not."""
    gap, zeta, omega, drive = x[6], x[1], x[2], x[8]
    u0 = a + p * sine + q * cosine
    v0 = b + drive * (p * cosine - q * sine)
    high = h
    if u1 <= gap:
        if not (v0 > 0.0 and v1 < 0.0):
            return -1.0
        high = h * v0 / (v0 - v1)  # there and back within the step: look at the turning point
        if _flown(high, a, b, sine, cosine, p, q, zeta, omega, drive)[0] <= gap:
            return -1.0
    low = 0.0
    tau = high * (gap - u0) / max(u1 - u0, 1e-30) if u1 > gap else 0.5 * high
    for _ in range(60):
        if not low <= tau <= high:
            tau = 0.5 * (low + high)
        u, v = _flown(tau, a, b, sine, cosine, p, q, zeta, omega, drive)
        if u > gap:
            high = tau
        else:
            low = tau
        if abs(u - gap) < 1e-16 or high - low < 1e-15:
            break
        tau -= (u - gap) / v if v != 0.0 else 0.0
    return tau


@njit(cache=True)
def _contact_to(t, u, v, until, substeps, x):
    """Contact from t, to `until` at most, in equal steps: (t, u, v, still in contact)."""
    h = (until - t) / substeps
    for _ in range(substeps):
        u1, v1 = _runge_kutta(t, u, v, h, x)
        if u1 < x[6] and v1 < 0.0:
            part = h * min(1.0, max(0.0, (u - x[6]) / max(u - u1, 1e-30)))
            for _ in range(8):
                u1, v1 = _runge_kutta(t, u, v, part, x)
                if abs(u1 - x[6]) < 1e-16:
                    break
                part -= (u1 - x[6]) / v1
            return t + part, x[6], v1, False
        t, u, v = t + h, u1, v1
    return until, u, v, True


@njit(cache=True)
def _window(t0, dt, count, x, u, v, substeps, us, vs, touching):
    """Motion at t0, t0 + dt, ... of one window."""
    zeta, omega, drive = x[1], x[2], x[8]
    square = omega * omega - drive * drive
    cross = 2.0 * zeta * omega * drive
    strength = x[7] * drive * drive / (square * square + cross * cross)
    p, q = strength * square, -strength * cross
    m11, m12, m21, m22 = _transition(dt, zeta, omega)
    turn_s, turn_c = math.sin(drive * dt), math.cos(drive * dt)
    contact = u > x[6]
    us[0], vs[0], touching[0] = u, v, contact
    t, fresh, i = t0, True, 1
    a, b, sine, cosine = 0.0, 0.0, 0.0, 1.0
    while i < count:
        until = t0 + i * dt
        if contact:
            t, u, v, contact = _contact_to(t, u, v, until, substeps, x)
            fresh = True
            if contact:
                us[i], vs[i], touching[i] = u, v, True
                i += 1
            continue
        if fresh:
            sine, cosine = math.sin(drive * t + x[9]), math.cos(drive * t + x[9])
            a, b = u - p * sine - q * cosine, v - drive * (p * cosine - q * sine)
        whole = not fresh
        h = until - t
        if whole:
            s1, c1 = sine * turn_c + cosine * turn_s, cosine * turn_c - sine * turn_s
            a1, b1 = m11 * a + m12 * b, m21 * a + m22 * b
        else:
            k11, k12, k21, k22 = _transition(h, zeta, omega)
            s1, c1 = math.sin(drive * until + x[9]), math.cos(drive * until + x[9])
            a1, b1 = k11 * a + k12 * b, k21 * a + k22 * b
        u1, v1 = a1 + p * s1 + q * c1, b1 + drive * (p * c1 - q * s1)
        if u1 > x[6] or (v > 0.0 and v1 < 0.0 and u + v * h > x[6]):
            tau = _touch_time(h, a, b, sine, cosine, p, q, x, u1, v1)
            if tau >= 0.0:
                _, v = _flown(tau, a, b, sine, cosine, p, q, zeta, omega, drive)
                t, u, contact = t + tau, x[6], True
                continue
        t, u, v, a, b, sine, cosine, fresh = until, u1, v1, a1, b1, s1, c1, False
        us[i], vs[i], touching[i] = u, v, False
        i += 1


@njit(cache=True, parallel=True)
def residuals(starts, steps, counts, offsets, parameters, states, codes, measured, weight, substeps, out):
    """Write (measured - model) * weight of all windows into `out`, (samples of all windows, channels)."""
    for lane in prange(counts.size):
        n, x = counts[lane], parameters[lane]
        us, vs, touching = np.empty(n), np.empty(n), np.empty(n, np.bool_)
        _window(starts[lane], steps[lane], n, x, states[lane, 0], states[lane, 1], substeps, us, vs, touching)
        turn_s, turn_c = math.sin(x[8] * steps[lane]), math.cos(x[8] * steps[lane])
        sine, cosine = math.sin(x[8] * starts[lane] + x[9]), math.cos(x[8] * starts[lane] + x[9])
        for i in range(n):
            row, u, v, y = offsets[lane] + i, us[i], vs[i], x[7] * sine
            force = x[3] * max(u - x[6], 0.0) ** x[4] * max(1.0 + x[5] * v, 0.0) if touching[i] else 0.0
            for c in range(codes.size):
                if codes[c] == HAMMER:
                    value = u + y
                elif codes[c] == CART:
                    value = y
                elif codes[c] == ACCELERATION:
                    value = -2.0 * x[1] * x[2] * v - x[2] * x[2] * u - force / x[0]
                else:
                    value = force
                out[row, c] = (measured[row, c] - value) * weight[row, c]
            sine, cosine = sine * turn_c + cosine * turn_s, cosine * turn_c - sine * turn_s
