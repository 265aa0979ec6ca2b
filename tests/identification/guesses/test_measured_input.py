"""Recorded cart motion as an input: the sensor's noise is no motion."""

import jax.numpy as jnp
import numpy as np
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
    at_the_edges = np.linspace(time[0], time[-1], 5000)
    assert np.abs(wave(jnp.asarray(at_the_edges))).max() < 1.2


def test_a_pause_of_the_clock_in_a_recorded_input_is_a_straight_line():
    time = np.delete(np.arange(400) / 1000.0, slice(100, 300))
    wave = band_limited(time, np.where(time < 0.2, 1.0, 3.0))
    between = np.linspace(time[99], time[100], 50)
    assert np.allclose(wave(jnp.asarray(between)), np.interp(between, time[99:101], [1.0, 3.0]), atol=0.05)
    assert np.allclose(wave(jnp.asarray(time[:80] + 4e-4)), 1.0, atol=1e-6)
