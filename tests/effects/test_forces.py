"""Forces on the hammer against an independent integration, and what each says of itself."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import START, Reference, assert_same, simulate, sine, system
from tests.effects.scales import SCALES
from vibrojax.effects import (
    AsymmetricDamping,
    ConstantForce,
    CoulombFriction,
    CubicStiffness,
    ForceSaturation,
    Hysteresis,
    Motion,
    PowerLawDamping,
    QuadraticDrag,
    QuinticStiffness,
    SecondMode,
)

# Coulomb friction


def test_coulomb_friction_agrees_with_an_independent_integration():
    readings, _ = simulate(CoulombFriction(0.05))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -0.05 * np.tanh(v / 5e-4)), within=1e-4)


# Quadratic drag


def test_quadratic_drag_agrees_with_an_independent_integration():
    readings, _ = simulate(QuadraticDrag(3.0))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -3.0 * v * abs(v)))


# Power law damping


CREEP = 5e-4


def force(effect, v):
    zero = jnp.zeros_like(v)
    motion = system().motion(zero, zero, v, jnp.zeros((len(v), 0)), zero > 0)
    return np.asarray(effect.force(motion, jnp.zeros((len(v), 0))))


@pytest.mark.parametrize(("d", "exponent"), [(0.3, 0.5), (1.5, 1.5), (20.0, 3.0)])
def test_power_law_damping_agrees_with_an_independent_integration(d, exponent):
    readings, _ = simulate(PowerLawDamping(d, exponent))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -d * v * (v * v + CREEP**2) ** ((exponent - 1) / 2)))


@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.5, 2.0, 3.0])
def test_is_the_power_law_well_above_creep(exponent):
    v = jnp.asarray([-0.3, -0.05, 0.05, 0.3])
    np.testing.assert_allclose(force(PowerLawDamping(2.0, exponent), v), -2.0 * np.sign(v) * np.abs(v) ** exponent, rtol=2e-4)


def test_an_exponent_below_one_is_a_switch_that_steps_resolve_and_one_above_is_none():
    assert float(PowerLawDamping(1.0, 0.5).switch_speed) == CREEP
    assert float(PowerLawDamping(1.0, 1.5).switch_speed) == np.inf
    v = jnp.asarray([-1e-6, 0.0, 1e-6])
    np.testing.assert_allclose(np.diff(force(PowerLawDamping(1.0, 0.5), v)), -1e-6 * CREEP**-0.5, rtol=1e-5)


def test_candidates_have_one_force_at_the_highest_speed():
    found = [one for (one,) in PowerLawDamping.probe.candidates(SCALES)]
    assert [one.exponent for one in found] == [0.5, 1.5, 2.5, 3.0]
    np.testing.assert_allclose([one.power_coefficient * SCALES.speed**one.exponent for one in found], 0.01 * SCALES.flight_force)
    assert PowerLawDamping.probe.candidates(dataclasses.replace(SCALES, speed=0.0)) == ()


# Asymmetric damping


def test_asymmetric_damping_agrees_with_an_independent_integration():
    readings, _ = simulate(AsymmetricDamping(1.6))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -(0.8 if v > 0.0 else -0.8) * v))


@pytest.mark.parametrize(("velocity", "coefficient"), [(0.3, 2.5), (-0.3, 1.5)])
def test_the_coefficients_of_the_two_directions_lie_about_the_nominal_one(velocity, coefficient):
    zero = jnp.zeros(())
    motion = Motion(t=zero, u=zero, v=jnp.asarray(velocity), indentation=zero, indentation_rate=zero, in_contact=jnp.asarray(False))
    nominal = -2.0 * velocity
    assert float(nominal + AsymmetricDamping(1.0).force(motion, jnp.zeros(0))) == pytest.approx(-coefficient * velocity)


# Cubic stiffness


@pytest.mark.parametrize("k_3", [2e6, -2e5])
def test_cubic_stiffness_agrees_with_an_independent_integration(k_3):
    readings, _ = simulate(CubicStiffness(k_3))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -k_3 * u**3))


# Quintic stiffness


@pytest.mark.parametrize("k_5", [6e10, -6e9])
def test_quintic_stiffness_agrees_with_an_independent_integration(k_5):
    readings, _ = simulate(QuinticStiffness(k_5))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -k_5 * u**5))


# Force saturation


@pytest.mark.parametrize(("force", "threshold"), [(0.4, 5e-4), (2.0, 3e-3)])
def test_force_saturation_agrees_with_an_independent_integration(force, threshold):
    readings, _ = simulate(ForceSaturation(force, threshold))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -force * np.clip(u / threshold, -1.0, 1.0)))


def test_within_a_threshold_out_of_reach_it_is_a_linear_spring():
    readings, _ = simulate(ForceSaturation(30.0, 0.1))
    assert_same(readings, Reference(extra=lambda t, u, v, z: -300.0 * u))


def test_thresholds_lie_within_the_motion():
    found = [candidate[0] for candidate in ForceSaturation.probe.candidates(SCALES)]
    assert all(0.0 < one.threshold < SCALES.amplitude for one in found)
    assert len({one.threshold for one in found}) == len(found)
    assert ForceSaturation.probe.candidates(dataclasses.replace(SCALES, amplitude=0.0)) == ()


# Constant force


def test_constant_force_agrees_with_an_independent_integration():
    readings, _ = simulate(ConstantForce(0.2))
    assert_same(readings, Reference(extra=lambda t, u, v, z: 0.2))


# Hysteresis


F_H, D = 0.1, 1e-3


def memory(t, x, v, z, pushed, a):
    relative = v - sine(t)[1]
    return [(relative - 0.5 * abs(relative) * z[0] - 0.5 * relative * abs(z[0])) / D]


def test_hysteresis_agrees_with_an_independent_integration():
    readings, trajectory = simulate(Hysteresis(F_H, D))
    reference = Reference(extra=lambda t, u, v, z: -F_H * z[0], own_rates=memory, own=[0.0])
    assert_same(readings, reference)
    np.testing.assert_allclose(trajectory.own[:, 0], reference()[2][:, 0], atol=1e-4)


def test_saturates_at_one_and_unloads_in_a_straight_line():
    def rate(v, z):
        zero = jnp.asarray(0.0)
        motion = Motion(t=zero, u=zero, v=jnp.asarray(v), indentation=zero, indentation_rate=zero, in_contact=jnp.asarray(False))
        return float(Hysteresis(F_H, D).rates(motion, jnp.asarray([z]), zero, zero)[0])

    assert rate(0.2, 1.0) == rate(-0.2, -1.0) == 0.0
    np.testing.assert_allclose([rate(-0.2, 1.0), rate(-0.2, 0.3)], -0.2 / D, rtol=1e-15)


# Second mode


M_2, F_2, ZETA_2 = 0.03, 30.0, 0.02
K_2, C_2 = M_2 * (2 * np.pi * F_2) ** 2, 2 * ZETA_2 * M_2 * 2 * np.pi * F_2


class WithMode(Reference):
    """States x, v of the hammer and x2, v2 of the mode, all absolute."""

    def __init__(self):
        y, v, _ = sine(0.0)
        super().__init__(own=[START[0] + y, START[1] + v], own_rates=self.mode)

    def rates(self, t, state, touching):
        x, v, x2, v2 = state
        self.extra = lambda *_: K_2 * (x2 - x) + C_2 * (v2 - v)
        return super().rates(t, state, touching)

    def mode(self, t, x, v, z, pushed, a):
        return [z[1], (K_2 * (x - z[0]) + C_2 * (v - z[1])) / M_2]


def test_second_mode_agrees_with_an_independent_integration():
    readings, trajectory = simulate(SecondMode(M_2, F_2, ZETA_2))
    assert_same(readings, WithMode())
    u, _, z, _ = WithMode()()
    x = u + sine(np.asarray(trajectory.ts))[0]
    np.testing.assert_allclose(trajectory.own[:, 0], z[:, 0] - x, atol=1e-5 * np.abs(z[:, 0] - x).max())


@pytest.mark.parametrize("effect", [CubicStiffness, QuinticStiffness, ForceSaturation, Hysteresis])
def test_what_acts_in_a_spring_is_not_looked_for_without_one(effect):
    assert effect.probe.candidates(SCALES)
    assert not effect.probe.candidates(dataclasses.replace(SCALES, f_n=0.0))
