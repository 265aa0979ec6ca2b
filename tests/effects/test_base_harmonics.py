import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import A0, OMEGA, PHASE, SINE, Reference, assert_same, simulate
from tests.effects.scales import SCALES
from vibrojax.effects import BaseHarmonics, FrequencyDrift
from vibrojax.excitation import CubicSignal, SampledMotion

LINES = (0.05, -0.02, 0.01, 0.03)
EFFECT = BaseHarmonics(*LINES)


def cart(t, z):
    a = OMEGA * t + PHASE
    s2, c2, s3, c3 = LINES
    y = np.sin(a) + s2 * np.sin(2 * a) + c2 * np.cos(2 * a) + s3 * np.sin(3 * a) + c3 * np.cos(3 * a)
    v = np.cos(a) + 2 * s2 * np.cos(2 * a) - 2 * c2 * np.sin(2 * a) + 3 * s3 * np.cos(3 * a) - 3 * c3 * np.sin(3 * a)
    return A0 * y, A0 * OMEGA * v


def test_agrees_with_an_independent_integration():
    readings, trajectory = simulate(EFFECT)
    assert_same(readings, Reference(cart=cart))
    np.testing.assert_allclose(readings["cart_displacement"], cart(np.asarray(trajectory.ts), [])[0], atol=1e-15)


@pytest.mark.parametrize("base", [EFFECT.base(SINE), EFFECT.base(FrequencyDrift(0.01).base(SINE))], ids=["steady", "drifting"])
def test_derivatives_are_those_of_the_displacement(base):
    t = jnp.asarray(0.123)
    np.testing.assert_allclose(base.velocity(t), jax.grad(base.displacement)(t), rtol=1e-12)
    np.testing.assert_allclose(base.acceleration(t), jax.grad(base.velocity)(t), rtol=1e-12)


def test_harmonics_and_drift_act_together_in_either_order():
    drift, t = FrequencyDrift(0.01), jnp.asarray(2.0)
    here, there = drift.base(EFFECT.base(SINE)), EFFECT.base(drift.base(SINE))
    assert float(here.displacement(t)) == float(there.displacement(t))
    np.testing.assert_allclose(here.displacement(t), cart(2.0 + 0.01 * 2.0, [])[0], rtol=1e-12)


def test_a_measured_cart_stays_as_it_is():
    signal = CubicSignal(knots=jnp.asarray([0.0, 1.0]), coefficients=jnp.zeros((4, 1)))
    measured = SampledMotion(position=signal, second_derivative=signal)
    assert EFFECT.base(measured) is measured
    assert FrequencyDrift(0.1).base(measured) is measured


def test_members_of_its_candidate_add_up():
    (members,) = BaseHarmonics.probe.candidates(SCALES)
    scaled = [one.scaled(100.0 * line) for one, line in zip(members, LINES, strict=True)]
    np.testing.assert_allclose(jax.tree.leaves(BaseHarmonics.probe.joined(scaled)), LINES, rtol=1e-12)
