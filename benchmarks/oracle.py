"""A slow, exact reference that shares no code with the package: SciPy's DOP853 from touch to release to touch.

The equations are written out once more, in NumPy, so that a wrong sign in the package cannot hide behind itself.
"""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

_RTOL = 1e-11
_SCALE_U, _SCALE_V = 1e-3, 1e-1
"""m, m/s: typical size of the motion, to which the absolute tolerances are scaled."""


class Impact(NamedTuple):
    """One touch: time, s, and the relative velocities on either side, m/s (equal at a compliant stop)."""

    t: float
    v_minus: float
    v_plus: float


class Motion(NamedTuple):
    """Displacement u, m, and velocity v, m/s, of the hammer relative to the cart at the asked-for times, and every touch on the way."""

    u: np.ndarray
    v: np.ndarray
    impacts: list[Impact]


def hunt_crossley(k_i: float, n: float, lambda_i: float) -> Callable[[float, float, float], float]:
    """F = k_i delta^n max(1 + lambda_i delta', 0), N."""
    return lambda delta, rate, _: k_i * max(delta, 0.0) ** n * max(1.0 + lambda_i * rate, 0.0)


def kelvin_voigt(k_i: float, c_i: float) -> Callable[[float, float, float], float]:
    """F = k_i delta + c_i delta', N, free to pull: the force jumps at the touch and at the release."""
    return lambda delta, rate, _: k_i * delta + c_i * rate


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rig:
    """m u'' + 2 zeta omega_n m u' + m omega_n^2 u = m A0 Omega^2 sin(Omega t + base_phase) + P - F, contact for u > gap."""

    mass: float
    zeta: float = 0.0
    f_n: float = 0.0
    gap: float
    base_amplitude: float = 0.0
    base_phase: float = 0.0
    frequency_hz: float = 0.0
    applied: float = 0.0
    """Constant force P towards the stop, N."""
    force: Callable[[float, float, float], float] | None = None
    """Force of a compliant stop, N, of (delta, delta', approach speed); None: a rigid stop."""
    restitution: float = 1.0

    def acceleration(self, t: float, u: float, v: float, push: float) -> float:
        """u'', m/s^2, under a push of the stop, N."""
        omega, omega_n = 2 * np.pi * self.frequency_hz, 2 * np.pi * self.f_n
        inertia = self.base_amplitude * omega**2 * np.sin(omega * t + self.base_phase)
        return inertia + (self.applied - push) / self.mass - 2 * self.zeta * omega_n * v - omega_n**2 * u


def motion(rig: Rig, ts: np.ndarray, state: tuple[float, float], *, longest_step: float = 1e-3, rtol: float = _RTOL) -> Motion:
    """Motion from `state` = (u, u') at `ts[0]`; a touch shorter than `longest_step` that both begins and ends inside a step is not seen."""
    t, y, touching, v0 = ts[0], np.array(state, dtype=float), False, abs(state[1])
    u, v, impacts = np.empty_like(ts), np.empty_like(ts), []
    u[0], v[0] = state
    while t < ts[-1]:
        if abs(y[0] - rig.gap) < 1e-15 and y[1] > 0 and not touching:
            y, touching, v0 = _touch(rig, t, y, impacts)
        piece = _until_boundary(rig, t, ts[-1], y, touching, v0, longest_step, rtol)
        inside = (ts > t) & (ts <= piece.t[-1])
        u[inside], v[inside] = piece.sol(ts[inside]) if inside.any() else (0, 0)
        t, y = piece.t[-1], piece.y[:, -1].copy()
        if piece.status == 1:
            y[0] = rig.gap
            if touching:
                touching = False
            else:
                y, touching, v0 = _touch(rig, t, y, impacts)
    return Motion(u, v, impacts)


def _touch(rig: Rig, t: float, y: np.ndarray, impacts: list[Impact]):
    """State after the touch, whether contact follows, and the approach speed."""
    v_plus = y[1] if rig.force else -rig.restitution * y[1]
    impacts.append(Impact(t, y[1], v_plus))
    return np.array([rig.gap, v_plus]), rig.force is not None, impacts[-1].v_minus


def _until_boundary(rig: Rig, t: float, t_end: float, y: np.ndarray, touching: bool, v0: float, longest_step: float, rtol: float):
    """Integrate one smooth piece: until the hammer meets or leaves the stop, or to the end."""

    def rates(t, y):
        push = rig.force(y[0] - rig.gap, y[1], v0) if touching and rig.force else 0.0
        return [y[1], rig.acceleration(t, y[0], y[1], push)]

    def boundary(t, y):
        return y[0] - rig.gap

    boundary.terminal, boundary.direction = True, -1 if touching else 1
    atol = [rtol * _SCALE_U, rtol * _SCALE_V]
    return solve_ivp(rates, (t, t_end), y, method="DOP853", rtol=rtol, atol=atol, events=boundary, dense_output=True, max_step=longest_step)
