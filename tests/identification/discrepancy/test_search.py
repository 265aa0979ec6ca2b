"""What ends the search, and what is said of its rivals; on fits whose costs are made to order."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.assertion import TWIN, probability, twins
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import BUDGET, EXPLAINED, HELPLESS, adequate, reopened, why_ended
from tests.identification.discrepancy.made_search import fitted, round_of


@pytest.fixture(scope="module")
def noise(motion, allowed) -> np.ndarray:
    """Costs of pure noise."""
    return 0.5 * (allowed.samples - motion.prepared.layout.states).astype(float)


def test_noise_is_adequate_and_twice_the_noise_is_not(motion, allowed, noise):
    assert adequate(fitted(motion, noise), allowed)
    assert not adequate(fitted(motion, 2.0 * noise), allowed)


def test_a_few_windows_that_settled_wrongly_do_not_spoil_a_fit_and_many_do(motion, allowed, noise):
    cost = noise.copy()
    cost[:1] *= 1e3
    assert adequate(fitted(motion, cost), allowed)
    cost[: len(cost) // 10] *= 1e3
    assert not adequate(fitted(motion, cost), allowed)


@pytest.mark.parametrize("share", [0.03, 0.5, 1.0])
def test_windows_that_cannot_be_integrated_are_no_noise(motion, allowed, noise, share):
    cost = noise.copy()
    cost[: max(1, round(share * len(cost)))] = np.inf
    assert not adequate(fitted(motion, cost), allowed)


def test_a_window_without_a_single_good_sample_says_nothing(motion, allowed, noise):
    samples, cost = allowed.samples.copy(), noise.copy()
    samples[0], cost[0] = 0, 0.0
    assert adequate(fitted(motion, cost), Tolerance(samples=samples, cut=25.0))
    assert not adequate(fitted(motion, 20.0 * cost), Tolerance(samples=samples, cut=25.0))


def test_probability_is_that_of_the_information_criterion(motion, allowed, noise):
    one = round_of(motion, noise, {"coulomb_friction": 100.0, "hysteresis": 101.0})
    assert probability((one,), "coulomb_friction", allowed) == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))


def test_what_fits_about_as_well_is_a_twin(motion, allowed, noise):
    costs = {"coulomb_friction": 100.0, "hysteresis": 100.0 + 0.5 * TWIN, "quadratic_drag": 100.0 + 2.0 * TWIN}
    one = round_of(motion, noise, costs)
    assert twins((one,), ("coulomb_friction",)) == ("hysteresis",)
    assert twins((dataclasses.replace(one, rivals=one.rivals[:1]),), ("coulomb_friction",)) == ()


def test_the_search_says_why_it_ended(motion, allowed, noise):
    later, over = np.inf, -np.inf
    weak = round_of(motion, noise, {"contact_adhesion": 0.9 * noise.sum()})
    weak = dataclasses.replace(weak, cost=float(noise.sum()))  # the free initial states of windows take up more than the effect had left
    bare = dataclasses.replace(weak.scored, significant={}, found=[])
    assert why_ended(bare, allowed, [weak], later) == EXPLAINED
    assert why_ended(dataclasses.replace(bare, fitted=fitted(motion, 3.0 * noise)), allowed, [weak], later) == HELPLESS
    promising = dataclasses.replace(weak.scored, fitted=fitted(motion, 3.0 * noise))
    assert why_ended(promising, allowed, [], later) == ""
    assert why_ended(promising, allowed, [], over) == BUDGET


def test_a_round_without_its_best_ends_with_the_next_that_helps(motion, allowed, noise):
    one = round_of(motion, 3.0 * noise, {"hysteresis": 100.0, "coulomb_friction": 200.0, "quadratic_drag": 9999.9})
    (again,) = reopened(one, allowed, without=("hysteresis",))
    assert [rival.name for rival in again.rivals] == ["coulomb_friction", "quadratic_drag"]
    assert reopened(one, allowed, without=("hysteresis", "coulomb_friction")) == ()  # drag does not help
    assert reopened(one, allowed, without=tuple(rival.name for rival in one.rivals)) == ()
