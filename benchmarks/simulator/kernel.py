"""The equations of motion and the stepping through them, compiled by numba.

Everything that a rig does stands in `rates`: to add physics, give it a place in the parameter vector (`PARAMETERS`), and in the state
vector (`STATES`) if it has a memory of its own, and extend `rates`; nothing else integrates.

All of it is one file because numba's cache on disk notices changes in the file of a function only.
"""

import math

import numpy as np
from numba import njit

PARAMETERS = ("m", "c", "k", "k_i", "n", "lambda_i", "gap", "base_amplitude", "omega_exc", "base_phase")
"""Order of the parameter vector; SI. Base motion y = A0 sin(omega_exc t + base_phase)."""
STATES = 2
"""Hammer position x and velocity x', absolute."""
FINE, COARSE = 250, 5
"""Steps in a sample of 0.25 ms: within reach of the stop, and out of it."""


@njit(cache=True)
def base_motion(t, p):
    """Position, velocity and acceleration of the cart."""
    amplitude, omega = p[7], p[8]
    angle = omega * t + p[9]
    s = math.sin(angle)
    return amplitude * s, amplitude * omega * math.cos(angle), -amplitude * omega * omega * s


@njit(cache=True)
def contact_force(indentation, rate, p):
    """Hunt and Crossley (1975): k_i delta^n (1 + lambda_i delta'), never negative, nothing out of contact; N."""
    if indentation <= 0.0:
        return 0.0
    return p[3] * indentation ** p[4] * max(1.0 + p[5] * rate, 0.0)


@njit(cache=True)
def rates(t, state, p, out):
    """Write d(state)/dt into `out` and return the force of the stop, N: m x'' = -c (x' - y') - k (x - y) - F."""
    y, y1, _ = base_motion(t, p)
    u, v = state[0] - y, state[1] - y1
    force = contact_force(u - p[6], v, p)
    out[0] = state[1]
    out[1] = (-p[1] * v - p[2] * u - force) / p[0]
    return force


@njit(cache=True)
def step(t, state, h, p, k, trial):
    """One step of the classical Runge-Kutta method in place; `k` (4, states) and `trial` (states,) are scratch."""
    rates(t, state, p, k[0])
    for i in range(state.size):
        trial[i] = state[i] + 0.5 * h * k[0, i]
    rates(t + 0.5 * h, trial, p, k[1])
    for i in range(state.size):
        trial[i] = state[i] + 0.5 * h * k[1, i]
    rates(t + 0.5 * h, trial, p, k[2])
    for i in range(state.size):
        trial[i] = state[i] + h * k[2, i]
    rates(t + h, trial, p, k[3])
    for i in range(state.size):
        state[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])


@njit(cache=True)
def within_reach(t, state, dt, p):
    """Whether the hammer is in contact or could get there within `dt`, generously."""
    y, y1, y2 = base_motion(t, p)
    u, v = state[0] - y, state[1] - y1
    push = abs(y2) + (abs(p[1] * v) + abs(p[2] * u)) / p[0]
    return u - p[6] + 2.0 * (abs(v) * dt + push * dt * dt) > 0.0


@njit(cache=True)
def sampled(t0, dt, count, initial, p):
    """States, accelerations of the hammer and forces of the stop at t0, t0 + dt, ..., `count` of them."""
    states, accelerations, forces = np.empty((count, initial.size)), np.empty(count), np.empty(count)
    state, slope = initial.copy(), np.empty(initial.size)
    k, trial = np.empty((4, initial.size)), np.empty(initial.size)
    for sample in range(count):
        t = t0 + sample * dt
        states[sample] = state
        forces[sample] = rates(t, state, p, slope)
        accelerations[sample] = slope[1]
        steps = FINE if within_reach(t, state, dt, p) else COARSE
        for i in range(steps):
            step(t + i * dt / steps, state, dt / steps, p, k, trial)
    return states, accelerations, forces
