"""Channels that a logger computed from another one are left out; two sensors of one motion both count."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from identification.experiment import load_experiment
from identification.experiment.signals import noise_coherence

RATE = 2000.0
TIME = np.arange(6000) / RATE
EXPERIMENT = """\
schema = 1
[hammer]
mass = 0.5
[suspension]
kind = "linear"
[sensors.hammer_displacement]
unit = "m"
[sensors.hammer_acceleration]
unit = "m/s^2"
[[record]]
file = "a.npz"
kind = "free-decay"
gap = 1.0
"""


def motion():
    """A decay at 12 Hz: displacement and acceleration."""
    p = complex(-1.0, 2.0 * np.pi * 12.0)
    wave = 1e-3 * np.exp(p * TIME)
    return wave.imag, (p**2 * wave).imag


def sensed(displacement, seed, noise=1e-6):
    return displacement + np.random.default_rng(seed).normal(0.0, noise, TIME.size)


def differentiated(displacement, lowpass):
    twice = np.gradient(np.gradient(displacement, TIME), TIME)
    return sosfilt(butter(2, lowpass, fs=RATE, output="sos"), twice) if lowpass else twice


def loaded(folder, **channels):
    np.savez(folder / "a.npz", time=TIME, **channels)
    (folder / "experiment.toml").write_text(EXPERIMENT)
    return load_experiment(folder).records[0]


@pytest.mark.parametrize("lowpass", [None, 100.0, 400.0])
@pytest.mark.parametrize("step", [0.0, 2e-6])
def test_an_acceleration_differentiated_from_the_displacement_is_left_out(tmp_path, lowpass, step):
    displacement = sensed(motion()[0], 1)
    displacement = np.round(displacement / step) * step if step else displacement
    record = loaded(tmp_path, hammer_displacement=displacement, hammer_acceleration=differentiated(displacement, lowpass))
    assert set(record.channels) == set(record.noise) == {"hammer_displacement"}
    assert any(one.startswith("hammer_acceleration: computed from hammer_displacement") for one in record.notices)


def test_a_displacement_integrated_from_the_acceleration_is_left_out(tmp_path):
    acceleration = motion()[1] + np.random.default_rng(2).normal(0.0, 0.05, TIME.size)
    velocity = np.cumsum(acceleration - acceleration.mean()) / RATE
    displacement = np.cumsum(velocity - velocity.mean()) / RATE
    record = loaded(tmp_path, hammer_displacement=displacement, hammer_acceleration=acceleration)
    assert set(record.channels) == {"hammer_acceleration"}


@pytest.mark.parametrize("noise", [1e-9, 1e-6, 1e-4])
def test_two_sensors_of_one_motion_both_count(tmp_path, noise):
    displacement, acceleration = motion()
    record = loaded(
        tmp_path,
        hammer_displacement=sensed(displacement, 1, noise),
        hammer_acceleration=acceleration + np.random.default_rng(2).normal(0.0, 0.1, TIME.size),
    )
    assert set(record.channels) == {"hammer_displacement", "hammer_acceleration"}
    assert not any("computed from" in one for one in record.notices)


def test_without_noise_two_sensors_of_one_motion_both_count(tmp_path):
    displacement, acceleration = motion()
    record = loaded(tmp_path, hammer_displacement=np.round(displacement, 13), hammer_acceleration=acceleration)
    assert set(record.channels) == {"hammer_displacement", "hammer_acceleration"}


def test_a_force_that_is_the_acceleration_times_the_mass_is_not_judged(tmp_path):
    acceleration = motion()[1] + np.random.default_rng(2).normal(0.0, 0.1, TIME.size)
    np.savez(tmp_path / "a.npz", time=TIME, impact_force=-0.5 * acceleration, hammer_acceleration=acceleration)
    (tmp_path / "experiment.toml").write_text(
        EXPERIMENT.replace('[sensors.hammer_displacement]\nunit = "m"', '[sensors.impact_force]\nunit = "N"')
    )
    assert set(load_experiment(tmp_path).records[0].channels) == {"impact_force", "hammer_acceleration"}


def test_sensors_of_two_bodies_are_not_compared(tmp_path):
    """Hammer and cart vibrate together, and the noise of the cart is in the displacement relative to it."""
    common = np.random.default_rng(6).normal(0.0, 0.3, TIME.size)
    cart = sensed(np.zeros(TIME.size), 7, 1e-5)
    np.savez(
        tmp_path / "a.npz",
        time=TIME,
        relative_displacement=motion()[0] - cart,
        cart_displacement=cart,
        hammer_acceleration=common,
        cart_acceleration=common + np.random.default_rng(8).normal(0.0, 1e-3, TIME.size),
    )
    tables = "".join(
        f'[sensors.{name}]\nunit = "{unit}"\n'
        for name, unit in (("relative_displacement", "m"), ("cart_displacement", "m"), ("cart_acceleration", "m/s^2"))
    )
    (tmp_path / "experiment.toml").write_text(EXPERIMENT.replace('[sensors.hammer_displacement]\nunit = "m"\n', tables))
    assert len(load_experiment(tmp_path).records[0].channels) == 4


def test_each_record_is_judged_by_itself(tmp_path):
    """The longer record holds a computed acceleration, the shorter one that of an accelerometer."""
    displacement, acceleration = sensed(motion()[0], 1), motion()[1] + np.random.default_rng(2).normal(0.0, 0.1, TIME.size)
    np.savez(tmp_path / "a.npz", time=TIME, hammer_displacement=displacement, hammer_acceleration=differentiated(displacement, None))
    short = slice(0, 4000)
    np.savez(tmp_path / "b.npz", time=TIME[short], hammer_displacement=displacement[short], hammer_acceleration=acceleration[short])
    (tmp_path / "experiment.toml").write_text(EXPERIMENT + EXPERIMENT[EXPERIMENT.index("[[record]]") :].replace("a.npz", "b.npz"))
    assert [len(record.channels) for record in load_experiment(tmp_path).records] == [1, 2]


def test_gaps_and_a_channel_at_rest_are_no_trouble(tmp_path):
    displacement = sensed(motion()[0], 1)
    displacement[3000:3010] = np.nan
    computed = differentiated(displacement, None)
    record = loaded(tmp_path, hammer_displacement=displacement, hammer_acceleration=computed)
    assert set(record.channels) == {"hammer_displacement"}
    assert noise_coherence(displacement, np.zeros(TIME.size)) == (0.0, (0.0, 0.0))


def test_coherence_of_independent_noise_is_that_of_the_number_of_segments():
    one, other = np.random.default_rng(4).normal(size=(2, 60_000))
    common, shares = noise_coherence(one, other)
    assert common < 0.01 and min(shares) > 0.95


def test_few_samples_are_not_judged():
    values = np.random.default_rng(5).normal(size=400)
    assert noise_coherence(values, values) == (0.0, (0.0, 0.0))
