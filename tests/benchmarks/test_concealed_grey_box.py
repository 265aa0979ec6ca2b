"""The stochastic model of free flights: its likelihood beside that of a dense covariance, and what it names."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.stats import multivariate_normal

from benchmarks.concealed.flights import Flights, flights
from benchmarks.concealed.grey_box import TERMS, first_guess, fit, forward_selection, log_likelihood
from benchmarks.concealed.kalman import FORCES
from benchmarks.simulator import Order, draw_case, write_case
from identification.experiment import load_experiment

MASS, OMEGA, ZETA, SIGMA, MEMORY, NOISE = 0.3, 30.0, 0.02, 0.05, 0.02, (1e-5, 0.5)
DT = 5e-4


def made(forces=(), samples=400, count=4, seed=1):
    """Flights of a hammer that swings freely from different deflections, with these forces and sensors' noise."""
    rng, coefficients = np.random.default_rng(seed), np.zeros(FORCES)
    for place, value in forces:
        coefficients[place] = value
    t, x, a = DT * np.arange(samples), [], []

    def acceleration(u, v):
        force = -coefficients[0] * np.sign(v) - coefficients[1] * v * abs(v) - coefficients[2] * u**3 + coefficients[3]
        return -2.0 * ZETA * OMEGA * v - OMEGA**2 * u + force / MASS

    for begin in np.geomspace(2e-3, 2e-2, count):
        u, v = solve_ivp(lambda _, s: (s[1], acceleration(*s)), (0.0, t[-1]), (begin, 0.3), t_eval=t, rtol=1e-9, atol=1e-12).y
        x.append(u + NOISE[0] * rng.normal(size=samples))
        a.append(acceleration(u, v) + NOISE[1] * rng.normal(size=samples))
    first, cart = samples * np.arange(count + 1), np.zeros((count, 3))
    return Flights(
        first, np.tile(t, count), np.concatenate(x), np.concatenate(a), np.full(count, 0.3), cart, NOISE, MASS, OMEGA / (2.0 * np.pi)
    )


@pytest.mark.parametrize("read", [(0, 1), (0,)], ids=["both sensors", "no accelerometer"])
@pytest.mark.parametrize("cart", [(0.0, 0.0, 0.0), (1e-3, 40.0, 0.7)], ids=["at rest", "moving"])
def test_likelihood_is_that_of_the_dense_covariance(cart, read):
    """Linear, so that it is Gaussian: mean of all readings of a flight by DOP853, their covariance from the matrix exponential."""
    rng, ts = np.random.default_rng(3), DT * np.arange(12)
    harmonics = np.array([0.02, -0.03, 0.01, 0.04]) * (cart[0] > 0.0)

    def drive(t):
        angle = cart[1] * t + cart[2]
        force = harmonics @ [np.sin(2.0 * angle), np.cos(2.0 * angle), np.sin(3.0 * angle), np.cos(3.0 * angle)]
        return cart[0] * np.sin(angle), force / MASS

    def rates(t, state):
        y, force = drive(t)
        return state[1], -(OMEGA**2) * state[0] - 2.0 * ZETA * OMEGA * state[1] + cart[1] ** 2 * y + force

    u, v = solve_ivp(rates, (0.0, ts[-1]), (0.01, 0.3), t_eval=ts, rtol=1e-12, atol=1e-15, method="DOP853").y
    y, force = np.array([drive(t) for t in ts]).T
    mean = np.stack([u + y, -(OMEGA**2) * u - 2.0 * ZETA * OMEGA * v + force], axis=1)
    readings = mean + NOISE * rng.normal(size=(12, 2))
    readings[0, 0] = mean[0, 0]  # the filter begins at the first displacement that is read
    a = readings[:, 1] if 1 in read else np.full(12, np.nan)
    data = Flights(np.array([0, 12]), ts, readings[:, 0], a, np.array([0.3]), np.array([cart]), NOISE, MASS, OMEGA / (2.0 * np.pi))
    system = np.array([[0.0, 1.0, 0.0], [-(OMEGA**2), -2.0 * ZETA * OMEGA, 1.0 / MASS], [0.0, 0.0, -1.0 / MEMORY]])
    # Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404: the covariance that diffusion adds in one step
    block = np.zeros((6, 6))
    block[:3, :3], block[3:, 3:], block[2, 5] = -system, system.T, 2.0 * SIGMA**2 / MEMORY
    both = expm(block * DT)
    step, added = both[3:, 3:].T, both[3:, 3:].T @ both[:3, 3:]
    covariance = [np.diag([1e-4, 0.05**2, SIGMA**2])]
    for _ in range(11):
        covariance.append(step @ covariance[-1] @ step.T + added)
    rows, noise, count = np.stack([[1.0, 0.0, 0.0], system[1]])[list(read)], np.array(NOISE)[list(read)], len(read)
    whole = np.zeros((12 * count, 12 * count))
    for i in range(12):
        for j in range(i, 12):
            between = rows @ covariance[i] @ np.linalg.matrix_power(step.T, j - i) @ rows.T
            one, other = slice(count * i, count * (i + 1)), slice(count * j, count * (j + 1))
            whole[one, other], whole[other, one] = between, between.T
    sizes = np.tile(noise, 12)
    whole = whole / np.outer(sizes, sizes) + np.eye(len(sizes))
    left = (readings - mean)[:, list(read)].ravel() / sizes
    expected = multivariate_normal(np.zeros(len(sizes)), whole).logpdf(left) - np.sum(np.log(sizes))
    values = np.array([OMEGA, ZETA, SIGMA, MEMORY, *NOISE, 0.0, 0.0, 0.0, 0.0, *harmonics])
    assert log_likelihood(data, values) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("name", [None, "quadratic_drag", "cubic_stiffness", "constant_force", "coulomb_friction"])
def test_what_acts_in_flight_is_named(name):
    strengths = {"quadratic_drag": 0.2, "cubic_stiffness": 1e5, "constant_force": 0.05, "coulomb_friction": 0.05}
    data = made([(TERMS[name][0], strengths[name])] if name else [])
    assert forward_selection(data) == ([name] if name else [])


def test_estimates_are_right_where_nothing_is_missing():
    data = made()
    found = fit(data, (), first_guess(dataclasses.replace(data, f_n=1.02 * data.f_n))).values
    assert found[0] == pytest.approx(OMEGA, rel=2e-3)
    assert found[1] == pytest.approx(ZETA, abs=2e-3)
    np.testing.assert_allclose(found[4:6], NOISE, rtol=0.1)


def test_flights_are_clear_of_the_stop(tmp_path):
    rng = np.random.default_rng(5)
    write_case(tmp_path / "rig", draw_case(rng, Order(kind="stiff", samples=(2001, 4001))), rng)
    experiment = load_experiment(tmp_path / "rig")
    data = flights(experiment)
    assert data.first[0] == 0 and data.first[-1] == len(data.t) == len(data.x) == len(data.a)
    assert len(data.cart) == len(data.first) - 1 > 10
    starts = data.first[1:-1]
    assert np.all(np.delete(np.diff(data.t), starts - 1) == pytest.approx(np.median(np.diff(data.t)), rel=1e-6))
    gap = max(record.gap for record in experiment.records)
    for k, cart in enumerate(data.cart):
        inside = slice(data.first[k], data.first[k + 1])
        assert np.all(data.x[inside] - cart[0] * np.sin(cart[1] * data.t[inside] + cart[2]) < gap + 1e-4)
