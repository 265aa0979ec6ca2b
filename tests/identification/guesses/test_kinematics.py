"""Motion as a record shows it: touches without a load cell, channels that are never sampled at once."""

import numpy as np
import pytest

from identification.experiment import Record
from identification.guesses.motion import kinematics, relative_displacement

TIME = np.arange(800) / 4000.0
NOISE = 1e-5


def short_contacts() -> np.ndarray:
    """Flights of 20 ms under the stop at 0 and dives of 2 ms into it, 0.2 mm deep: too short to be seen in the curvature of noisy data."""
    phase = TIME % 0.022
    u = np.where(phase < 0.02, -3e-3 * np.sin(np.pi * phase / 0.02), 2e-4 * np.sin(np.pi * (phase - 0.02) / 0.002))
    return u + NOISE * np.random.default_rng(0).standard_normal(len(TIME))


def test_displacement_alone_shows_every_touch():
    record = Record(
        file="a.csv",
        kind="drop-test",
        gap=0.0,
        time=TIME,
        channels={"hammer_displacement": short_contacts()},
        noise={"hammer_displacement": NOISE},
    )
    motion = kinematics(record, mass=0.4, base_acceleration=np.zeros(len(TIME)))
    assert motion is not None
    assert np.sum(np.diff(motion.touching.astype(int)) == 1) == 9
    phase = TIME % 0.022
    assert not motion.touching[(phase > 0.001) & (phase < 0.019)].any()


@pytest.mark.parametrize("faster", [1.0, 30.0, 1000.0])
def test_contacts_of_any_duration_keep_their_force(faster):
    """Half a sine of 10 ms, or of as much less, between two flights, on records of as many samples."""
    time, omega, noise = TIME / faster, faster * np.sqrt(1e5), 1e-7
    flight, speed = 0.02 / faster, 0.1 * faster
    into = time - flight
    touch = (into > 0) & (into < np.pi / omega)
    u = np.where(into <= 0, speed * into, np.where(touch, speed / omega * np.sin(omega * into), -speed * (into - np.pi / omega)))
    u = u + noise * np.random.default_rng(1).standard_normal(len(time))
    record = Record(
        file="a.csv", kind="drop-test", gap=0.0, time=time, channels={"hammer_displacement": u}, noise={"hammer_displacement": noise}
    )
    motion = kinematics(record, mass=1.0, base_acceleration=np.zeros(len(time)))
    assert motion is not None
    middle = touch & (np.sin(omega * into) > 0.5)
    np.testing.assert_allclose(motion.inertia[middle], (omega**2 * u)[middle], rtol=0.1)


def test_one_stray_sample_does_not_take_the_smoothing_from_the_others():
    time = np.arange(4000) / 20000.0
    u = 3e-3 * np.sin(2 * np.pi * 5.0 * time) + NOISE * np.random.default_rng(2).standard_normal(len(time))
    stray = np.where(np.arange(len(time)) == 1000, u + 20 * NOISE, u)
    still = np.zeros(len(time))
    plain, hit = (
        kinematics(
            Record(
                file="a.csv",
                kind="free-decay",
                gap=1.0,
                time=time,
                channels={"hammer_displacement": values},
                noise={"hammer_displacement": NOISE},
            ),
            mass=1.0,
            base_acceleration=still,
        )
        for values in (u, stray)
    )
    assert plain is not None and hit is not None
    far = np.abs(np.arange(len(time)) - 1000) > 100
    np.testing.assert_array_equal(hit.v[far], plain.v[far])


@pytest.mark.parametrize(("kind", "base", "moves"), [("forced", "measured", True), ("forced", "sine", False)])
def test_the_cart_counts_where_its_record_drives_the_model(kind, base, moves):
    channels = {"hammer_displacement": np.full(len(TIME), 1.0), "cart_displacement": np.full(len(TIME), 0.4)}
    record = Record(file="a.csv", kind=kind, gap=0.0, excitation_frequency=None, time=TIME, channels=channels, base=base)
    u = relative_displacement(record)
    assert u is not None
    np.testing.assert_allclose(u, 0.6 if moves else 1.0)


def test_channels_that_are_sampled_in_turn_give_a_relative_displacement():
    even = np.arange(len(TIME)) % 2 == 0
    record = Record(
        file="a.csv",
        kind="cart-excitation",
        gap=0.0,
        excitation_frequency=6.0,
        time=TIME,
        channels={"hammer_displacement": np.where(even, 3.0 * TIME, np.nan), "cart_displacement": np.where(even, np.nan, TIME)},
    )
    u = relative_displacement(record)
    assert u is not None
    np.testing.assert_allclose(u[1:-1], 2.0 * TIME[1:-1], atol=1e-12)
