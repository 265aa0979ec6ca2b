"""Which verdict follows from what a search found and what a learned term explains."""

import dataclasses

import pytest

from identification.discrepancy import explanation as module
from identification.discrepancy import steadiness
from identification.discrepancy.diagnosis import ADEQUATE, MISSING, UNLISTED
from identification.discrepancy.explanation import explanation
from identification.discrepancy.free_form import Learned
from identification.discrepancy.search import BUDGET, EXPLAINED, HELPLESS, Search
from tests.identification.discrepancy.made_search import model, round_of, stage
from vibrojax.effects import CoulombFriction, QuadraticDrag
from vibrojax.effects.free_form import FreeForm

TERM = FreeForm(terms=("u",), scales=(1.0,))


@pytest.fixture(scope="module")
def found(motion, allowed) -> Search:
    """Friction has been found; a tenth of the misfit is left."""
    return Search(
        rounds=(stage(motion, allowed, 11.0, 2.0),),
        fitted=model(motion, allowed, 2.0),
        last=round_of(motion, 0.5 * allowed.samples.astype(float), {}).scored,
        ended=HELPLESS,
    )


@pytest.fixture
def told(monkeypatch, found, allowed):
    """The explanation where a term explains so much; nothing is fitted again."""
    monkeypatch.setattr(module, "pruned", lambda fitted, allowed: fitted)

    def of(search: Search, by_term: float | None):
        learned = None if by_term is None else Learned(fitted=found.first.fitted, effect=TERM, formula="c1 u", explained=by_term)
        return explanation(found.first.fitted, dataclasses.replace(search, learned=learned), allowed)

    return of


def test_effects_that_will_not_hold_still_are_not_asserted_where_more_than_noise_is_left(told, found, monkeypatch):
    monkeypatch.setattr(steadiness, "unsteady", lambda fitted, allowed: fitted.names)
    assert told(found, None).verdict == UNLISTED
    assert told(dataclasses.replace(found, ended=EXPLAINED), None).verdict == MISSING


def test_a_part_of_the_cause_that_holds_still_only_beside_the_other_part_is_asserted_with_it(told, found, motion, allowed, monkeypatch):
    both = (CoulombFriction(friction_force=0.1), QuadraticDrag(drag_coefficient=1e-3))
    more = dataclasses.replace(
        found, rounds=(*found.rounds, stage(motion, allowed, 2.0, 1.9, *both)), fitted=model(motion, allowed, 1.9, *both)
    )
    monkeypatch.setattr(steadiness, "unsteady", lambda fitted, allowed: fitted.names if len(fitted.names) == 1 else ())
    assert told(more, None).fitted.names == ("coulomb_friction", "quadratic_drag")


def test_the_share_is_that_of_the_misfit_beyond_noise(found, allowed):
    assert found.share(found.fitted, allowed) == pytest.approx(0.9)
    assert found.dispersion(allowed) == pytest.approx(2.0)
    assert dataclasses.replace(found, ended=EXPLAINED).dispersion(allowed) == 1.0


@pytest.mark.parametrize("by_term", [None, 0.3, 0.94])
def test_effects_that_leave_little_are_asserted_where_no_term_leaves_much_less(told, found, by_term):
    result = told(found, by_term)
    assert (result.verdict, result.formula) == (MISSING, "")
    assert result.share == pytest.approx(0.9)
    assert result.fitted.names == ("coulomb_friction",)


@pytest.mark.parametrize(("left", "names"), [(1.4, ("coulomb_friction", "quadratic_drag")), (1.6, ("coulomb_friction",))])
def test_an_effect_that_adds_a_trifle_is_not_asserted_where_more_than_noise_is_left(told, found, motion, allowed, left, names):
    both = (CoulombFriction(friction_force=0.1), QuadraticDrag(drag_coefficient=1e-3))
    more = dataclasses.replace(
        found, rounds=(*found.rounds, stage(motion, allowed, 2.0, left, *both)), fitted=model(motion, allowed, left, *both)
    )
    result = told(more, 0.3)
    assert (result.verdict, result.fitted.names) == (MISSING, names)
    assert result.share == pytest.approx(0.9 if len(names) == 1 else 0.96)
    assert told(dataclasses.replace(more, ended=EXPLAINED), 0.3).fitted.names == ("coulomb_friction", "quadratic_drag")


def test_an_effect_that_explains_less_than_the_one_before_it_is_not_asserted(told, found, motion, allowed):
    """Stages are chosen by another measure than that of the share."""
    both = (CoulombFriction(friction_force=0.1), QuadraticDrag(drag_coefficient=1e-3))
    worse = stage(motion, allowed, 2.0, 2.9, *both)
    again = stage(motion, allowed, 2.9, 2.2, *both)
    more = dataclasses.replace(found, rounds=(*found.rounds, worse, again), fitted=model(motion, allowed, 2.2, *both))
    assert told(more, 0.3).fitted.names == ("coulomb_friction",)


def test_a_term_that_leaves_much_less_than_the_effects_is_what_is_shown(told, found):
    result = told(found, 0.96)
    assert (result.verdict, result.formula) == (UNLISTED, "c1 u")


def test_a_search_that_was_cut_short_asserts_nothing_in_part(told, found):
    assert told(dataclasses.replace(found, ended=BUDGET), None).verdict == UNLISTED


def test_a_term_that_explains_less_than_half_is_not_shown(told, found):
    nothing = dataclasses.replace(found, rounds=(), fitted=found.first.fitted)
    assert told(nothing, 0.4) == module.Explanation(verdict=UNLISTED, fitted=found.first.fitted)
    assert told(nothing, 0.6).formula == "c1 u"


def test_what_leaves_nothing_is_all(told, found):
    result = told(dataclasses.replace(found, ended=EXPLAINED), 0.99)
    assert (result.verdict, result.share) == (MISSING, 1.0)
    nothing = dataclasses.replace(found, rounds=(), fitted=found.first.fitted, ended=EXPLAINED)
    assert told(nothing, 0.99).verdict == ADEQUATE
