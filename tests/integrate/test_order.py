"""Slopes of error against step and against smoothing width."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.integrate.rigs import ConstantForce
from vibrojax.contact import HuntCrossley, KelvinVoigt
from vibrojax.excitation import at_rest
from vibrojax.integrate import Landing, Smoothed, Switch
from vibrojax.suspension import Free
from vibrojax.system import System

TS = jnp.array([0.0, 0.02, 0.04])
STATE = jnp.array([-2e-3, 0.2])


def thrown_at_the_stop(law):
    return System(mass=0.5, suspension=Free(), law=law, gap=0.0, base=at_rest(), applied=ConstantForce(0.4))


def slope(integrator, law, widths):
    system = thrown_at_the_stop(law)
    truth = Switch()(system, TS, STATE)
    solve = jax.jit(lambda width: integrator(width)(system, TS, STATE).v[-1])
    errors = np.array([abs(solve(width) - truth.v[-1]) for width in widths])
    assert errors.min() > 1e-12, "errors at rounding level have no slope"
    return np.polyfit(np.log(widths), np.log(errors), 1)[0]


@pytest.mark.parametrize(
    ("law", "at_least"),
    [
        (KelvinVoigt(1e6, 2e-4), 3.5),
        (HuntCrossley(2e5, 1.0, 0.3), 3.5),
        (HuntCrossley(1e6, 1.5, 0.3), 2.2),
        (HuntCrossley(1e9, 2.5, 0.3), 3.2),
    ],
    ids=["kelvin-voigt", "n = 1", "n = 1.5", "n = 2.5"],
)
def test_landing_has_order_four_where_the_law_is_linear_else_n_plus_one(law, at_least):
    contact_steps = np.geomspace(20, 100, 12)
    assert -slope(lambda n: Landing(contact_steps=n, flight_step=1e-3, most_steps=200_000), law, contact_steps) > at_least


@pytest.mark.parametrize(
    ("law", "lowest", "highest"),
    [(HuntCrossley(1e6, 1.5, 0.3), 2.8, 4.0), (KelvinVoigt(1e6, 2e-4), 1.7, 2.6)],
    ids=["n = 1.5", "kelvin-voigt"],
)
def test_smoothed_converges_with_its_width(law, lowest, highest):
    order = slope(lambda width: Smoothed(width, rtol=1e-12, atol=1e-15), law, np.geomspace(1e-5, 2e-4, 10))
    assert lowest < order < highest
