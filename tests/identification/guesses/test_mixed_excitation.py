"""One experiment, four kinds of excitation: a free decay, a recorded force, a recorded base, a prescribed motion."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from identification.estimation.estimate import fit_experiment
from identification.experiment import Experiment, Record, Suspension
from identification.trajectory.start import problem_of

MASS, F_N, ZETA = 2.0, 4.0, 0.03
OMEGA_N = 2 * np.pi * F_N
SPRING, DAMPER = MASS * OMEGA_N**2, 2 * ZETA * OMEGA_N * MASS
RATE, FINE = 500, 20
FINE_TIME = np.arange(2000 * FINE) / (RATE * FINE)
TIME = FINE_TIME[::FINE]
NOISE = {"hammer_displacement": 2e-6, "relative_displacement": 2e-7, "reaction_force": 0.01}


def input_of(seed: int, size: float) -> np.ndarray:
    """A sum of sines below 12 Hz."""
    rng = np.random.default_rng(seed)
    tones = rng.uniform(0.5, 12.0, 20)
    return size * np.sin(2 * np.pi * tones * FINE_TIME[:, None] + rng.uniform(0, 6.28, 20)).sum(axis=1)


def response(force: np.ndarray, start: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """u under a force, N, by the exact solution between fine samples."""
    matrix = [[0.0, 1.0], [-SPRING / MASS, -DAMPER / MASS]]
    return lsim((matrix, [[0.0], [1.0 / MASS]], [[1.0, 0.0]], [[0.0]]), force, FINE_TIME, X0=start)[1]


def record(kind: str, seed: int, channels: dict[str, np.ndarray], **settings) -> Record:
    rng = np.random.default_rng(100 + seed)
    noisy = {name: values + NOISE.get(name, 0.0) * rng.standard_normal(len(values)) for name, values in channels.items()}
    noise = {name: NOISE.get(name, 1e-6) for name in channels}
    return Record(file=f"{kind}.csv", kind=kind, gap=1.0, time=TIME, channels=noisy, noise=noise, **settings)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    decay = record("free-decay", 1, {"hammer_displacement": response(0 * FINE_TIME, (5e-3, 0.0))[::FINE]})
    force = input_of(2, 1.0)
    forced = record("forced", 2, {"hammer_displacement": response(force)[::FINE], "applied_force": force[::FINE]})
    base = input_of(3, 0.5)
    driven = record(
        "cart-excitation",
        3,
        {"relative_displacement": response(-MASS * base)[::FINE], "cart_acceleration": base[::FINE]},
        base="measured",
    )
    u = 4e-3 * np.sin(2 * np.pi * 1.5 * TIME)
    v = 4e-3 * 2 * np.pi * 1.5 * np.cos(2 * np.pi * 1.5 * TIME)
    led = record("prescribed", 4, {"relative_displacement": u, "reaction_force": SPRING * u + DAMPER * v})
    suspension = Suspension(kind="linear")
    return Experiment(
        name="mixed",
        folder=Path(),
        mass=1.5,
        mass_is_known=False,
        suspension=suspension,
        law="none",
        records=(decay, forced, driven, led),
        sha256="",
    )


def test_every_kind_is_integrated_by_itself(experiment):
    chains = problem_of(experiment).chains
    assert [sorted(set(group.record.tolist())) for group in chains.groups] == [[0], [1], [2], [3]]


@pytest.mark.thorough
def test_all_kinds_together_give_suspension_and_mass(experiment):
    """The mass shows only against the two forces; frequency and damping in all records."""
    fitted = fit_experiment(experiment)
    truth = {"f_n": F_N, "zeta": ZETA, "m": MASS}
    assert fitted.converged
    assert fitted.chi2_reduced == pytest.approx(1.0, abs=0.1)
    for parameter in fitted.parameters:
        assert abs(parameter.value - truth[parameter.spec.name]) < 3.5 * parameter.stderr
        assert parameter.value == pytest.approx(truth[parameter.spec.name], rel=1e-3)
    assert all(chi2 == pytest.approx(1.0, abs=0.15) for record in fitted.records for chi2 in record.chi2_reduced.values())
