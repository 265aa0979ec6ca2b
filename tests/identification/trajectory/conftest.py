"""A vibrating hammer without a stop, shaken by a random force, and its records; small enough for dense algebra."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from identification.experiment import Experiment, Record, Suspension
from identification.trajectory.start import Problem, problem_of

MASS, ZETA, F_N = 0.5, 0.02, 4.0
RATE, SAMPLES, NOISE = 400.0, 160, 2e-5
"""Hz; of each record; m."""
FORCE, MEMORY = 0.02, 0.03
"""N, s"""


@dataclasses.dataclass(frozen=True)
class Linear:
    """The rig in closed form: state (u, u') under a force that is linear in time."""

    omega: float = 2.0 * np.pi * F_N

    @property
    def rates(self) -> np.ndarray:
        return np.array([[0.0, 1.0], [-(self.omega**2), -2.0 * ZETA * self.omega]])

    def passed(self, t: float, duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State after t by state, and by the force at both ends of a stretch of `duration`."""
        whole = np.zeros((4, 4))
        whole[:2, :2], whole[1, 2], whole[2, 3] = self.rates, 1.0 / MASS, 1.0
        found = expm(whole * t)
        return found[:2, :2], found[:2, 2] - found[:2, 3] / duration, found[:2, 3] / duration


def records(count: int, seed: int) -> list[Record]:
    """Free decays from 5 mm, shaken by an Ornstein-Uhlenbeck force that is drawn at the samples."""
    rng, dt = np.random.default_rng(seed), 1.0 / RATE
    phi, by_first, by_last = Linear().passed(dt, dt)
    kept, found = np.exp(-dt / MEMORY), []
    for index in range(count):
        z, force, u = np.array([5e-3 + 1e-3 * index, 0.0]), FORCE * rng.standard_normal(), []
        for _ in range(SAMPLES):
            u.append(z[0])
            following = kept * force + FORCE * np.sqrt(1.0 - kept**2) * rng.standard_normal()
            z, force = phi @ z + by_first * force + by_last * following, following
        read = np.array(u) + NOISE * rng.standard_normal(SAMPLES)
        found.append(
            Record(
                file=f"decay{index}.csv",
                kind="free-decay",
                gap=0.0,
                time=dt * np.arange(SAMPLES),
                channels={"hammer_displacement": read},
                noise={"hammer_displacement": NOISE},
            )
        )
    return found


def shaken(count: int = 2, seed: int = 4) -> Experiment:
    """The rig's experiment."""
    return Experiment(
        name="shaken",
        folder=Path(),
        mass=MASS,
        suspension=Suspension(kind="linear"),
        law="none",
        sha256="",
        records=tuple(records(count, seed)),
    )


@pytest.fixture(scope="session")
def vibrating() -> Problem:
    """Two records of the rig as a problem, at its first estimate; a step goes the whole way."""
    problem = problem_of(shaken())
    return dataclasses.replace(problem, border=dataclasses.replace(problem.border, proximal=0.0))
