"""Recorded cart motion as an input: the sensor's noise is no motion."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from identification.experiment import Record
from identification.guesses.motion import band_limited, measured_motion, parts
from vibrojax.excitation import CubicSignal


def test_the_noise_of_the_cart_does_not_drive_the_model():
    time, noise = np.arange(4000) / 4000.0, 1e-5
    clean = 1e-3 * np.sin(2 * np.pi * 6.0 * time)
    noisy = clean + noise * np.random.default_rng(0).standard_normal(len(time))
    record = Record(
        file="a.csv",
        kind="cart-excitation",
        gap=0.0,
        base="measured",
        time=time,
        channels={"cart_displacement": noisy},
        noise={"cart_displacement": noise},
    )
    motion = measured_motion(record)
    assert np.std(motion.position.coefficients[3] - clean[:-1]) < 0.3 * noise
    inside = slice(100, -100)
    acceleration = -((2 * np.pi * 6.0) ** 2) * clean[:-1]
    assert np.std((motion.second_derivative.coefficients[3] - acceleration)[inside]) < 0.05 * np.ptp(acceleration)


def test_a_part_is_right_up_to_the_last_sample_of_the_record():
    time = 0.1 * np.arange(20)
    spline = CubicSpline(time, np.sin(time))
    whole = CubicSignal(knots=np.asarray(spline.x), coefficients=np.asarray(spline.c))
    begins = np.array([0, 10, 16, 18, 19])
    pieces = parts(whole, begins, 10)
    for place, first in enumerate(begins):
        piece = CubicSignal(knots=pieces.knots[place], coefficients=pieces.coefficients[place])
        assert np.allclose([float(piece(jnp.asarray(t))) for t in time[first : first + 9]], np.sin(time[first : first + 9]), atol=1e-12)


def test_a_recorded_input_keeps_what_a_recorder_lets_pass():
    time, hz = np.arange(200) / 610.0, 200.0
    wave = band_limited(time, np.cos(2.0 * np.pi * hz * time + 0.4))
    between = np.linspace(time[20], time[-20], 5000)
    error = np.asarray(wave(jnp.asarray(between))) - np.cos(2.0 * np.pi * hz * between + 0.4)
    assert np.sqrt(np.mean(error**2)) < 0.01
    edges = np.concatenate([np.linspace(time[0], time[20], 500), np.linspace(time[-21], time[-1], 500)])
    true, cubic = np.cos(2.0 * np.pi * hz * edges + 0.4), CubicSpline(time, np.cos(2.0 * np.pi * hz * time + 0.4))
    errors = [np.abs(one - true).max() for one in (np.asarray(wave(jnp.asarray(edges))), cubic(edges))]
    assert errors[0] < errors[1], "at its ends it is no worse than the cubic spline"


@pytest.mark.parametrize("lost", [slice(100, 101), slice(100, 300)])
def test_beside_a_pause_of_the_clock_a_recorded_input_is_a_cubic_spline(lost):
    time = np.delete(np.arange(400) / 1000.0, lost)
    values = np.sin(2.0 * np.pi * 20.0 * time)
    between = np.linspace(time[0], time[-1], 3000)
    assert np.allclose(band_limited(time, values)(jnp.asarray(between)), CubicSpline(time, values)(between), atol=1e-9)
