"""Faults of a sensor or the recorder at one instant."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from benchmarks.simulator.faults import ClockRate, Curve, Tone
from tests.effects.rig import sine, system
from tests.effects.scales import SCALES
from tests.effects.sensor import record, shown, unheard
from vibrojax.effects import ClockDrift, ForceClipping, GainError, MainsHum, NonlinearReading, ReadingTone, TimeOffset, ZeroDrift
from vibrojax.effects.base import Motion, unit_in

# Force clipping


def test_shows_nothing_above_the_ceiling_and_all_below():
    reading, force, _ = shown(ForceClipping(10.0))
    assert force.max() > 15.0
    np.testing.assert_array_equal(reading, np.minimum(force, 10.0))
    assert unheard(ForceClipping(10.0))


# Gain error


@pytest.mark.parametrize("channel", ["hammer_displacement", "impact_force", "cart_acceleration"])
def test_multiplies_its_channel(channel):
    reading, value, _ = shown(GainError(1.07, channel))
    np.testing.assert_allclose(reading, 1.07 * value, rtol=1e-15)
    assert unheard(GainError(1.07, channel))


def test_strength_is_the_distance_from_one():
    assert GainError(1.5, "impact_force").scaled(0.5) == GainError(1.25, "impact_force")
    assert GainError(1.5, "impact_force").scaled(-1.0) == GainError(0.5, "impact_force")


def test_the_gain_of_the_only_channel_is_the_unit_of_length():
    assert GainError.probe.candidates(SCALES)
    assert not GainError.probe.candidates(dataclasses.replace(SCALES, tied=False))


# Nonlinear reading


@pytest.mark.parametrize("channel", ["hammer_displacement", "impact_force", "cart_acceleration"])
def test_nonlinear_reading_agrees_with_the_independent_simulator(channel):
    size = {"hammer_displacement": 5e-3, "impact_force": 80.0, "cart_acceleration": 5.0}[channel]
    effect = NonlinearReading(0.03 / size, -0.02 / size**2, channel)
    reading, value, ts = shown(effect)
    curve = Curve(channel=channel, quadratic=0.03 / size, cubic=-0.02 / size**2)
    np.testing.assert_allclose(reading, curve.distort("", ts, value), rtol=1e-14)
    assert np.abs(reading - value).max() > 0.01 * size
    assert unheard(effect)


def test_candidates_bend_the_largest_reading_by_a_hundredth():
    square, cube = NonlinearReading.probe.candidates(SCALES)[1]
    assert square.of_channel == cube.of_channel == "impact_force"
    assert (square.cubic, cube.quadratic) == (0.0, 0.0)
    largest = max(SCALES.force, SCALES.flight_force)
    assert square.quadratic * largest**2 == pytest.approx(cube.cubic * largest**3) == pytest.approx(0.01 * largest)
    still = dataclasses.replace(SCALES, amplitude=0.0, speed=0.0, force=0.0)
    assert NonlinearReading.probe.candidates(still) == ()


def test_its_units_are_those_of_the_channel():
    square, cube = NonlinearReading.parameters
    assert [unit_in(p.unit, "hammer_displacement") for p in (square, cube)] == ["1/m", "1/m^2"]
    assert [unit_in(p.unit, "hammer_acceleration") for p in (square, cube)] == ["1/(m/s^2)", "1/(m/s^2)^2"]


# Time offset


@pytest.mark.parametrize("delay", [2.2e-4, -2.2e-4, 3.83e-3, -3.83e-3])
def test_a_sine_comes_late_also_beyond_the_ends(delay):
    reading, _, ts = shown(TimeOffset(delay, "cart_displacement"))
    np.testing.assert_allclose(reading, sine(ts - delay)[0], atol=1e-7)
    inside = slice(10, -10)
    np.testing.assert_allclose(reading[inside], sine(ts - delay)[0][inside], atol=1e-11)
    assert unheard(TimeOffset(delay, "cart_displacement"))


def test_a_whole_number_of_samples_shifts_the_samples():
    dt = 5e-4
    reading, force, _ = shown(TimeOffset(3 * dt, "impact_force"))
    np.testing.assert_allclose(reading[3:], force[:-3], atol=1e-9 * force.max())


def test_slope_in_the_delay_is_minus_the_velocity():
    ideal, trajectory = record()
    effect = TimeOffset(1.3e-4, "cart_displacement")
    motion = _motion(trajectory)

    def read(delay):
        return dataclasses.replace(effect, delay=delay).read(ideal, motion, jnp.zeros((len(trajectory.ts), 0)))["cart_displacement"]

    _, slope = jax.jvp(read, (jnp.asarray(1.3e-4),), (jnp.asarray(1.0),))
    np.testing.assert_allclose(slope[5:-5], -sine(np.asarray(trajectory.ts) - 1.3e-4)[1][5:-5], atol=1e-6)


def test_needs_no_even_sampling():
    ts = jnp.asarray(np.cumsum(np.tile([1e-3, 2e-3, 1.5e-3], 20)))
    zero = jnp.zeros_like(ts)
    ideal, trajectory = record()
    motion = dataclasses.replace(_motion(trajectory), t=ts, u=zero, v=zero, indentation=zero, indentation_rate=zero, in_contact=zero > 0)
    reading = TimeOffset(7e-4, "cart_displacement").read({"cart_displacement": ts**3}, motion, jnp.zeros((len(ts), 0)))
    np.testing.assert_allclose(reading["cart_displacement"], (ts - 7e-4) ** 3, rtol=1e-9)


def _motion(trajectory):
    return system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)


# Clock drift


@pytest.mark.parametrize("ppm", [900.0, -900.0, 20_000.0])
def test_a_sine_is_stretched(ppm):
    effect = ClockDrift(ppm, "cart_displacement")
    reading, value, ts = shown(effect)
    np.testing.assert_allclose(reading[:-20], sine(ts * (1 - 1e-6 * ppm))[0][:-20], atol=1e-10)
    assert reading[0] == value[0]
    assert unheard(effect)


def test_clock_drift_agrees_with_the_independent_simulator():
    reading, value, ts = shown(ClockDrift(3000.0, "hammer_displacement"))
    expected = ClockRate(channel="hammer_displacement", ppm=3000.0).distort("", ts, value)
    np.testing.assert_allclose(reading[:-3], expected[:-3], atol=2e-3 * np.abs(expected - value).max())
    np.testing.assert_allclose(expected, CubicSpline(ts, value)(ts * (1 - 3e-3)), atol=1e-15)


def test_lateness_is_what_it_reads_by_and_grows_with_time():
    effect = ClockDrift(-500.0, "cart_displacement")
    np.testing.assert_allclose(effect.lateness(jnp.asarray([0.0, 2.0, 10.0])), [0.0, -1e-3, -5e-3])


def test_slope_in_the_drift_is_minus_time_times_the_velocity():
    ideal, trajectory = record()
    motion = system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)

    def read(ppm):
        return ClockDrift(ppm, "cart_displacement").read(ideal, motion, jnp.zeros((len(trajectory.ts), 0)))["cart_displacement"]

    _, slope = jax.jvp(read, (jnp.asarray(130.0),), (jnp.asarray(1.0),))
    ts = np.asarray(trajectory.ts)
    np.testing.assert_allclose(slope[5:-5], -1e-6 * (ts * sine(ts * (1 - 130e-6))[1])[5:-5], atol=1e-12)


def test_candidates_are_half_a_sample_late_by_the_end_of_the_longest_record():
    found = [one for (one,) in ClockDrift.probe.candidates(SCALES)]
    assert [one.of_channel for one in found] == list(SCALES.channels)
    assert all(float(one.lateness(jnp.asarray(3.0))) == pytest.approx(0.5 * SCALES.sampling) for one in found)


# Mains hum


HUM = MainsHum(frequency_hz=50.0, sine=3e-5, cosine=-1e-5, of_channel="hammer_displacement")


def test_adds_a_line_to_its_channel():
    reading, value, ts = shown(HUM)
    line = 3e-5 * np.sin(2 * np.pi * 50.0 * ts) - 1e-5 * np.cos(2 * np.pi * 50.0 * ts)
    np.testing.assert_allclose(reading - value, line, atol=1e-17 + 1e-12 * 3e-5)
    assert unheard(HUM)


def test_members_of_its_candidate_are_sine_and_cosine():
    (candidate,) = MainsHum.probe.candidates(dataclasses.replace(SCALES, lines={"impact_force": (50.0,)}))
    sine, cosine = candidate
    assert (sine.sine, sine.cosine, cosine.sine, cosine.cosine) == (0.15, 0.0, 0.0, 0.15)
    assert MainsHum.probe.joined(candidate) == MainsHum(50.0, 0.15, 0.15, "impact_force")


@pytest.mark.parametrize(
    ("line", "heard"),
    [(12.0, False), (31.4, False), (49.4, False), (49.6, True), (50.0, True), (60.0, True), (100.0, True), (120.0, True)],
)
def test_a_hum_is_a_line_of_the_mains_though_it_be_a_multiple_of_the_drive(line, heard):
    scales = dataclasses.replace(SCALES, drives=(2 * np.pi * 7.3, 2 * np.pi * 12.5), lines={"hammer_displacement": (line,)})
    assert bool(MainsHum.probe.candidates(scales)) == heard


@pytest.mark.parametrize(("line", "seconds", "hum"), [(49.0, 4.0, False), (49.0, 0.5, True), (47.0, 0.5, False)])
def test_a_line_that_a_short_record_does_not_resolve_from_the_mains_is_theirs(line, seconds, hum):
    scales = dataclasses.replace(SCALES, drives=(), clock={"a.csv": (0.0, seconds)}, lines={"hammer_displacement": (line,)})
    assert bool(MainsHum.probe.candidates(scales)) == hum and bool(ReadingTone.probe.candidates(scales)) != hum


@pytest.mark.parametrize(("seconds", "heard"), [(0.19, False), (0.6, True)])
def test_a_line_of_a_few_cycles_is_none(seconds, heard):
    """An impact on an air track takes a fifth of a second."""
    clock = {"a.csv": (0.0, seconds), "b.csv": (1.0, 1.0 + seconds), "c.csv": (0.0, 100.0)}
    scales = dataclasses.replace(SCALES, drives=(), clock=clock, lines={"hammer_displacement": (50.0,)})
    assert bool(MainsHum.probe.candidates(scales)) == heard


# Reading tone


@pytest.mark.parametrize("decay", [0.0, 4.0])
def test_reading_tone_agrees_with_the_independent_simulator(decay):
    tone = Tone(channel="hammer_displacement", amplitude=3e-5, frequency=23.0, decay=decay, phases={"a.csv": 0.7})
    effect = ReadingTone(23.0, decay, 3e-5 * np.cos(0.7), 3e-5 * np.sin(0.7), "hammer_displacement")
    reading, value, ts = shown(effect)
    np.testing.assert_allclose(reading, tone.distort("a.csv", ts, value), rtol=0, atol=1e-16)
    assert np.abs(reading - value).max() > 2e-5
    assert unheard(effect)


def found(**changes):
    return ReadingTone.probe.candidates(dataclasses.replace(SCALES, channels=("impact_force",), **changes))


def test_candidates_are_steady_and_decaying():
    steady, decaying = found(lines={"impact_force": (23.0,)})
    assert [(one.decay_rate, one.frequency_hz) for one in (*steady, *decaying)] == [(0.0, 23.0)] * 2 + [(1.0, 23.0)] * 2
    assert ReadingTone.probe.joined(steady) == ReadingTone(23.0, 0.0, 0.15, 0.15, "impact_force")


@pytest.mark.parametrize(("line", "heard"), [(3.0, False), (7.35, False), (10.3, True), (14.6, False), (23.0, True), (50.0, False)])
def test_no_tone_is_a_multiple_of_the_drive_or_a_line_of_the_mains_or_lasts_a_few_cycles(line, heard):
    assert bool(found(drives=(2 * np.pi * 7.3,), lines={"impact_force": (line,)})) == heard


@pytest.mark.parametrize(("line", "heard"), [(5.05, False), (5.2, False), (5.4, True), (10.3, True)])
def test_no_tone_is_the_free_motion(line, heard):
    """Nor what three seconds do not resolve from it."""
    assert bool(found(drives=(), f_n=5.0, lines={"impact_force": (line,)})) == heard


# Drift of the zero


@pytest.mark.parametrize("settling", [0.0, 1e-9, 1e-3, 4.0])
def test_a_zero_drifts_straight_on_or_towards_an_end(settling):
    reading, value, ts = shown(ZeroDrift(3e-4, settling, "hammer_displacement"))
    drift = 3e-4 * (ts if settling < 1e-6 else (1.0 - np.exp(-settling * ts)) / settling)
    np.testing.assert_allclose(reading - value, drift, rtol=1e-6, atol=1e-15)
    assert np.ptp(drift) > 1e-5
    assert unheard(ZeroDrift(3e-4, settling, "hammer_displacement"))


def test_the_drift_of_a_zero_is_differentiable_through_a_straight_one():
    ts = jnp.linspace(0.0, 2.0, 5)

    def drift(settling):
        effect, motion = ZeroDrift(1.0, settling, "hammer_displacement"), Motion(ts, ts, ts, ts, ts, in_contact=ts < 0)
        return effect.reading(jnp.zeros_like(ts), motion, jnp.zeros((5, 0)))

    for settling in (0.0, 4e-5, 6e-5):  # either side of where the series ends at t = 2 s
        np.testing.assert_allclose(jax.jacfwd(drift)(settling), -(ts**2) / 2, rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(jax.jacfwd(drift)(1e-3), -(ts**2) / 2 + 1e-3 * ts**3 / 3, rtol=1e-4, atol=1e-9)


def test_candidates_of_a_drift_go_straight_and_settle():
    found = ZeroDrift.probe.candidates(dataclasses.replace(SCALES, channels=("impact_force",)))
    assert [one.settling_rate for (one,) in found] == pytest.approx([0.0, 1.0, 10.0 / 3.0, 10.0])


def test_without_a_spring_the_only_displacement_cannot_show_a_drift():
    noise = {"hammer_displacement": 1e-5, "cart_displacement": 1e-5, "impact_force": 0.15}
    free = dataclasses.replace(SCALES, f_n=0.0, noise=noise, channels=("hammer_displacement",))
    assert not ZeroDrift.probe.candidates(free)
    assert ZeroDrift.probe.candidates(dataclasses.replace(free, f_n=2.0))
    beside = ZeroDrift.probe.candidates(dataclasses.replace(free, channels=("hammer_displacement", "cart_displacement", "impact_force")))
    assert {one.of_channel for (one,) in beside} == {"hammer_displacement", "cart_displacement", "impact_force"}


def test_a_zero_does_not_drift_before_the_zero_of_the_clock():
    ts = jnp.linspace(-100.0, 0.0, 5)
    motion = Motion(ts, ts, ts, ts, ts, in_contact=ts < 0)
    np.testing.assert_array_equal(
        ZeroDrift(1.0, 10.0, "hammer_displacement").reading(jnp.zeros_like(ts), motion, jnp.zeros((5, 0))), np.zeros(5)
    )
