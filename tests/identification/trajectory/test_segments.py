"""Lengths of segments, and noise of recorded inputs."""

import dataclasses

import numpy as np
import pytest

from identification.experiment import Record
from identification.trajectory.chain_equations import motion_covariance
from identification.trajectory.random_force import RandomForce
from identification.trajectory.segments import samples_of_a_segment
from identification.trajectory.start import problem_of, step_in_flight
from tests.identification.trajectory.conftest import MASS, shaken

DT, FORCE_NOISE, BASE_NOISE = 1.0 / 400.0, 2e-2, 3e-2
"""s, N, m/s^2"""


def pushed(**noise: float) -> Record:
    """The first record of the shaken rig, with a recorded force that does nothing; noise by channel."""
    record = shaken(1).records[0]
    return dataclasses.replace(
        record,
        kind="forced",
        channels=record.channels | {"applied_force": np.zeros(len(record.time))},
        noise=record.noise | noise,
    )


def test_noise_of_the_recorded_force_moves_the_hammer_as_drawn_impulses_do():
    record = pushed(applied_force=FORCE_NOISE)
    problem = problem_of(dataclasses.replace(shaken(1), records=(record,)))
    vanishing = RandomForce(std=1e-12, memory=1.0)
    found = motion_covariance(problem.chains, problem.scales, vanishing, MASS)[0][:2, :2]
    impulses, fine = FORCE_NOISE * np.sqrt(DT / MASS**2), 200
    left = problem.chains.duration[0] * (np.arange(fine) + 0.5) / fine  # behind each impulse, s
    effect = np.stack([problem.chains.duration[0] - left, np.ones(fine)]) * impulses * np.sqrt(problem.chains.duration[0] / fine)
    assert np.allclose(found, effect @ effect.T, rtol=1e-3, atol=0.0)


def test_noise_of_the_recorded_acceleration_of_the_cart_counts_too():
    record = shaken(1).records[0]
    cart = {"cart_acceleration": np.zeros(len(record.time))}
    driven = dataclasses.replace(
        record,
        kind="cart-excitation",
        base="measured",
        channels=record.channels | cart,
        noise=record.noise | {"cart_acceleration": BASE_NOISE},
    )
    chains = problem_of(dataclasses.replace(shaken(1), records=(driven,))).chains
    assert np.allclose(chains.input_noise, [[0.0, BASE_NOISE**2 * DT]])


def test_what_looks_like_noise_of_an_input_without_a_declared_one_may_drive_the_hammer():
    record = dataclasses.replace(pushed(applied_force=FORCE_NOISE), noise_estimated=frozenset({"applied_force"}))
    assert not problem_of(dataclasses.replace(shaken(1), records=(record,))).chains.input_noise.any()


@pytest.mark.parametrize("kind", ["free-decay", "drop-test"])
def test_a_recorded_force_that_drives_nothing_has_no_noise_that_does(kind):
    record = dataclasses.replace(pushed(applied_force=FORCE_NOISE), kind=kind)
    assert not problem_of(dataclasses.replace(shaken(1), records=(record,))).chains.input_noise.any()


def test_an_acceleration_that_the_force_gives_has_its_noise_too():
    record = pushed(applied_force=FORCE_NOISE)
    more = {"hammer_acceleration": 0.03}
    seen = dataclasses.replace(
        record, channels=record.channels | {"hammer_acceleration": np.zeros(len(record.time))}, noise=record.noise | more
    )
    chains = problem_of(dataclasses.replace(shaken(1), records=(seen,))).chains
    weight = chains.weight[..., chains.channels.index("hammer_acceleration")]
    assert weight[weight > 0] == pytest.approx(1.0 / 0.05)


def test_segments_are_shorter_where_noise_of_an_input_moves_the_hammer_in_between():
    records = [pushed(applied_force=noise) for noise in (1e-6, 0.01, 0.5)]
    lengths = [samples_of_a_segment([one], 0.1, mass=MASS, resolution=2e-5) for one in records]
    intensity = 0.01**2 * DT / MASS**2
    assert lengths[0] == 67
    assert np.sqrt(intensity * (DT * lengths[1]) ** 3 / 3.0) == pytest.approx(0.3 * 2e-5, rel=0.1)
    assert lengths[2] == 4


def test_steps_are_no_longer_than_the_sampling_interval_of_a_recorded_input():
    model = problem_of(shaken(1)).model
    free, driven = (step_in_flight([one], model, 0.1) for one in (shaken(1).records[0], pushed()))
    assert driven == pytest.approx(DT)
    assert free > DT
