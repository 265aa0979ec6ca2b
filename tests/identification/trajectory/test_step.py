"""The step that is taken from an estimate: its limits, steps that go back and forth, and numbers that come back from nought."""

import dataclasses

import numpy as np
import pytest

from identification.trajectory.random_force import RandomForce
from identification.trajectory.step import Stride, change, moved
from tests.identification.trajectory.conftest import FORCE, MEMORY
from tests.identification.trajectory.dense import solved


@pytest.fixture(scope="module")
def one(vibrating):
    *_, solution = solved(vibrating, RandomForce(std=FORCE, memory=MEMORY))
    return dataclasses.replace(solution, covariance=1e-12 * np.eye(2), precision=np.eye(2))


def of(solution, *step):
    return dataclasses.replace(solution, shared=np.array(step))


@pytest.mark.parametrize(("too_long", "rounds"), [(1.9, 8), (4.0, 20)])
def test_steps_that_are_too_long_come_to_rest(vibrating, one, too_long, rounds):
    """Of one parameter, each as many times too long: whole steps would go back and forth, further and further."""
    stride, x = Stride(vibrating), np.array([0.35, 0.0])
    for _ in range(rounds):
        step, share = stride.taken(vibrating.start, of(one, -too_long * x[0], 0.0))
        x = x + share * step.shared
    assert abs(x[0]) < 1e-3


def test_a_parameter_that_would_go_too_far_stops_at_its_limit_and_leaves_the_other_its_step(vibrating, one):
    stride = Stride(vibrating)
    steps = [stride.taken(vibrating.start, of(one, size, -0.2)) for size in (-0.1, -0.3, -1.4)]
    assert [share for _, share in steps] == [1.0, 1.0, 1.0]
    np.testing.assert_allclose([step.shared for step, _ in steps], [[-0.1, -0.2], [-0.3, -0.2], [-0.7, -0.2]])


def test_what_need_not_be_held_beside_a_limit_is_let_go(one):
    """Of two that both go beyond theirs, one comes back once the other is held."""
    hessian = np.array([[1.0, -0.9], [-0.9, 1.0]]) * np.outer([1.0, 0.1], [1.0, 0.1])
    both = dataclasses.replace(of(one, 2.0, 10.0), precision=hessian)
    found = both.within(np.full(2, -np.inf), np.zeros(2)).shared
    np.testing.assert_allclose(found, [0.0, 10.0 - 0.09 * 2.0 / 0.01], atol=1e-6)


def test_a_whole_step_is_shortened_alike(vibrating, one):
    step, share = Stride(vibrating).taken(vibrating.start, of(one, -1.4, -0.2), whole=True)
    assert step.shared.tolist() == [-1.4, -0.2] and share == pytest.approx(0.5)


def test_a_plain_number_may_go_on_in_proportion_to_its_size(vibrating, one):
    """At four times its first size it may move four times as far; a logarithm may not."""
    (first, *others), scale = vibrating.unknowns.shared, vibrating.border.shared_scale
    free = dataclasses.replace(vibrating.border, lower=np.full(2, -1e6), upper=np.full(2, 1e6))
    plain = dataclasses.replace(vibrating.unknowns, shared=((first[0], False), *others))
    begun = dataclasses.replace(vibrating, border=free, start=dataclasses.replace(vibrating.start, shared=scale))
    at = dataclasses.replace(vibrating.start, shared=np.array([4.0, 1.0]) * scale)
    found = [Stride(dataclasses.replace(begun, unknowns=kind)).taken(at, of(one, -9.0, 0.0))[0] for kind in (plain, vibrating.unknowns)]
    assert [step.shared[0] for step in found] == [pytest.approx(-2.8), pytest.approx(-0.7)]


def test_a_number_that_is_far_too_small_comes_back_at_once(vibrating, one):
    """At a thousandth of its first value, where readings are linear in it: the equations ask for a thousand times as much."""
    low = dataclasses.replace(vibrating.start, shared=vibrating.start.shared - [np.log(1e3), 0.0])
    step, share = Stride(vibrating).taken(low, of(one, 999.0, 0.0))
    assert share == pytest.approx(1.0)
    np.testing.assert_allclose(moved(vibrating, low, step, share).shared, vibrating.start.shared)


def test_at_a_bound_that_a_step_would_pass_there_is_no_step(vibrating, one):
    below = dataclasses.replace(vibrating.start, shared=np.array([vibrating.border.lower[0], vibrating.start.shared[1]]))
    assert change(vibrating, below, of(one, -3.0, 0.0)) == 0.0
    assert change(vibrating, below, of(one, -3.0, 1e-6)) == pytest.approx(1.0)
