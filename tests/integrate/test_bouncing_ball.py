"""Newton's restitution under a constant force: all impact times are known."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.integrate.rigs import ConstantForce
from vibrojax.contact import Newton
from vibrojax.excitation import at_rest
from vibrojax.integrate import CHATTER, STEP_LIMIT, SUCCESS, Landing, Switch
from vibrojax.suspension import Free
from vibrojax.system import System

G, HEIGHT, E = 9.81, 0.05, 0.7
FIRST = np.sqrt(2 * HEIGHT / G)
ENDS = FIRST * (1 + E) / (1 - E)
"""Time at which infinitely many impacts have happened."""


def ball(restitution=E):
    return System(mass=0.2, suspension=Free(), law=Newton(restitution), gap=HEIGHT, base=at_rest(), applied=ConstantForce(0.2 * G))


def closed_form(ts):
    starts = [0.0, FIRST]
    while starts[-1] < ts[-1]:
        starts.append(starts[-1] + 2 * G * FIRST * E ** (len(starts) - 1) / G)
    number = np.searchsorted(starts, ts, side="right") - 1
    since = ts - np.array(starts)[number]
    speed = np.where(number > 0, G * FIRST * E**number, 0.0)
    height = np.where(number > 0, 0.0, HEIGHT) + speed * since - 0.5 * G * since**2
    return HEIGHT - height, G * since - speed


@pytest.mark.parametrize("integrator", [Switch(), Landing()], ids=["switch", "landing"])
def test_bounces_at_the_known_times(integrator):
    ts = np.linspace(0.0, 0.93 * ENDS, 640)
    u, v = closed_form(ts)
    motion = integrator(ball(), jnp.asarray(ts), jnp.zeros(2))
    assert int(motion.result) == SUCCESS
    assert np.abs(motion.u - u).max() < 1e-11
    away_from_impacts = np.abs(u - HEIGHT) > 1e-6
    assert np.abs(motion.v - v)[away_from_impacts].max() < 1e-9
    assert not motion.in_contact.any()


@pytest.mark.parametrize(("integrator", "code"), [(Switch(), CHATTER), (Landing(), STEP_LIMIT)], ids=["switch", "landing"])
def test_accumulating_impacts_end_with_a_code(integrator, code):
    ts = jnp.linspace(0.0, 1.2 * ENDS, 100)
    motion = jax.jit(lambda: integrator(ball(), ts, jnp.zeros(2)))()
    assert int(motion.result) == code
    assert np.isfinite(motion.u).all()
    assert abs(motion.u[-1] - HEIGHT) < 1e-9


def test_chatter_is_noticed_where_it_ends():
    before, after = (jnp.linspace(0.0, part * ENDS, 50) for part in (0.999, 1.001))
    assert int(Switch()(ball(), before, jnp.zeros(2)).result) == SUCCESS
    assert int(Switch()(ball(), after, jnp.zeros(2)).result) == CHATTER


def test_a_lossless_ball_returns_to_its_height():
    period = 2 * FIRST
    motion = Switch()(ball(1.0), jnp.asarray(period * np.arange(6)), jnp.zeros(2))
    assert np.abs(motion.u).max() < 1e-12
    assert np.abs(motion.v).max() < 1e-11
