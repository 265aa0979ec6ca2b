"""Period-n orbits with one impact of the linear oscillator against a rigid stop, in closed form.

S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155, section on the impact limit
(also F. Peterka, Introduction to vibration of mechanical systems with internal impacts, Academia, Prague 1981): between impacts the motion
is linear, so that periodicity is a linear system for the state after the impact and a quadratic equation for the impact speed; its two
roots meet at the fold, and the orbit doubles its period where a multiplier of flow times jump is -1. Damping is kept here.
"""

import dataclasses

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq


@dataclasses.dataclass(frozen=True)
class Oscillator:
    zeta: float
    f_n: float
    e: float
    gap: float
    amplitude: float

    def orbit(self, frequency: float, n: int, root: int):
        """Impact speed, monodromy matrix from just after an impact, discriminant of the quadratic; root 1 is the faster orbit."""
        omega, drive = 2 * np.pi * self.f_n, 2 * np.pi * frequency
        flow = expm(np.array([[0.0, 1.0], [-(omega**2), -2 * self.zeta * omega]]) * n / frequency)
        alpha, beta = (1 + self.e) * np.linalg.solve(flow - np.eye(2), np.array([0.0, 1.0]))
        r = drive / omega
        amplitude = self.amplitude * r**2 / np.hypot(1 - r**2, 2 * self.zeta * r)
        # (gap - alpha v)^2 + ((e + beta) v / drive)^2 = amplitude^2
        square, half, rest = alpha**2 + ((self.e + beta) / drive) ** 2, -alpha * self.gap, self.gap**2 - amplitude**2
        discriminant = half**2 - square * rest
        if discriminant < 0:
            return None, None, discriminant
        v = (-half + (1 if root else -1) * np.sqrt(discriminant)) / square
        angle = np.arctan2((self.gap - alpha * v) / amplitude, -(self.e + beta) * v / drive / amplitude)
        force = self.amplitude * drive**2 * np.sin(angle + np.arctan2(2 * self.zeta * r, 1 - r**2))
        before = force - 2 * self.zeta * omega * v - omega**2 * self.gap
        after = force + 2 * self.zeta * omega * self.e * v - omega**2 * self.gap
        jump = np.array([[-self.e, 0.0], [(after + self.e * before) / v, -self.e]])
        return v, jump @ flow, discriminant

    def fold(self, low: float, high: float, n: int) -> float:
        """Frequency at which the two orbits meet."""
        return brentq(lambda f: self.orbit(f, n, 1)[2], low, high, xtol=1e-13)

    def period_doubling(self, low: float, high: float, n: int, root: int = 1) -> float:
        """Frequency at which a multiplier is -1."""
        return brentq(lambda f: np.linalg.det(self.orbit(f, n, root)[1] + np.eye(2)), low, high, xtol=1e-13)

    def graze(self, low: float, high: float) -> float:
        """Frequency at which the motion without impacts reaches the stop."""

        def clearance(frequency):
            r = frequency / self.f_n
            return self.gap - self.amplitude * r**2 / np.hypot(1 - r**2, 2 * self.zeta * r)

        return brentq(clearance, low, high, xtol=1e-13)
