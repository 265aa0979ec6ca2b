"""Normal equations against finite differences, and their freedom from padding."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.fit import as_arrays, evaluator, integrator_for, on_device
from identification.prepare import prepare
from identification.residual import normal_equations, residuals


@pytest.fixture(scope="module")
def prepared(small):
    """Windows of the small experiment and a start near its end."""
    return prepare(small)


def test_gradient_is_that_of_the_cost(prepared):
    """Forward-mode gradient of every window against central differences of its cost, in all ten directions.

    To 1e-4 of the largest possible slope: the number of steps in a contact changes by whole steps, which the differences see.
    """
    (group,), model, layout = prepared.groups, as_arrays(prepared.model), prepared.layout
    integrator, windows = integrator_for(prepared, refinement=2.0), on_device(group)
    local = prepared.start.local(prepared.record)
    found = normal_equations(model, layout, integrator, windows, jnp.asarray(local))

    def cost(vector):
        return 0.5 * np.sum(np.asarray(residuals(model, layout, integrator, windows, jnp.asarray(vector))[0]) ** 2, axis=(1, 2))

    for k in range(layout.size):
        step = 0.1 / np.sqrt(np.asarray(found.hessian)[:, k, k].max())
        shift = step * np.eye(layout.size)[k]
        central = (cost(local + shift) - cost(local - shift)) / (2 * step)
        scale = np.sqrt(np.asarray(found.hessian)[:, k, k] * 2 * np.asarray(found.cost))
        assert np.abs(np.asarray(found.gradient)[:, k] - central).max() <= 1e-4 * scale.max()


def test_cost_is_half_the_squared_residual(prepared):
    """The two compiled programs agree."""
    (group,), model = prepared.groups, as_arrays(prepared.model)
    local = jnp.asarray(prepared.start.local(prepared.record))
    arguments = (model, prepared.layout, integrator_for(prepared), on_device(group), local)
    residual, result = residuals(*arguments)
    np.testing.assert_allclose(normal_equations(*arguments).cost, 0.5 * jnp.sum(residual**2, axis=(1, 2)), rtol=1e-10)
    assert not np.any(result)


def test_padding_does_not_count(prepared):
    """Longer padding changes no cost."""
    (group,) = prepared.groups
    extra = [(0, 0), (0, 37)]
    wider = dataclasses.replace(
        group,
        ts=np.concatenate([group.ts, group.ts[:, -1:] + 2.5e-4 * np.arange(1, 38)], axis=1),
        measured=np.pad(group.measured, [*extra, (0, 0)]),
        weight=np.pad(group.weight, [*extra, (0, 0)]),
    )
    integrator = integrator_for(prepared)
    before = evaluator(prepared, integrator)(prepared.start)
    after = evaluator(prepared.with_groups((wider,)), integrator)(prepared.start)
    np.testing.assert_allclose(after.cost, before.cost, rtol=1e-12)


def test_a_failed_integration_costs_infinitely(prepared):
    """A step limit is no good fit."""
    poor = dataclasses.replace(integrator_for(prepared), contact_steps=jnp.asarray(1e9))
    assert np.isinf(evaluator(prepared, poor)(prepared.start).cost).any()
