"""The smoothed contact switch: exactly free in flight, exactly the law in depth, and convergent in between."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.contact.single_impact import single_impact
from vibrojax.contact import HuntCrossley, KelvinVoigtClipped, smoothed_force

NONLINEAR = HuntCrossley(impact_stiffness=1e7, impact_exponent=1.5, impact_damping=0.5)
JUMPING = KelvinVoigtClipped(impact_stiffness=1e5, impact_damping=1e-3)
WIDTHS = np.array([4e-4, 2e-4, 1e-4, 5e-5])
SPEED = jnp.asarray(0.4)


def sharp(law, indentation):
    return jnp.where(indentation > 0, law.force(jnp.maximum(indentation, 0.0), SPEED, SPEED), 0.0)


def smoothed(law, indentation, width):
    return smoothed_force(law, indentation, SPEED, SPEED, width)


def slopes(errors):
    return np.diff(np.log(errors)) / np.diff(np.log(WIDTHS))


@pytest.mark.parametrize("law", [NONLINEAR, JUMPING])
def test_nothing_changes_beyond_half_the_width(law):
    deep, away = jnp.linspace(0.5001e-4, 1e-3, 50), jnp.linspace(-1e-3, -0.5001e-4, 50)
    np.testing.assert_allclose(smoothed(law, deep, 1e-4), sharp(law, deep), rtol=1e-15)
    np.testing.assert_array_equal(smoothed(law, away, 1e-4), 0.0)


@pytest.mark.parametrize("law", [NONLINEAR, JUMPING])
def test_width_zero_is_the_discontinuous_law(law):
    indentation = jnp.linspace(-1e-3, 1e-3, 101)
    np.testing.assert_array_equal(smoothed(law, indentation, 0.0), sharp(law, indentation))


@pytest.mark.parametrize(("law", "largest", "integral"), [(NONLINEAR, 1.5, 2.5), (JUMPING, 0.0, 1.0)])
def test_order_in_the_width(law, largest, integral):
    grid = jnp.linspace(-2.5e-4, 2.5e-4, 40001)
    errors = [np.abs(smoothed(law, grid, width) - sharp(law, grid)) for width in WIDTHS]
    np.testing.assert_allclose(slopes([e.max() for e in errors]), largest, atol=0.06)
    np.testing.assert_allclose(slopes([e.sum() for e in errors]), integral, atol=0.05)


@pytest.mark.parametrize("law", [NONLINEAR, JUMPING])
def test_a_free_impact_keeps_its_restitution_and_depth_at_every_width(law):
    exact, smooth = single_impact(law, 0.4, 0.4), single_impact(law, 0.4, 0.4, smoothing=WIDTHS[0])
    assert smooth.restitution == pytest.approx(exact.restitution, rel=1e-9)
    assert smooth.deepest == pytest.approx(exact.deepest, rel=1e-9)
    assert smooth.loop_area == pytest.approx(exact.loop_area, rel=1e-6)


@pytest.mark.parametrize(("law", "order"), [(NONLINEAR, 3.5), (JUMPING, 2.0)])
def test_order_of_the_duration_of_an_impact(law, order):
    exact = single_impact(law, 0.4, 0.4)
    extra = 0.5 * WIDTHS / 0.4 * (1 + 1 / exact.restitution)  # the way from the edge of the smoothed law to the touch and back
    durations = np.array([single_impact(law, 0.4, 0.4, smoothing=width).duration for width in WIDTHS])
    np.testing.assert_allclose(slopes(np.abs(durations - extra - exact.duration)), order, atol=0.15)


def test_smoothed_force_is_twice_differentiable_across_the_touch():
    def curvature(x):
        return jax.grad(jax.grad(lambda x: smoothed(JUMPING, x, 1e-4)))(x)

    for edge in (-0.5e-4, 0.5e-4):
        inside, outside = curvature(jnp.asarray(edge * (1 - 1e-6))), curvature(jnp.asarray(edge * (1 + 1e-6)))
        assert abs(inside - outside) < 1e-4 * abs(curvature(jnp.asarray(0.5 * edge)))
