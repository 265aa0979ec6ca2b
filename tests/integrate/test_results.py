"""Result codes, and one value however it is called."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.integrate import rigs
from vibrojax.contact import Newton
from vibrojax.excitation import at_rest
from vibrojax.integrate import NOT_FINITE, RESULT_MESSAGES, STEP_LIMIT, SUCCESS, Landing, Smoothed, Switch
from vibrojax.suspension import Free
from vibrojax.system import System

P = rigs.RIG | rigs.STATE | rigs.LAWS["hunt-crossley"][0]
TS = jnp.linspace(0.0, 0.5, 251)
START = jnp.array([P["u0"], P["v0"]])
each_integrator = pytest.mark.parametrize(
    "integrator", [Landing(), Switch(), Smoothed(smoothing=1e-5)], ids=["landing", "switch", "smoothed"]
)


@pytest.mark.parametrize("integrator", [Switch(max_steps=50), Smoothed(smoothing=1e-5, max_steps=50)], ids=["switch", "smoothed"])
def test_the_step_limit_is_reported(integrator):
    motion = integrator(rigs.system(P, "hunt-crossley"), TS, START)
    assert int(motion.result) == STEP_LIMIT
    assert int(motion.steps) == 50


def test_landing_reports_its_step_limit():
    motion = Landing(contact_steps=1e5)(rigs.system(P, "hunt-crossley"), TS, START)
    assert int(motion.result) == STEP_LIMIT


@each_integrator
def test_what_is_not_finite_is_reported(integrator):
    motion = integrator(rigs.system(P | dict(f_n=float("nan")), "hunt-crossley"), TS, START)
    assert int(motion.result) == NOT_FINITE
    assert "finite" in RESULT_MESSAGES[int(motion.result)]


@each_integrator
def test_plain_is_jit_is_vmap(integrator):
    tolerance = 1e-8 if isinstance(integrator, Smoothed) else 1e-11  # rounding changes its steps

    def solve(frequency):
        return integrator(rigs.system(P | dict(frequency_hz=frequency), "hunt-crossley"), TS, START).u

    frequencies = jnp.array([5.0, 6.0, 7.5])
    plain = jnp.stack([solve(frequency) for frequency in frequencies])
    assert np.allclose(jax.jit(solve)(frequencies[1]), plain[1], rtol=0, atol=tolerance)
    assert np.allclose(jax.vmap(solve)(frequencies), plain, rtol=0, atol=tolerance)


def test_landing_batch_is_one_by_one():
    frequencies, lengths = jnp.array([5.0, 6.0, 7.5]), jnp.array([251, 100, 251])
    systems = jax.tree.map(lambda leaf: jnp.full(3, leaf), rigs.system(P, "hunt-crossley"))
    systems = jax.vmap(lambda frequency: jax.tree.map(jnp.asarray, rigs.system(P | dict(frequency_hz=frequency), "hunt-crossley")))(
        frequencies
    )
    many = Landing().batch(systems, jnp.tile(TS, (3, 1)), jnp.tile(START, (3, 1)), lengths)
    assert (many.result == SUCCESS).all()
    for i, length in enumerate(lengths):
        one = Landing()(rigs.system(P | dict(frequency_hz=frequencies[i]), "hunt-crossley"), TS, START)
        assert np.allclose(many.u[i, :length], one.u[:length], rtol=0, atol=1e-12)
        assert np.array_equal(many.in_contact[i, :length], one.in_contact[:length])


@pytest.mark.parametrize("integrator", [Landing(), Switch()], ids=["landing", "switch"])
@pytest.mark.parametrize("depth", [1e-7, 1e-9])
def test_a_touch_inside_one_step_is_not_missed(integrator, depth):
    # Thrown against a constant pull of 2 m/s^2, turning `depth` beyond the stop: the touch lasts 0.6 and 0.06 ms of a 2 ms sample.
    speed = np.sqrt(2 * 2.0 * (1e-3 + depth))
    touch = np.sqrt(2 * 2.0 * depth)
    stop = System(mass=1.0, suspension=Free(), law=Newton(0.5), gap=1e-3, base=at_rest(), applied=rigs.ConstantForce(-2.0))
    motion = integrator(stop, jnp.arange(0.0, 0.05, 2e-3), jnp.array([0.0, speed]))
    assert abs(float(motion.approach_speed[-1]) - touch) < 1e-6 * touch


def test_a_rigid_stop_cannot_be_smoothed():
    with pytest.raises(TypeError, match="rigid stop"):
        Smoothed(smoothing=1e-5)(rigs.system(P | dict(e=0.5), "newton"), TS, START)
