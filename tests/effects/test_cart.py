"""Other motions of the cart against an independent integration."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import A0, OMEGA, PHASE, SINE, Reference, assert_same, simulate, sine
from tests.effects.scales import SCALES
from vibrojax.effects import BaseHarmonics, CartRecoil, FrequencyDrift
from vibrojax.excitation import CubicSignal, SampledMotion, at_rest

# Frequency drift


RATE = 0.1


def frequency_drift_cart(t, z):
    angle = OMEGA * (t + 0.5 * RATE * t**2) + PHASE
    return A0 * np.sin(angle), A0 * OMEGA * (1 + RATE * t) * np.cos(angle)


def test_frequency_drift_agrees_with_an_independent_integration():
    readings, trajectory = simulate(FrequencyDrift(RATE))
    assert_same(readings, Reference(cart=frequency_drift_cart))
    np.testing.assert_allclose(readings["cart_displacement"], frequency_drift_cart(np.asarray(trajectory.ts), [])[0], atol=1e-15)


def test_a_cart_at_rest_stays_there():
    base, t = FrequencyDrift(RATE).base(at_rest()), jnp.asarray([0.0, 1.0])
    for motion in (base.displacement(t), base.velocity(t), base.acceleration(t)):
        np.testing.assert_array_equal(motion, 0.0)


# Base harmonics


LINES = (0.05, -0.02, 0.01, 0.03)
EFFECT = BaseHarmonics(*LINES)


def base_harmonics_cart(t, z):
    a = OMEGA * t + PHASE
    s2, c2, s3, c3 = LINES
    y = np.sin(a) + s2 * np.sin(2 * a) + c2 * np.cos(2 * a) + s3 * np.sin(3 * a) + c3 * np.cos(3 * a)
    v = np.cos(a) + 2 * s2 * np.cos(2 * a) - 2 * c2 * np.sin(2 * a) + 3 * s3 * np.cos(3 * a) - 3 * c3 * np.sin(3 * a)
    return A0 * y, A0 * OMEGA * v


def test_base_harmonics_agrees_with_an_independent_integration():
    readings, trajectory = simulate(EFFECT)
    assert_same(readings, Reference(cart=base_harmonics_cart))
    np.testing.assert_allclose(readings["cart_displacement"], base_harmonics_cart(np.asarray(trajectory.ts), [])[0], atol=1e-15)


@pytest.mark.parametrize("base", [EFFECT.base(SINE), EFFECT.base(FrequencyDrift(0.01).base(SINE))], ids=["steady", "drifting"])
def test_derivatives_are_those_of_the_displacement(base):
    t = jnp.asarray(0.123)
    np.testing.assert_allclose(base.velocity(t), jax.grad(base.displacement)(t), rtol=1e-12)
    np.testing.assert_allclose(base.acceleration(t), jax.grad(base.velocity)(t), rtol=1e-12)


def test_harmonics_and_drift_act_together_in_either_order():
    drift, t = FrequencyDrift(0.01), jnp.asarray(2.0)
    here, there = drift.base(EFFECT.base(SINE)), EFFECT.base(drift.base(SINE))
    assert float(here.displacement(t)) == float(there.displacement(t))
    np.testing.assert_allclose(here.displacement(t), base_harmonics_cart(2.0 + 0.01 * 2.0, [])[0], rtol=1e-12)


def test_a_measured_cart_stays_as_it_is():
    signal = CubicSignal(knots=jnp.asarray([0.0, 1.0]), coefficients=jnp.zeros((4, 1)))
    measured = SampledMotion(position=signal, second_derivative=signal)
    assert EFFECT.base(measured) is measured
    assert FrequencyDrift(0.1).base(measured) is measured


def test_members_of_its_candidate_add_up():
    (members,) = BaseHarmonics.probe.candidates(SCALES)
    scaled = [one.scaled(100.0 * line) for one, line in zip(members, LINES, strict=True)]
    np.testing.assert_allclose(jax.tree.leaves(BaseHarmonics.probe.joined(scaled)), LINES, rtol=1e-12)


# Cart recoil


M_C, F_C, ZETA_C = 4.0, 18.0, 0.08
K_C, C_C = M_C * (2 * np.pi * F_C) ** 2, 2 * ZETA_C * M_C * 2 * np.pi * F_C


def cart_recoil_cart(t, z):
    y, v, _ = sine(t)
    return y + z[0], v + z[1]


def recoil(t, x, v, z, pushed, a):
    return [z[1], (pushed - C_C * z[1] - K_C * z[0]) / M_C]


def test_cart_recoil_agrees_with_an_independent_integration():
    readings, trajectory = simulate(CartRecoil(M_C, F_C, ZETA_C))
    reference = Reference(cart=cart_recoil_cart, own=[0.0, 0.0], own_rates=recoil)
    assert_same(readings, reference)
    _, pushed, z, _ = reference()
    ts = np.asarray(trajectory.ts)
    np.testing.assert_allclose(readings["cart_displacement"], sine(ts)[0] + z[:, 0], atol=1e-5 * np.abs(z[:, 0]).max())
    jolt = (pushed - C_C * z[:, 1] - K_C * z[:, 0]) / M_C
    np.testing.assert_allclose(readings["cart_acceleration"], sine(ts)[2] + jolt, atol=1e-5 * np.abs(jolt).max())
