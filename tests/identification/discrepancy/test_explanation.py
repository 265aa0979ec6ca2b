"""Which verdict follows from what a search found and what a learned term explains."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy import explanation as module
from identification.discrepancy.diagnosis import ADEQUATE, MISSING, UNLISTED
from identification.discrepancy.explanation import explanation
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.search import BUDGET, EXPLAINED, HELPLESS, Search
from tests.identification.discrepancy.test_search import fitted, round_of
from vibrojax.effects import CoulombFriction


@dataclasses.dataclass(frozen=True)
class Learned:
    fitted: object
    formula: str
    explained: float


@pytest.fixture(scope="module")
def allowed(motion) -> Tolerance:
    return Tolerance(samples=(motion.at.weight > 0).sum(axis=(1, 2)), cut=25.0)


@pytest.fixture(scope="module")
def found(motion, allowed) -> Search:
    """Friction has been found; a tenth of the misfit is left."""
    noise = 0.5 * allowed.samples.astype(float)
    first = dataclasses.replace(round_of(motion, allowed, noise, {"coulomb_friction": 1.0}), cost=11.0 * noise.sum())
    after = fitted(motion, 2.0 * noise)
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=0.1),))
    after = dataclasses.replace(after, prepared=dataclasses.replace(after.prepared, model=model))
    return Search(rounds=(first,), fitted=after, last=first.scored, ended=HELPLESS)


@pytest.fixture
def told(monkeypatch, found, allowed):
    """The explanation where a term explains so much; nothing is fitted again."""
    monkeypatch.setattr(module, "pruned", lambda fitted, allowed: fitted)

    def of(search: Search, by_term: float | None):
        learned = None if by_term is None else Learned(fitted=found.first.fitted, formula="c1 u", explained=by_term)
        monkeypatch.setattr(module, "learn", lambda *args, **options: learned)
        return explanation(found.first.fitted, search, allowed, deadline=np.inf)

    return of


def test_the_share_is_that_of_the_misfit_beyond_noise(found, allowed):
    assert found.share(allowed) == pytest.approx(0.9)
    assert found.dispersion(allowed) == pytest.approx(2.0)
    assert dataclasses.replace(found, ended=EXPLAINED).dispersion(allowed) == 1.0


@pytest.mark.parametrize("by_term", [None, 0.3, 0.89])
def test_effects_that_leave_little_are_asserted_where_no_term_leaves_less(told, found, by_term):
    result = told(found, by_term)
    assert (result.verdict, result.formula) == (MISSING, "")
    assert result.share == pytest.approx(0.9)
    assert result.fitted.names == ("coulomb_friction",)


def test_a_term_that_leaves_less_than_the_effects_is_what_is_shown(told, found):
    result = told(found, 0.95)
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
