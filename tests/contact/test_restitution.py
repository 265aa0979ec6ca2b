"""Restitution of a law for many speeds at once, against SciPy's integration of one impact."""

import jax.numpy as jnp
import numpy as np
import pytest

from tests.contact.single_impact import single_impact
from vibrojax.contact import (
    Flores,
    Hertz,
    HuntCrossley,
    HuntCrossleySeparate,
    KelvinVoigt,
    KelvinVoigtClipped,
    LankaraniNikravesh,
    Newton,
    NoContact,
    restitution,
)
from vibrojax.effects import DeepStop

SPEEDS = (0.01, 0.1, 1.0)


@pytest.mark.parametrize(
    "law",
    [
        HuntCrossley(1e6, 1.5, 0.6),
        HuntCrossley(1e4, 1.7, 10.0),
        HuntCrossley(1e6, 0.8, 3.0),
        HuntCrossleySeparate(1e6, 1.5, 0.5, 0.9),
        KelvinVoigt(1e5, 1e-4),
        KelvinVoigtClipped(1e5, 1e-4),
        Hertz(1e6, 1.5),
        HuntCrossley(1e6, 1.5, 200.0),
        KelvinVoigt(1e5, 2e-3),
        Flores(1e6, 1.5, 0.3),
        LankaraniNikravesh(1e6, 1.5, 0.8),
    ],
    ids=lambda law: law.name,
)
def test_is_that_of_one_impact_after_the_other(law):
    found = restitution(law, 0.5, jnp.asarray(SPEEDS))
    np.testing.assert_allclose(found, [single_impact(law, 0.5, speed).restitution for speed in SPEEDS], atol=5e-5)


def test_a_hard_stop_behind_a_soft_one_makes_the_mass_take_its_time_and_still_come_back():
    law, _ = DeepStop(stiffness=1e7, depth=0.01, damping=0.0).stop(HuntCrossley(200.0, 1.0, 1e-6), 0.0)
    np.testing.assert_allclose(restitution(law, 0.2, jnp.asarray([0.2, 0.3, 1.0])), 1.0, atol=2e-3)


def test_a_rigid_stop_has_its_own():
    np.testing.assert_allclose(restitution(Newton(0.8), 0.5, jnp.asarray(SPEEDS)), 0.8)


def test_a_hammer_that_nothing_sends_back_has_none():
    assert np.isnan(restitution(NoContact(), 0.5, jnp.asarray(SPEEDS))).all()


def test_a_damping_too_large_for_the_steps_is_not_reported_as_a_rebound_into_the_stop():
    assert np.isnan(restitution(KelvinVoigt(1e5, 1.0), 0.5, jnp.asarray([0.5]))).all()


def test_single_precision_stays_so():
    law = HuntCrossley(*(jnp.float32(value) for value in (1e6, 1.5, 0.6)))
    found = restitution(law, jnp.float32(0.5), jnp.asarray(SPEEDS, jnp.float32))
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, restitution(HuntCrossley(1e6, 1.5, 0.6), 0.5, jnp.asarray(SPEEDS)), atol=1e-4)
