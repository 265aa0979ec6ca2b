"""The covariance of the random force, and where its knots lie."""

import dataclasses

import numpy as np
import pytest

from identification.least_squares.fit import integrator_for
from identification.likelihood import random_force
from identification.likelihood.linearised import Linearised, linearised
from identification.likelihood.noise import white
from identification.likelihood.random_force import KNOTS_PER_PERIOD, MOST_KNOTS, ForceResponse, RandomForce, force_response, hats, knots
from identification.likelihood.response import force_responses
from identification.windows.prepare import prepare
from tests.identification.likelihood.made_windows import NOISE

DT = 1.0 / 4000.0


def windows(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and lengths of two windows of a record, the second shorter by half and padded."""
    return DT * (np.arange(samples) + np.array([[0], [samples]])), np.array([samples, samples // 2])


@pytest.mark.parametrize("memory", [1e-4, 3e-3, 2.0])
def test_root_is_that_of_the_exponential_covariance(memory):
    """Also where the knots are not evenly spaced."""
    places = np.cumsum(np.random.default_rng(0).uniform(1e-3, 5e-3, 12))
    root = RandomForce(std=3.0, memory=memory).root(places)
    np.testing.assert_array_equal(root, np.tril(root))
    expected = 9.0 * np.exp(-np.abs(places[:, None] - places) / memory)
    np.testing.assert_allclose(root @ root.T, expected, rtol=1e-10, atol=1e-13)
    np.testing.assert_allclose(root, np.linalg.cholesky(expected), rtol=1e-8, atol=1e-12)


def test_knots_are_even_and_reach_to_the_end_of_the_longest_window():
    places = knots(*windows(400), 20.0)
    assert places[0] == 0.0
    np.testing.assert_allclose(np.diff(places), places[1], rtol=1e-12)
    assert places[-2] < 399 * DT <= places[-1] * (1 + 1e-12)


def test_spacing_follows_the_fastest_vibration_in_whole_samples():
    """A period holds 200 samples, and 28 knots would be 7.1 samples apart."""
    assert 7.0 < 1.0 / (20.0 * KNOTS_PER_PERIOD) / DT < 8.0
    assert knots(*windows(400), 20.0)[1] == pytest.approx(8 * DT, rel=1e-12)


@pytest.mark.parametrize("fastest", [0.0, 1e4])
def test_no_knot_is_nearer_to_the_next_than_four_samples(fastest):
    """Where nothing vibrates, and where it vibrates faster than the record shows."""
    assert knots(*windows(200), fastest)[1] == pytest.approx(4 * DT, rel=1e-12)


@pytest.mark.parametrize(("samples", "expected"), [(619, 79), (2000, 78), (20000, 80)])
def test_a_long_window_has_no_more_knots_than_allowed(samples, expected):
    """Spacings are whole samples, so that a few may be left over."""
    assert len(knots(*windows(samples), 50.0)) == expected <= MOST_KNOTS


ROUNDING = 1e-12
MASS = 0.3
"""kg; any, since both sides of a comparison take it."""


@pytest.fixture(scope="module")
def moving(small) -> Linearised:
    """Windows of a drop test and a driven cart with impacts, sampled at exact steps; one has a dropout, one is sampled at another rate."""
    prepared = prepare(small)
    at = linearised(prepared, integrator_for(prepared), prepared.start)
    weight = at.weight.copy()
    ts = np.broadcast_to(np.arange(at.ts.shape[1]) / 4096.0, at.ts.shape).copy()
    weight[0, 100:130, 0] = 0.0
    ts[1] *= 4.0
    return dataclasses.replace(at, weight=weight, ts=ts)


@pytest.fixture(scope="module", params=["white", "coloured"])
def whitening(request, moving):
    """White noise, or autoregressions of order two and three in turn."""
    coloured = list(NOISE.values())
    return {name: white() if request.param == "white" else coloured[index % 2] for index, name in enumerate(moving.channels)}


@pytest.fixture(scope="module")
def responding(moving, whitening):
    """The response to the random force, and the same sample by sample: every knot's force followed through the whole window."""
    places = knots(moving.ts, moving.lengths, 20.0)
    whole = np.stack(
        [moving.over_noise(force_responses(moving, MASS, one[:, None])[:, 0], whitening) for one in hats_of(moving, places)], 1
    )
    return force_response(moving, MASS, places, whitening), whole


def hats_of(at: Linearised, places: np.ndarray):
    return hats(at, places).transpose(1, 0, 2)


def error(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference over the largest number."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def test_a_response_is_that_of_a_force_followed_through_the_window(responding):
    found, whole = responding
    assert found.near.shape[2] < whole.shape[-1] / 4 and found.state.any()
    assert error(found.dense, whole) < ROUNDING


def test_pieces_in_small_parts_give_the_same(responding, moving, whitening, monkeypatch):
    monkeypatch.setattr(random_force, "_AT_ONCE", 1)
    found = force_response(moving, MASS, knots(moving.ts, moving.lengths, 20.0), whitening)
    assert error(found.dense, responding[0].dense) < ROUNDING
    assert error(found.gram, responding[0].gram) < ROUNDING


def test_inner_products_of_responses_are_those_of_all_samples(responding, moving, whitening):
    found, whole = responding
    rows = moving.over_noise(moving.jacobian, whitening)
    flat = [values.reshape(*values.shape[:2], -1) for values in (whole, rows)]
    assert error(found.products(rows), flat[0] @ flat[1].transpose(0, 2, 1)) < ROUNDING
    assert error(found.gram, flat[0] @ flat[0].transpose(0, 2, 1)) < ROUNDING


def test_responses_kept_as_a_whole_give_the_same(responding, moving, whitening):
    found, whole = responding
    other, rows = ForceResponse.whole(whole), moving.over_noise(moving.jacobian, whitening)
    np.testing.assert_array_equal(other.dense, whole)
    assert error(other.products(rows), found.products(rows)) < ROUNDING
    assert error(other.gram, found.gram) < ROUNDING


def test_some_windows_of_a_response_are_theirs(responding):
    found, whole = responding
    assert error(found[np.array([1])].dense, whole[1:2]) < ROUNDING


def test_inner_products_stay_positive_where_a_window_diverges(moving, whitening):
    """The motion grows by eight orders and more along one direction and shrinks along the other, so that the terms of a product cancel."""
    growth = np.exp(40.0 * (moving.ts - moving.ts[:, :1]))
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    stretch = np.zeros((*growth.shape, 2, 2))
    stretch[..., 0, 0], stretch[..., 1, 1] = growth, 1.0 / growth
    at = dataclasses.replace(moving, fundamental=turn @ stretch @ turn.T, flow=np.zeros_like(moving.flow))
    gram = force_response(at, MASS, knots(at.ts, at.lengths, 20.0), whitening).gram
    scale = np.sqrt(np.einsum("lkk->lk", gram))
    lowest = np.linalg.eigvalsh(gram / np.maximum(scale[:, :, None] * scale[:, None, :], 1e-300)).min(axis=1)
    assert growth.max() > 1e8 and np.all(lowest > -1e-13)
