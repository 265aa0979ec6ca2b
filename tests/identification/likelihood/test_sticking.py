"""A hammer that dry friction brings to rest in the middle of a window."""

import dataclasses

import numpy as np
import pytest

from benchmarks.contact_free.rigs import Job, write_rig
from identification.diagnosis.refit import with_model
from identification.experiment import load_experiment
from identification.likelihood.fitted import first_point
from identification.likelihood.joint import JointMode, Point, point
from identification.windows.prepare import prepare
from vibrojax.effects import CoulombFriction


@pytest.fixture(scope="module")
def rest(tmp_path_factory) -> Point:
    """Two free decays, simulated by others, with the friction that acts there and a random force that is not zero."""
    folder = tmp_path_factory.mktemp("rig")
    concealed = write_rig(folder, Job(kind="sprung", effect="coulomb_friction", seed=1, index=0))
    experiment = load_experiment(folder)
    prepared = prepare(dataclasses.replace(experiment, records=experiment.records[:2]))
    model = dataclasses.replace(prepared.model, effects=(CoulombFriction(concealed["friction_force"]),))
    start = prepared.start
    begin = first_point(with_model(prepared, model, start.nuisances, start.states), start_of(prepared, model))
    shape = begin.estimate.force.shape
    force = 0.1 * begin.variances.force.std * np.random.default_rng(0).normal(size=shape)
    return point(begin.prepared, dataclasses.replace(begin.estimate, force=force), begin.variances)


def start_of(prepared, model):
    """The start of the fit with an effect."""
    return with_model(prepared, model, prepared.start.nuisances, prepared.start.states).start


def test_windows_that_forget_their_start_are_those_where_it_rests(rest):
    """All of them here; none where the same motion is viscous."""
    windows, transitions = rest.at.forgetful
    assert len(windows) == len(rest.at.record)
    assert np.all(np.abs(rest.at.v).min(axis=1) < 1e-3) and np.isfinite(transitions).all()
    viscous = with_model(
        rest.prepared, dataclasses.replace(rest.prepared.model, effects=()), rest.estimate.nuisances, rest.prepared.start.states
    )
    assert len(first_point(viscous, viscous.start).at.forgetful[0]) == 0


def test_a_response_does_not_follow_from_the_initial_state_where_that_is_forgotten(rest):
    """It is kept sample by sample."""
    assert rest.answer.is_whole and np.abs(rest.answer.dense).max() > 0.0


@pytest.mark.thorough
def test_the_gradient_by_the_random_force_is_right_where_the_hammer_rests(rest):
    """By central differences at every tenth knot; the derivative by the initial state alone gives the wrong sign there."""
    windows, _ = rest.at.forgetful
    inverse = np.linalg.inv(rest.variances.root @ rest.variances.root.T)
    inner = rest.inner
    data = inner.cross[..., 0] + (inner.force @ rest.estimate.force[..., None])[..., 0]
    gradient = rest.weight[:, None] * (data + rest.estimate.force @ inverse)
    knots = range(5, rest.estimate.force.shape[1], 10)
    for window in windows[:2]:
        slopes = []
        for knot in knots:
            step = np.zeros_like(rest.estimate.force)
            step[window, knot] = 1e-3 * rest.variances.force.std
            up, down = (
                point(rest.prepared, dataclasses.replace(rest.estimate, force=rest.estimate.force + sign * step), rest.variances).cost
                for sign in (1.0, -1.0)
            )
            slopes.append((up - down) / (2.0 * step[window, knot]))
        np.testing.assert_allclose(gradient[window, list(knots)], slopes, atol=0.05 * np.abs(slopes).max())


def test_friction_and_damping_that_explain_nearly_the_same_are_parted(rest):
    """The mode lies in a curved valley: with steps of first order the iteration is still tens of nats away."""
    find = JointMode(most_iterations=60)
    assert find.to_go(find(rest)) < 3.0
