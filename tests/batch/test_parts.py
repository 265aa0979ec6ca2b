import jax
import jax.numpy as jnp
import numpy as np

from tests.batch.rigs import model, points
from vibrojax.batch.base import Lanes
from vibrojax.batch.linear_flow import flow_of, fly, highest, point, safe_step, take_off, to_strobe
from vibrojax.batch.points import lanes_of
from vibrojax.batch.run import repeats


def flows() -> Lanes:
    return lanes_of(model(), points(np.linspace(1.0, 12.0, 200)))[0]


def test_a_safe_step_never_passes_the_stop_and_comes_to_it():
    flow = flow_of(flows().systems)
    draw = np.random.default_rng(0)
    u = jnp.asarray(flow.gap - 10.0 ** draw.uniform(-9, -2, 200))
    v, theta = jnp.asarray(draw.normal(0, 0.2, 200)), jnp.asarray(draw.uniform(0, 2 * np.pi, 200))
    flight = take_off(flow, u, v, theta)

    @jax.jit
    def nearest(flow):
        h = safe_step(flow, flight, point(flow, flight))
        parts = jnp.linspace(0.01, 1.0, 100)[:, None]
        later = jax.vmap(lambda part: fly(flow, flight, part * h, jnp.mod(theta + flow.omega_exc * part * h, 2.0 * np.pi)))(parts)
        return jnp.max(jax.vmap(lambda flight: point(flow, flight).u)(later), axis=0) - flow.gap, flow.gap - point(flow, flight).u

    nearest_after, before = nearest(flow)
    assert (nearest_after <= 1e-16).all()
    assert (-nearest_after < 0.5 * before)[v > 0.05].mean() > 0.5


def test_two_flights_make_one_and_the_highest_point_is_found():
    flow = flow_of(flows().systems)
    start = take_off(flow, jnp.full(200, -1e-3), jnp.full(200, 0.05), jnp.full(200, 0.3))
    h = jnp.full(200, 0.01)
    there = fly(flow, start, h, 0.3 + flow.omega_exc * h)
    half = fly(flow, start, 0.5 * h, 0.3 + 0.5 * flow.omega_exc * h)
    again = fly(flow, half, 0.5 * h, 0.3 + flow.omega_exc * h)
    np.testing.assert_allclose(again.a, there.a, atol=1e-17)
    np.testing.assert_allclose(again.b, there.b, atol=1e-15)
    between = jax.jit(jax.vmap(lambda p: point(flow, fly(flow, start, p * h, 0.3 + p * flow.omega_exc * h)).u))(jnp.linspace(0, 1, 400))
    np.testing.assert_allclose(highest(point(flow, start), point(flow, there), h), jnp.max(between, axis=0), atol=2e-8)
    assert (to_strobe(flow, start.theta) > 0).all()


def test_periods_are_found():
    wave = np.array([[1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [1.0, 1.0, 2.0], [1.0, 2.0, 5.0], [1.0, 1.0, 4.0], [1.0, 2.0, 6.0]])
    assert repeats(np.stack([wave, wave], axis=1), np.ones((2, 3)), 1e-9, 8).tolist() == [1, 2, 0]
