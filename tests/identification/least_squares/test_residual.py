"""Normal equations against finite differences, and their freedom from padding."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from identification.estimation.records import record_fits
from identification.experiment import ParameterOption, Prior
from identification.least_squares.block_arrow import Equations
from identification.least_squares.fit import as_arrays, evaluator, integrator_for, on_device
from identification.least_squares.priors import with_prior, without_parameter_priors, without_windows
from identification.least_squares.residual import lane_system, normal_equations, predict, residuals
from identification.windows.layout import Estimate, layout_of
from identification.windows.prepare import prepare
from vibrojax.effects import GapStep, TimeOffset


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


def test_a_channel_that_comes_early_shows_the_motion_after_the_end_of_a_window(prepared):
    """A shift by whole samples is the same window seen further on: what is read there has been integrated, and is no padding."""
    (group,), early = prepared.groups, 12
    dt = float(group.ts[0, 1] - group.ts[0, 0])
    room = np.flatnonzero(group.lengths + early + 3 <= group.ts.shape[1])
    assert len(room)
    with_offset = dataclasses.replace(prepared.model, effects=(TimeOffset(-early * dt, "hammer_displacement"),))
    model, shifted = as_arrays(prepared.model), as_arrays(with_offset)
    layouts = [layout_of(one, files=prepared.layout.files) for one in (model, shifted)]
    local = jnp.asarray(prepared.start.local(prepared.record))
    offset = jnp.full((len(local), 1), -early * dt / shifted.parameters[-1].scale)
    shared = layouts[0].shared
    moved = jnp.concatenate([local[:, :shared], offset, local[:, shared:]], axis=1)
    further = dataclasses.replace(group, lengths=group.lengths + early)
    plain, _ = predict(model, layouts[0], integrator_for(prepared), on_device(further), local)
    found, _ = predict(shifted, layouts[1], integrator_for(prepared), on_device(group), moved)
    channel = group.channels.index("hammer_displacement")
    for window in room:
        last = int(group.lengths[window]) - 1
        ahead = np.asarray(plain)[window, last - 40 + early : last + early, channel]
        np.testing.assert_allclose(np.asarray(found)[window, last - 40 : last, channel], ahead, atol=1e-9)
        assert np.ptp(ahead) > 1e-7


def test_a_failed_integration_costs_infinitely(prepared):
    """A step limit is no good fit."""
    poor = dataclasses.replace(integrator_for(prepared), contact_steps=jnp.asarray(1e9))
    assert np.isinf(evaluator(prepared, poor)(prepared.start).cost).any()


def test_a_prediction_that_broke_off_counts_as_one_that_knows_nothing(prepared):
    """Windows of which the integration failed are not a number, and as far off as the mean."""
    poor = dataclasses.replace(integrator_for(prepared), contact_steps=jnp.asarray(1e9))
    lost = np.isinf(evaluator(prepared, poor)(prepared.start).cost)
    whole, broken = (
        record_fits(prepared, integrator, prepared.start, np.full(prepared.start.nuisances.shape, np.nan))
        for integrator in (integrator_for(prepared), poor)
    )
    for index, (before, after) in enumerate(zip(whole, broken, strict=True)):
        of_lost = np.isin(after.window, np.flatnonzero(lost & (prepared.record == index)))
        assert np.array_equal(np.isnan(after.predicted["hammer_displacement"]), of_lost)
        assert np.isfinite(before.predicted["hammer_displacement"]).all()
        assert of_lost.any()
        assert np.isfinite(after.nrmse["hammer_displacement"])
        if of_lost.all():
            assert after.nrmse["hammer_displacement"] == pytest.approx(1.0)


@pytest.mark.parametrize(("file", "acts"), [("drop.csv.gz", 1.0), ("held.csv", 0.0)])
def test_what_acts_in_one_record_does_not_act_in_others_nor_where_that_record_is_not(prepared, file, acts):
    """A record that was held back has a layout without the others' files."""
    step = GapStep(gap_jump=1e-4, instant=-1.0, in_file=file)
    model = as_arrays(dataclasses.replace(prepared.model, effects=(step,)))
    layout = layout_of(model, files=prepared.layout.files)
    values = {name: float(value) for name, value in model.values().items()}
    start = dataclasses.replace(prepared.start, shared=layout.internal({p.name: values[p.name] for p in layout.parameters}))
    window = jax.tree.map(lambda leaf: leaf[0], on_device(prepared.groups[0]))
    assert prepared.layout.files[int(window.record)] == "drop.csv.gz"
    system = lane_system(model, layout, window, jnp.asarray(start.local(prepared.record)[0]))
    assert float(system.effects[0].gap_jump) == pytest.approx(1e-4 * acts)


def test_a_prior_counts_whole_in_a_fit_without_some_windows(small):
    prior = ParameterOption(prior=Prior(mean=3e6, std=1e5))
    layout = prepare(dataclasses.replace(small, parameters={"k_i": prior})).layout
    shared, count = layout.clipped(dict.fromkeys([p.name for p in layout.parameters], 1.0) | {"k_i": 3.3e6}), 4
    estimate = Estimate(shared=shared, nuisances=np.zeros((1, layout.nuisance_count)), states=np.zeros((count, layout.states)))
    nothing = Equations(
        hessian=np.zeros((count, layout.size, layout.size)),
        gradient=np.zeros((count, layout.size)),
        cost=np.zeros(count),
        record=np.zeros(count, int),
    )
    whole = with_prior(nothing, layout, estimate)
    part = without_windows(whole, layout, estimate, np.array([1]))
    assert whole.cost.sum() == pytest.approx(0.5 * 3.0**2)
    assert part.cost[1] == 0.0 and not part.hessian[1].any()
    for name in ("hessian", "gradient", "cost"):
        np.testing.assert_allclose(getattr(part, name).sum(axis=0), getattr(whole, name).sum(axis=0))
        np.testing.assert_allclose(getattr(without_parameter_priors(whole, layout, estimate), name), 0.0, atol=1e-12)
