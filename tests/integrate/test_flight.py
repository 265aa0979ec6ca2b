import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from tests.integrate import rigs
from vibrojax.integrate import Landing, Smoothed, Switch

P = rigs.RIG | rigs.STATE | rigs.LAWS["hunt-crossley"][0] | dict(gap=1.0)
TS = np.linspace(0.0, 0.8, 801)


def closed_form(p, ts):
    """Exponential of the linear system of u, u', sin, cos and 1."""
    omega, omega_n = 2 * np.pi * p["frequency_hz"], 2 * np.pi * p["f_n"]
    inertia = p["base_amplitude"] * omega**2
    a = np.array(
        [
            [0, 1, 0, 0, 0],
            [-(omega_n**2), -2 * p["zeta"] * omega_n, inertia, 0, p["applied"] / p["mass"]],
            [0, 0, 0, omega, 0],
            [0, 0, -omega, 0, 0],
            [0, 0, 0, 0, 0],
        ]
    )
    start = [p["u0"], p["v0"], np.sin(p["base_phase"]), np.cos(p["base_phase"]), 1.0]
    return np.array([expm(a * t) @ start for t in ts])[:, :2].T


@pytest.mark.parametrize(
    ("integrator", "tolerance"), [(Switch(), 1e-12), (Landing(), 1e-8), (Smoothed(smoothing=1e-5, rtol=1e-11, atol=1e-14), 1e-11)], ids=str
)
def test_flight_is_the_matrix_exponential(integrator, tolerance):
    u, v = closed_form(P, TS)
    motion = integrator(rigs.system(P, "hunt-crossley"), jnp.asarray(TS), jnp.array([P["u0"], P["v0"]]))
    assert int(motion.result) == 0
    assert not motion.in_contact.any()
    assert np.abs(motion.u - u).max() < tolerance
    assert np.abs(motion.v - v).max() < 40 * tolerance


def test_the_oracle_flies_as_the_matrix_exponential():
    u, v = closed_form(P, TS)
    motion = rigs.oracle_motion(P, "hunt-crossley", TS)
    assert not motion.impacts
    assert np.abs(motion.u - u).max() < 1e-12
    assert np.abs(motion.v - v).max() < 4e-11
