"""Motion with one impact in n cycles of the cart against a rigid stop, in closed form: from it the presets' numbers are estimated."""

import dataclasses

import numpy as np
from jaxtyping import Float

Matrix = Float[np.ndarray, "2 2"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class SingleImpact:
    """Linear oscillator of natural frequency 1, cart of amplitude 1: everything in units of omega_n and A0.

    Between impacts the motion is a free part h and a forced part of amplitude U = r^2 / sqrt((1 - r^2)^2 + (2 zeta r)^2). It repeats after
    n cycles with one impact of speed v where h(end) = h(0) and h'(end) = h'(0) + (1 + e) v, so that (h, h')(0) = (alpha, beta) v with
    (alpha, beta) = (1 + e) (expm(n T) - 1)^-1 (0, 1), and the forced part must make up for the rest:

        (gap - alpha v)^2 + ((e + beta) v / r)^2 = U^2.

    The larger root is the motion that is seen. The two roots meet at the upper end of the band (fold); the period doubles where the flow
    times the jump at the impact has a multiplier -1.

    Attributes:
        damping_ratio: zeta.
        restitution: e.
        gap: gap / A0.
        cycles: n; the band is z = 1/n.

    Source: S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983) 129-155 (impact limit);
    F. Peterka, Introduction to Vibration of Mechanical Systems with Internal Impacts, Academia, Prague (1981). Damping and a gap of either
    sign kept.

    Example:
        >>> round(SingleImpact(damping_ratio=0.01, restitution=0.75, gap=0.0, cycles=1).speed(2.0), 2)
        19.22
    """

    damping_ratio: float
    restitution: float
    gap: float
    cycles: int

    def speed(self, ratio: float) -> float:
        """Impact speed over A0 omega_n at Omega / omega_n = `ratio`; NaN where there is no such motion."""
        alpha, beta = self._free(ratio)
        square = alpha**2 + ((self.restitution + beta) / ratio) ** 2
        root = float((alpha * self.gap) ** 2 - square * (self.gap**2 - self._forced(ratio)[0] ** 2))
        return float((alpha * self.gap + np.sqrt(root)) / square) if root >= 0 else np.nan

    def state(self, ratio: float) -> Float[np.ndarray, " 2"]:
        """(u / A0, u' / (A0 omega_n)) when the cart passes its middle moving forward, by the flow after an impact."""
        speed = self.speed(ratio)
        alpha, beta = self._free(ratio) * speed
        amplitude, lag = self._forced(ratio)
        angle = np.arctan2(self.gap - alpha, -(self.restitution * speed + beta) / ratio)
        wait = (-angle - lag) % (2.0 * np.pi) / ratio
        forced = amplitude * np.array([-np.sin(lag), ratio * np.cos(lag)])
        return self._flow(wait) @ np.array([alpha, beta]) + forced

    def monodromy(self, ratio: float) -> Matrix:
        """Growth of a small disturbance from just after one impact to just after the next."""
        speed = self.speed(ratio)
        alpha, beta = self._free(ratio) * speed
        amplitude, lag = self._forced(ratio)
        angle = np.arctan2((self.gap - alpha) / amplitude, -(self.restitution * speed + beta) / ratio / amplitude)
        push = ratio**2 * np.sin(angle + lag) - self.gap
        before, after = push - 2.0 * self.damping_ratio * speed, push + 2.0 * self.damping_ratio * self.restitution * speed
        turned = (after + self.restitution * before) / speed
        return np.array([[-self.restitution, 0.0], [turned, -self.restitution]]) @ self._flow(2.0 * np.pi * self.cycles / ratio)

    def is_stable(self, ratio: float) -> bool:
        """Whether the motion exists there and attracts its neighbours."""
        speed = self.speed(ratio)
        return bool(speed > 0 and np.abs(np.linalg.eigvals(self.monodromy(ratio))).max() < 1.0)

    def band_end(self) -> float:
        """Upper end of the band, Omega / omega_n: below 2 n, the largest ratio at which the motion is stable; NaN without one."""
        ratios = np.linspace(2.0 * self.cycles, 1.0, 400)[1:-1]
        inside = next((float(ratio) for ratio in ratios if self.is_stable(float(ratio))), np.nan)
        outside = inside + float(ratios[0] - ratios[1])
        for _ in range(20):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if self.is_stable(middle) else (inside, middle)
        return inside

    def _free(self, ratio: float) -> Float[np.ndarray, " 2"]:
        """(alpha, beta): the free part just after an impact of speed one."""
        flow = self._flow(2.0 * np.pi * self.cycles / ratio)
        return (1.0 + self.restitution) * np.linalg.solve(flow - np.eye(2), np.array([0.0, 1.0]))

    def _forced(self, ratio: float) -> tuple[float, float]:
        """Amplitude and lag of the forced part."""
        real, imaginary = 1.0 - ratio**2, 2.0 * self.damping_ratio * ratio
        return float(ratio**2 / np.hypot(real, imaginary)), float(np.arctan2(imaginary, real))

    def _flow(self, time: float) -> Matrix:
        """Free vibration over a time."""
        zeta = self.damping_ratio
        omega = np.sqrt(1.0 - zeta**2)
        cosine, sine = np.cos(omega * time), np.sin(omega * time) / omega
        return np.exp(-zeta * time) * np.array([[cosine + zeta * sine, sine], [-sine, cosine - zeta * sine]])
