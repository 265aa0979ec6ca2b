"""Random force on the hammer as a state of the chain: an Ornstein-Uhlenbeck process.

f(t) has covariance std^2 exp(-|t - t'| / memory). Between two knots it is taken as linear; what the true path does beside the line, the
bridge, moves the state at the end of the segment: with q = 2 std^2 / memory, a segment of length T and a mass m

    var(u') = q T^3 / (12 m^2),   var(u) = q T^5 / (720 m^2) + (T / 2)^2 var(u'),   cov(u, u') = (T / 2) var(u').

Source: G. E. Uhlenbeck, L. S. Ornstein, Phys. Rev. 36 (1930) 823-841; integrals of the Brownian bridge, its covariance being
q (min(s, t) - s t / T).
"""

import dataclasses

import numpy as np
from jaxtyping import Float


@dataclasses.dataclass(frozen=True, kw_only=True)
class RandomForce:
    """Size and memory.

    Attributes:
        std: root mean square, N, above 0.
        memory: correlation time, s; the power falls to half at the corner 1 / (2 pi memory), Hz.
    """

    std: float
    memory: float

    def step(self, duration: Float[np.ndarray, " segments"]) -> tuple[Float[np.ndarray, " segments"], Float[np.ndarray, " segments"]]:
        """Correlation of the force at both ends of a segment, and variance of the one given the other, N^2."""
        correlation = np.exp(-duration / self.memory)
        return correlation, -(self.std**2) * np.expm1(-2.0 * duration / self.memory)

    def bridge(self, duration: Float[np.ndarray, " segments"], mass: float) -> Float[np.ndarray, "segments 2 2"]:
        """Covariance of (u, u') at the end of a segment, given the force at both ends."""
        speed = 2.0 * self.std**2 / self.memory * duration**3 / (12.0 * mass**2)
        place = 2.0 * self.std**2 / self.memory * duration**5 / (720.0 * mass**2) + 0.25 * duration**2 * speed
        both = 0.5 * duration * speed
        return np.stack([np.stack([place, both], axis=-1), np.stack([both, speed], axis=-1)], axis=-2)
