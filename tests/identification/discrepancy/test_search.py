"""What ends the search, and what is said of its rivals; on fits whose costs are made to order."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy import search
from identification.discrepancy.adequate import adequate
from identification.discrepancy.assertion import TWIN, probability, twins
from identification.discrepancy.continuity import whole_cost
from identification.discrepancy.drift import Drift
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import BUDGET, DRIFTING, EXPLAINED, HELPLESS, RESTLESS, leaves_noise, reopened, why_ended
from tests.identification.discrepancy.made_search import fitted, round_of, stage
from vibrojax.effects import CoulombFriction, QuadraticDrag


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


@pytest.mark.parametrize(
    ("first", "left", "noise_is_left"),
    [
        (1.09, 1.05, False),  # half of it: the rest may be what a noise figure is off by, but so may nearly have been all
        (1.09, 1.005, True),  # noise as stated
        (1.02, 1.005, True),
        (1.04, 1.015, False),
        (3.0, 1.05, True),  # nearly all of it
        (3.0, 1.2, False),
        (None, 1.05, True),  # the nominal model
    ],
)
def test_what_explains_a_part_of_a_small_misfit_leaves_no_noise(motion, allowed, first, left, noise_is_left):
    after = fitted(motion, left * 0.5 * allowed.samples.astype(float))
    rounds = [] if first is None else [stage(motion, allowed, first, left, CoulombFriction(friction_force=0.1))]
    assert leaves_noise(after, allowed, rounds) is noise_is_left


@pytest.mark.parametrize(("loose_at_first", "loose_at_last", "ended"), [(True, True, RESTLESS), (False, True, ""), (True, False, "")])
def test_two_effects_are_enough_where_the_first_never_held_still(motion, allowed, monkeypatch, loose_at_first, loose_at_last, ended):
    """A third may have helped where it did for a while, or where the second made it hold still."""
    friction, drag = CoulombFriction(friction_force=0.1), QuadraticDrag(drag_coefficient=0.01)
    rounds = [stage(motion, allowed, 9.0, 5.0, friction), stage(motion, allowed, 5.0, 3.0, friction, drag)]
    loose = {1: loose_at_first, 2: loose_at_last}
    monkeypatch.setattr(search, "unsteady", lambda fitted, allowed: fitted.names[:1] if loose[len(fitted.names)] else ())
    promising = dataclasses.replace(rounds[0].scored, fitted=rounds[1].rivals[0].fitted)
    assert why_ended(promising, allowed, rounds, np.inf) == ended
    assert why_ended(promising, allowed, rounds[:1], np.inf) == ""


@pytest.mark.parametrize(
    ("explains", "promised", "chance", "lags", "drifts"),
    [
        (0.3, 0.05, 1e-9, {}, True),
        (0.3, 0.05, 1e-9, {"impact_force": 1e-3}, False),  # what the records show is tried before
        (0.3, 0.1, 1e-9, {}, False),  # a candidate promises a third of that, which is worth its refit
        (0.05, 0.0, 1e-9, {}, False),  # not what the misfit is about
        (0.3, 0.05, 1e-3, {}, False),  # noise may do so
    ],
)
def test_where_a_drift_explains_far_more_than_any_candidate_none_is_fitted(
    motion, allowed, noise, monkeypatch, explains, promised, chance, lags, drifts
):
    misfit = 2.0 * float(noise.sum())
    weak = Drift(name="zeta", chance=1e-12, gain=1.0, change=0.1, halves={})
    f_n = Drift(name="f_n", chance=chance, gain=2.0 * explains * misfit, change=0.008, halves={})
    scored = round_of(motion, 3.0 * noise, {"coulomb_friction": 100.0}).scored
    scored = dataclasses.replace(scored, known=dataclasses.replace(scored.known, lags=lags))
    candidates = {name: dataclasses.replace(one, gain=2.0 * promised * misfit) for name, one in scored.significant.items()}
    monkeypatch.setattr(search, "drifts", lambda fitted, allowed: (weak, f_n))
    monkeypatch.setattr(search, "look", lambda fitted, allowed, *, without: dataclasses.replace(scored, significant=candidates))
    monkeypatch.setattr(search, "whole_cost", lambda fitted, allowed: allowed.noise + misfit)
    monkeypatch.setattr(search, "short_listed", lambda scored, allowed, progress, tried: [])
    found = search.search(scored.fitted, allowed, np.inf)
    assert (found.ended, found.mimics) == ((DRIFTING, f_n) if drifts else (HELPLESS, None))
    assert not found.explained


@pytest.mark.parametrize(
    ("promised", "plain", "explains", "loose", "left", "named"),
    [
        (0.005, False, True, (), False, ("coulomb_friction", "quadratic_drag")),
        (0.0004, True, True, (), False, ("coulomb_friction",)),  # the equation of the first may be off by as much
        (0.0006, False, True, (), False, ("coulomb_friction",)),
        (0.0006, True, True, (), False, ("coulomb_friction", "quadratic_drag")),  # most of what is left, as much again as noise
        (0.0006, True, True, (), True, ("coulomb_friction", "quadratic_drag")),
        (0.0006, True, True, ("quadratic_drag",), False, ("coulomb_friction",)),
        (0.0006, True, False, (), False, ("coulomb_friction",)),
        (0.005, False, False, (), False, ("coulomb_friction",)),
        (0.005, False, True, ("quadratic_drag",), False, ("coulomb_friction",)),
        (0.005, False, True, (), True, ("coulomb_friction",)),  # a part of a trifle may be what the first one lacks
    ],
)
def test_a_second_effect_may_be_there_for_a_trifle_if_it_explains_all_of_that(
    motion, allowed, noise, monkeypatch, promised, plain, explains, loose, left, named
):
    first = 2.0 if plain else 1.4
    begun = stage(motion, allowed, 1000.0, first, CoulombFriction(friction_force=0.1))
    second = stage(
        motion, allowed, first, 0.9 if explains else 1.3, *begun.rivals[0].fitted.model.effects, QuadraticDrag(drag_coefficient=0.01)
    )
    second = dataclasses.replace(second.rivals[0], cost=whole_cost(second.rivals[0].fitted, allowed))
    gain = promised * 2.0 * (begun.cost - allowed.noise)

    def seen(fitted, allowed, *, without):
        beside_both = len(fitted.names) == 2
        candidates = {
            name: dataclasses.replace(one, gain=gain) for name, one in begun.scored.significant.items() if left or not beside_both
        }
        return dataclasses.replace(begun.scored, fitted=fitted, significant=candidates, found=list(candidates.values()))

    monkeypatch.setattr(search, "look", seen)
    monkeypatch.setattr(search, "unsteady", lambda fitted, allowed: loose)
    monkeypatch.setattr(search, "short_listed", lambda scored, allowed, progress, tried: [second])
    monkeypatch.setattr(search, "_overstated", lambda fitted, scored, allowed: 1.0)
    for start_again in ("fitted_from", "settled_like"):
        monkeypatch.setattr(search, start_again, lambda fitted, fuller, allowed=None: fitted)
    found = search.search(begun.scored.fitted, allowed, np.inf, begun=(begun,))
    assert (found.ended, found.fitted.names) == (EXPLAINED, named)
    assert found.explained


@pytest.mark.parametrize(("options", "tries"), [({"deadline": -np.inf}, 0), ({"most_effects": 1}, 0), ({}, 1)])
def test_nothing_is_tried_for_a_trifle_past_budget_or_most_effects_nor_found_where_nothing_helps(
    motion, allowed, monkeypatch, options, tries
):
    begun = stage(motion, allowed, 1000.0, 2.0, CoulombFriction(friction_force=0.1))
    useless = dataclasses.replace(begun.rivals[0], cost=whole_cost(begun.rivals[0].fitted, allowed))
    candidates = {name: dataclasses.replace(one, gain=0.01 * begun.cost) for name, one in begun.scored.significant.items()}
    asked = []

    def seen(fitted, allowed, *, without):
        return dataclasses.replace(begun.scored, fitted=fitted, significant=candidates, found=list(candidates.values()))

    def short_listed(scored, allowed, progress, tried):
        asked.append(scored.fitted.names)
        return [useless] if len(asked) == 1 else []

    for name, replacement in {"look": seen, "short_listed": short_listed, "_completes": lambda *given: True}.items():
        monkeypatch.setattr(search, name, replacement)
    for start_again in ("fitted_from", "settled_like"):
        monkeypatch.setattr(search, start_again, lambda fitted, fuller, allowed=None: fitted)
    found = search.search(begun.scored.fitted, allowed, **({"deadline": np.inf} | options), begun=(begun,))
    assert (found.ended, found.fitted.names) == (EXPLAINED, ("coulomb_friction",))
    assert asked == tries * [("coulomb_friction",)]


def test_a_round_without_its_best_ends_with_the_next_that_helps_fitted_in_full(motion, allowed, noise, monkeypatch):
    one = round_of(motion, 3.0 * noise, {"hysteresis": 100.0, "coulomb_friction": 200.0, "quadratic_drag": 9999.9})
    in_full, placed = fitted(motion, noise), fitted(motion, noise)
    monkeypatch.setattr(search, "fit_tolerantly", lambda prepared, allowed: in_full)
    monkeypatch.setattr(search, "better_placed", lambda fitted, known, allowed: placed if fitted is in_full else fitted)
    monkeypatch.setattr(search, "rings_by_itself", lambda fitted, courses: False)
    (again,) = reopened(one, allowed, without=("hysteresis",))
    assert [rival.name for rival in again.rivals] == ["coulomb_friction", "quadratic_drag"]
    assert again.rivals[0].fitted is placed
    assert reopened(one, allowed, without=("hysteresis", "coulomb_friction")) == ()  # drag does not help
    assert reopened(one, allowed, without=tuple(rival.name for rival in one.rivals)) == ()
    monkeypatch.setattr(search, "rings_by_itself", lambda fitted, courses: True)
    assert reopened(one, allowed, without=("hysteresis",)) == ()
    monkeypatch.setattr(search, "fit_tolerantly", lambda prepared, allowed: None)
    assert reopened(one, allowed, without=("hysteresis",))[0].rivals[0] is one.rivals[1]
