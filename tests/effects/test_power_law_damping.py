import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import Reference, assert_same, simulate, system
from tests.effects.scales import SCALES
from vibrojax.effects import PowerLawDamping

CREEP = 5e-4


def force(effect, v):
    zero = jnp.zeros_like(v)
    motion = system().motion(zero, zero, v, jnp.zeros((len(v), 0)), zero > 0)
    return np.asarray(effect.force(motion, jnp.zeros((len(v), 0))))


@pytest.mark.parametrize(("d", "exponent"), [(0.3, 0.5), (1.5, 1.5), (20.0, 3.0)])
def test_agrees_with_an_independent_integration(d, exponent):
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
