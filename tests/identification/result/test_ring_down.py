"""Damping and frequency by amplitude, against closed forms along motions that SciPy integrates."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from identification.result.ring_down import RingDown, one_flight, ring_down, together

OMEGA, START, STEP = 2.0 * np.pi * 3.0, 5e-3, 1e-3
TIME = np.arange(0.0, 12.0, STEP)
FRICTION = 0.02 * OMEGA**2 * START
"""m/s^2"""


def motion(acceleration, start=(START, 0.0), time=TIME) -> np.ndarray:
    """Displacement, m, from rest."""
    options = {"t_eval": time, "method": "DOP853", "rtol": 1e-10, "atol": 1e-13}
    return solve_ivp(lambda t, y: (y[1], acceleration(*y)), (time[0], time[-1]), start, **options).y[0]


def dry() -> np.ndarray:
    """Closed form: half cycles of a cosine about an equilibrium that friction shifts, until the hammer sticks."""
    u, turn, half = np.zeros_like(TIME), START, np.pi / OMEGA
    for number in range(int(TIME[-1] / half) + 1):
        middle = (-1.0) ** number * FRICTION / OMEGA**2
        if abs(turn) < abs(middle):
            u[number * half <= TIME] = turn
            break
        part = (number * half <= TIME) & ((number + 1) * half > TIME)
        u[part] = middle + (turn - middle) * np.cos(OMEGA * (TIME[part] - number * half))
        turn = 2.0 * middle - turn
    return u


def viscous(zeta: float) -> np.ndarray:
    return motion(lambda x, v: -(OMEGA**2) * x - 2.0 * zeta * OMEGA * v)


DRAG = 3.0
"""1/m"""
CASES = {
    "viscous": (lambda: viscous(0.01), lambda a: np.full_like(a, 0.01), 1e-4),
    "dry": (dry, lambda a: 2.0 * FRICTION / (np.pi * OMEGA**2 * a), 0.03),
    "quadratic": (lambda: motion(lambda x, v: -(OMEGA**2) * x - DRAG * abs(v) * v), lambda a: 4.0 * DRAG * a / (3.0 * np.pi), 1e-3),
}
"""Motion, equivalent damping ratio against amplitude, and the relative error that the estimator may have."""


def columns(found: RingDown | None) -> tuple[np.ndarray, ...]:
    assert found is not None
    return tuple(np.array(getattr(found, name)) for name in ("amplitude", "damping", "damping_stderr", "frequency", "frequency_stderr"))


@pytest.mark.parametrize("kind", CASES)
def test_equivalent_damping_is_that_of_the_closed_form(kind):
    made, expected, within = CASES[kind]
    amplitude, damping, _, frequency, _ = columns(ring_down("a.csv", TIME, made() + 3e-4, noise=1e-9))
    assert len(amplitude) > 10
    assert amplitude[0] > 0.85 * START
    assert amplitude.max() > 2.0 * amplitude.min()
    assert (np.diff(amplitude) < 0.0).all()
    np.testing.assert_allclose(damping, expected(amplitude), rtol=within)
    np.testing.assert_allclose(frequency, 3.0, rtol=0.01 if kind == "dry" else 2e-4)


@pytest.mark.parametrize("kind", CASES)
def test_errors_are_those_of_the_noise(kind):
    made, expected, _ = CASES[kind]
    rng, motion_, off = np.random.default_rng(3), made(), []
    for _ in range(8):
        amplitude, damping, error, frequency, frequency_error = columns(
            ring_down("a.csv", TIME, motion_ + 1e-5 * rng.normal(size=len(TIME)), noise=1e-5)
        )
        large = amplitude > 0.3 * START
        off.append((((damping - expected(amplitude)) / error)[large], ((frequency - 3.0) / frequency_error)[large]))
    for scaled in (np.concatenate(part) for part in zip(*off, strict=True)):
        assert 0.8 < np.sqrt(np.mean(scaled**2)) < 1.25


def test_frequency_follows_the_backbone_of_a_hardening_spring():
    """Exact period of a Duffing oscillator by the complete elliptic integral."""
    cubic = 0.2 * OMEGA**2 / START**2
    made = motion(lambda x, v: -(OMEGA**2) * x - cubic * x**3 - 0.01 * OMEGA * v)
    amplitude, _, _, frequency, _ = columns(ring_down("a.csv", TIME, made, noise=1e-9))
    stiff = OMEGA**2 + cubic * amplitude**2
    np.testing.assert_allclose(frequency, np.sqrt(stiff) / (4.0 * ellipk(0.5 * cubic * amplitude**2 / stiff)), rtol=1e-4)
    assert frequency[0] > 1.05 * frequency[-1]


def test_more_noise_than_declared_shows_in_the_errors():
    rng, made = np.random.default_rng(1), viscous(0.01) + 0.0
    noisy = made + 2e-5 * rng.normal(size=len(TIME))
    _, _, honest, _, _ = columns(ring_down("a.csv", TIME, noisy, noise=2e-5))
    _, _, from_scatter, _, _ = columns(ring_down("a.csv", TIME, noisy, noise=2e-6))
    assert np.median(from_scatter[:5]) > 0.7 * np.median(honest[:5])


def test_a_ripple_makes_no_turning_points_of_its_own():
    amplitude, damping, _, frequency, _ = columns(
        ring_down("a.csv", TIME, viscous(0.01) + 2e-5 * np.sin(2.0 * np.pi * 41.0 * TIME), noise=1e-6)
    )
    first = amplitude > 1e-3
    np.testing.assert_allclose(frequency[first], 3.0, rtol=0.02)
    np.testing.assert_allclose(damping[first], 0.01, rtol=0.4)


def test_what_shows_no_swing_has_no_decay():
    noise = 1e-5 * np.random.default_rng(0).normal(size=len(TIME))
    assert ring_down("a.csv", TIME, noise, noise=1e-5) is None
    assert ring_down("a.csv", TIME, np.full(len(TIME), np.nan), noise=1e-5) is None
    assert ring_down("a.csv", TIME[::80], viscous(0.01)[::80], noise=1e-9) is None, "four samples in a cycle"
    assert one_flight("a.csv", TIME[:100], 1e-3 * TIME[:100], noise=1e-6, level=0.0, frequency=3.0) is None, "it does not come back"
    assert one_flight("a.csv", TIME[:100], noise[:100], noise=1e-5, level=0.0, frequency=3.0) is None


def test_missing_samples_end_what_can_be_read():
    made = viscous(0.01)
    made[4000:4400] = np.nan
    amplitude, damping, _, _, _ = columns(ring_down("a.csv", TIME, made, noise=1e-9))
    np.testing.assert_allclose(damping, 0.01, rtol=1e-3)
    assert amplitude.min() > START * np.exp(-0.01 * OMEGA * 4.5)


@pytest.mark.parametrize("zeta", [0.004, 0.03])
def test_a_flight_out_and_back_has_the_damping_of_its_oscillator(zeta):
    time = np.arange(0.0, 0.16, STEP)
    made = motion(lambda x, v: -(OMEGA**2) * x - 2.0 * zeta * OMEGA * v, (0.0, -0.05), time) + 2e-4
    amplitude, damping, _, frequency, _ = columns(one_flight("a.csv", time, made, noise=1e-9, level=2e-4, frequency=2.7))
    np.testing.assert_allclose(damping, zeta, rtol=2e-3)
    np.testing.assert_allclose(frequency, 3.0, rtol=1e-3)
    np.testing.assert_allclose(amplitude, 0.05 / OMEGA * np.exp(-zeta * OMEGA * 0.25 / 3.0), rtol=0.01)


def test_a_flight_under_dry_friction_loses_what_friction_takes():
    """Out from the middle and back: the amplitude falls by 2 F / k in half a cycle."""
    shift, angle = FRICTION / OMEGA**2, OMEGA * np.arange(-0.12, 0.12, STEP)
    made = np.where(angle < 0.0, -shift + (START + shift) * np.cos(angle), shift + (START - shift) * np.cos(angle))
    made = made[(angle > -0.5 * np.pi) & (angle < 0.5 * np.pi)]
    found = one_flight("a.csv", STEP * np.arange(len(made)), made, noise=1e-9, level=0.0, frequency=2.8)
    amplitude, damping, _, frequency, _ = columns(found)
    np.testing.assert_allclose(damping, 2.0 * shift / (np.pi * START), rtol=0.02)
    np.testing.assert_allclose((amplitude, frequency), ((START,), (3.0,)), rtol=1e-3)


def test_errors_of_a_flight_are_those_of_the_noise():
    time, rng, off = np.arange(0.0, 0.16, STEP), np.random.default_rng(5), []
    made = motion(lambda x, v: -(OMEGA**2) * x - 0.02 * OMEGA * v, (0.0, -0.05), time)
    for _ in range(150):
        noisy = made + 1e-5 * rng.normal(size=len(time))
        _, damping, error, frequency, frequency_error = columns(one_flight("a.csv", time, noisy, noise=1e-5, level=0.0, frequency=3.1))
        off.append([(damping[0] - 0.01) / error[0], (frequency[0] - 3.0) / frequency_error[0]])
    assert (np.abs(np.std(off, axis=0) - 1.0) < 0.2).all()


def test_flights_of_a_record_are_one_ring_down_by_falling_amplitude():
    one, two = (
        RingDown(file="a.csv", amplitude=(a,), damping=(a,), damping_stderr=(0.1,), frequency=(3.0,), frequency_stderr=(0.1,))
        for a in (1.0, 2.0)
    )
    assert together([one, two]).amplitude == together([two, one]).damping == (2.0, 1.0)
