"""A hammer led along a prescribed path: its motion is the path, and the channels say what it takes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from vibrojax.channels import channels
from vibrojax.contact import HuntCrossley
from vibrojax.effects import Hysteresis
from vibrojax.excitation import CubicSignal, SampledMotion, Unforced, at_rest
from vibrojax.integrate import NOT_FINITE, SUCCESS, Guided
from vibrojax.suspension import Linear
from vibrojax.system import System

TS = np.linspace(0.0, 1.0, 401)
AMPLITUDE, OMEGA, GAP = 0.02, 2 * np.pi * 2.0, 0.015
MASS, ZETA, F_N = 3.0, 0.2, 1.5
LAW = HuntCrossley(2e4, 1.5, 0.4)


def signal(values: np.ndarray) -> CubicSignal:
    spline = CubicSpline(TS, values)
    return CubicSignal(knots=jnp.asarray(spline.x), coefficients=jnp.asarray(spline.c))


def path() -> SampledMotion:
    u = AMPLITUDE * np.sin(OMEGA * TS)
    return SampledMotion(position=signal(u), second_derivative=signal(-(OMEGA**2) * u))


def rig(*effects) -> System:
    suspension = Linear(damping_ratio=ZETA, natural_frequency_hz=F_N)
    return System(MASS, suspension, LAW, GAP, at_rest(), Unforced(), effects)


def test_the_motion_is_the_path_and_the_reaction_is_spring_damper_and_stop():
    trajectory = Guided(path())(rig(), jnp.asarray(TS), jnp.zeros(2))
    u, v = AMPLITUDE * np.sin(OMEGA * TS), AMPLITUDE * OMEGA * np.cos(OMEGA * TS)
    assert int(trajectory.result) == SUCCESS
    np.testing.assert_allclose(trajectory.u, u, atol=1e-15)
    np.testing.assert_allclose(trajectory.v, v, atol=1e-5)
    np.testing.assert_array_equal(trajectory.in_contact, u > GAP)
    delta, stiffness = np.maximum(u - GAP, 0.0), MASS * (2 * np.pi * F_N) ** 2
    stop = 2e4 * delta**1.5 * (1.0 + 0.4 * v)
    reaction = stiffness * u + 2 * ZETA * MASS * 2 * np.pi * F_N * v + np.where(u > GAP, stop, 0.0)
    np.testing.assert_allclose(channels(rig(), trajectory)["reaction_force"], reaction, rtol=1e-4, atol=1e-3)


def test_a_path_that_is_not_finite_is_reported():
    broken = jax.tree.map(lambda leaf: leaf.at[..., -1].set(jnp.nan), path())
    assert int(Guided(broken)(rig(), jnp.asarray(TS), jnp.zeros(2)).result) == NOT_FINITE


def test_states_of_effects_follow_the_path():
    memory, width = Hysteresis(hysteresis_force=2.0, yield_displacement=4e-3), 4e-3
    trajectory = Guided(path())(rig(memory), jnp.asarray(TS), jnp.zeros(2))

    def rate(t, z):
        """Wen's equation with beta = gamma = 1/2, exponent 1."""
        v = AMPLITUDE * OMEGA * np.cos(OMEGA * t)
        return (v - 0.5 * abs(v) * z - 0.5 * v * abs(z)) / width

    exact = solve_ivp(rate, (0.0, 1.0), [0.0], t_eval=TS, rtol=1e-10, atol=1e-12).y[0]
    np.testing.assert_allclose(trajectory.own[:, 0], exact, atol=1e-5)


@pytest.mark.parametrize("lanes", [3])
def test_plain_jit_and_vmap_agree(lanes):
    ts, system = jnp.asarray(TS), rig()
    plain = Guided(path())(system, ts, jnp.zeros(2))
    compiled = jax.jit(lambda motion, ts: Guided(motion)(system, ts, jnp.zeros(2)).u)(path(), ts)
    many = jax.vmap(lambda motion: Guided(motion)(system, ts, jnp.zeros(2)).u)(jax.tree.map(lambda x: jnp.stack([x] * lanes), path()))
    np.testing.assert_allclose(compiled, plain.u, atol=1e-15)
    np.testing.assert_allclose(many, np.stack([plain.u] * lanes), atol=1e-15)
