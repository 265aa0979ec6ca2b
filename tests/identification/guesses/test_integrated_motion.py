"""Records of accelerometers alone: the motion behind them, and what a fit makes of them."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from identification.estimation.estimate import fit_experiment
from identification.experiment import Experiment, Record, Suspension
from identification.guesses.motion import harmonic_acceleration, harmonic_start
from identification.guesses.unseen_motion import integrated_motions
from identification.result.result import OK, FitResult

F_N, ZETA, MASS = 5.0, 0.03, 1.5
OMEGA_N = 2 * np.pi * F_N
TIME = np.arange(6000) / 2000.0


def decay() -> tuple[np.ndarray, np.ndarray]:
    """Displacement and acceleration of a free decay, in closed form."""
    root = complex(-ZETA, np.sqrt(1 - ZETA**2)) * OMEGA_N
    motion = 5e-3 * np.exp(root * TIME)
    return motion.real, (root**2 * motion).real


def driven(excitation: float, amplitude: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """u and x'' over a cart that moves as a sine, steady state and a decay, in closed form."""
    omega = 2 * np.pi * excitation
    cart = amplitude * np.exp(1j * (omega * TIME + phase))
    u = omega**2 * cart / (OMEGA_N**2 - omega**2 + 2j * ZETA * OMEGA_N * omega)
    free, free_acceleration = decay()
    return u.imag + free, -(omega**2) * (u + cart).imag + free_acceleration


def record(kind: str, acceleration: np.ndarray, noise: float = 0.02, **settings) -> Record:
    noisy = acceleration + noise * np.random.default_rng(3).standard_normal(len(TIME))
    channels, sigma = {"hammer_acceleration": noisy}, {"hammer_acceleration": noise}
    return Record(file="a.csv", kind=kind, gap=1.0, time=TIME, channels=channels, noise=sigma, **settings)


def test_a_decay_is_integrated_to_its_displacement():
    u, acceleration = decay()
    (motion,), sines = integrated_motions([record("free-decay", acceleration)], [None], [np.zeros_like(TIME)], mass=MASS, stop=True)
    assert sines == {}
    assert motion is not None
    assert np.std(motion.u - u) < 0.01 * np.std(u)
    assert np.std(motion.v - np.gradient(u, TIME)) < 0.02 * np.std(motion.v)
    assert not motion.touching.any()


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_what_the_accelerometer_reads_at_rest_does_not_make_it_drift(offset):
    u, acceleration = decay()
    (motion,), _ = integrated_motions([record("free-decay", acceleration + offset)], [None], [np.zeros_like(TIME)], mass=MASS, stop=True)
    assert motion is not None
    assert np.std(motion.u - u) < 0.02 * np.std(u)


def test_a_cart_that_no_sensor_saw_is_found_from_the_hammer():
    """No record gives the natural frequency beforehand either."""
    u, acceleration = driven(7.0, 2e-3, 0.7)
    seen = record("cart-excitation", acceleration, excitation_frequency=7.0)
    (motion,), sines = integrated_motions([seen], [None], [np.zeros_like(TIME)], mass=MASS, stop=False)
    assert sines[0] == (pytest.approx(2e-3, rel=0.02), pytest.approx(0.7, abs=0.02))
    assert motion is not None
    assert np.std(motion.u - u) < 0.02 * np.std(u)


def shocked(number: int) -> Record:
    """A board of 400 Hz on a table that takes a half sine of 1 ms: accelerations of both at 10 kHz, from a simulation 20 times as fine."""
    zeta, omega_n, rate = 0.02, 2 * np.pi * 400.0, 10_000
    fine = np.arange(0, 0.06, 1 / (20 * rate))
    pulse = (4000.0 + 500.0 * number) * np.where((fine > 5e-3) & (fine < 6e-3), np.sin(np.pi * (fine - 5e-3) / 1e-3), 0.0)
    _, board, _ = lsim(([2 * zeta * omega_n, omega_n**2], [1.0, 2 * zeta * omega_n, omega_n**2]), pulse, fine)
    rng = np.random.default_rng(number)
    channels = {"hammer_acceleration": board[::20], "cart_acceleration": pulse[::20]}
    channels = {name: values + 5.0 * rng.standard_normal(len(values)) for name, values in channels.items()}
    return Record(
        file=f"shock-{number}.csv",
        kind="cart-excitation",
        base="measured",
        gap=1.0,
        time=fine[::20],
        channels=channels,
        noise={name: 5.0 for name in channels},
    )


@pytest.fixture(scope="module")
def board() -> FitResult:
    """Six shocks on a table of which only the acceleration was recorded."""
    suspension = Suspension(kind="linear")
    records = tuple(shocked(number) for number in range(6))
    return fit_experiment(Experiment(name="board", folder=Path(), mass=1.0, suspension=suspension, law="none", records=records, sha256=""))


def test_a_base_known_by_its_acceleration_alone_drives_many_short_records(board):
    """Frequency and damping come back."""
    values = {parameter.spec.name: parameter.value for parameter in board.parameters}
    assert values["f_n"] == pytest.approx(400.0, rel=1e-3)
    assert values["zeta"] == pytest.approx(0.02, rel=0.02)


def test_noise_of_the_base_is_no_misfit(board):
    """Alone it would make the misfit four times as large, 1 + pi f_n Q / f_s with the quality Q = 1 / (2 zeta)."""
    assert board.chi2_reduced == pytest.approx(1.0, abs=0.1)
    assert board.unrest is None


def accelerometers(experiment: Experiment, *, cart: bool) -> Experiment:
    """The drop test and a cart record of the example with nothing but accelerometers."""

    def stripped(record: Record) -> Record:
        channels, noise = ({"hammer_acceleration": each["hammer_acceleration"]} for each in (record.channels, record.noise))
        if cart and record.kind == "cart-excitation":
            own = harmonic_acceleration(record, *harmonic_start(record))
            channels["cart_acceleration"] = own + 0.02 * np.random.default_rng(1).standard_normal(len(own))
            noise["cart_acceleration"] = 0.02
        return dataclasses.replace(record, channels=channels, noise=noise)

    return dataclasses.replace(experiment, records=tuple(stripped(experiment.records[i]) for i in (0, 2)))


@pytest.mark.parametrize("cart", [True, False])
def test_a_rig_with_accelerometers_alone_is_identified(example, truth, cart):
    """Impacts, gap and suspension of the example within four standard errors, though no displacement and no force was recorded."""
    fitted = fit_experiment(accelerometers(example, cart=cart))
    assert fitted.converged
    assert fitted.chi2_reduced == pytest.approx(1.0, abs=0.03)
    for parameter in fitted.parameters:
        assert parameter.status == OK
        assert abs(parameter.value - truth[parameter.spec.name]) < 4 * parameter.stderr
        assert parameter.value == pytest.approx(truth[parameter.spec.name], rel=0.02)
