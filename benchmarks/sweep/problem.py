"""What is swept, and how far off an engine's answer is."""

import dataclasses

import numpy as np

from vibrojax.contact import HuntCrossley
from vibrojax.model import Model
from vibrojax.suspension import Linear

ZETA, F_N = 0.02, 4.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class Problem:
    """A sweep of the excitation frequency from rest in the cart."""

    name: str
    mass: float
    k_i: float
    n: float
    lambda_i: float
    gap: float = 1e-3
    base_amplitude: float = 2e-3
    lowest_hz: float = 3.0
    highest_hz: float = 9.0
    lanes: int = 1000
    cycles: int = 100

    @property
    def frequencies(self) -> np.ndarray:
        """Excitation frequencies, Hz."""
        return np.linspace(self.lowest_hz, self.highest_hz, self.lanes)

    @property
    def model(self) -> Model:
        """The rig for the program."""
        return Model(mass=self.mass, suspension=Linear(ZETA, F_N), law=HuntCrossley(self.k_i, self.n, self.lambda_i))

    @property
    def numbers(self) -> np.ndarray:
        """The rig for the peers: m, 2 zeta omega_n, omega_n^2, k_i, n, lambda_i, gap, A0."""
        omega_n = 2 * np.pi * F_N
        return np.array([self.mass, 2 * ZETA * omega_n, omega_n**2, self.k_i, self.n, self.lambda_i, self.gap, self.base_amplitude])


PROBLEMS = {
    problem.name: problem
    for problem in (
        Problem(name="soft", mass=0.5, k_i=1e6, n=1.5, lambda_i=0.3),
        Problem(name="stiff", mass=2.0, k_i=2.1e8, n=1.6, lambda_i=0.6),
    )
}
"""The rig of the first engine trials, and the contact of the thesis's figure 3.3."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reference:
    """Last section points by a far finer method."""

    u: np.ndarray
    """m, `(lanes,)`"""
    periodic: np.ndarray
    """Where the orbit has closed, so that an error is one of the method and not of a chaotic motion."""


def error(problem: Problem, reference: Reference, u: np.ndarray) -> dict[str, float]:
    """Distance of the last section points of periodic lanes over the base amplitude: median and 90 % quantile."""
    misses = np.abs(u - reference.u)[reference.periodic] / problem.base_amplitude
    return {"median": float(np.median(misses)), "quantile90": float(np.quantile(misses, 0.9))}
