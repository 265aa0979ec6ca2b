"""The record that would part what the present ones cannot tell."""

import dataclasses
import re

import numpy as np
import pytest

from identification.discrepancy.next_experiment import next_experiment
from identification.discrepancy.refit import Fitted, extended
from identification.discrepancy.score import Candidate
from identification.discrepancy.search import EXPLAINED, Search
from identification.discrepancy.short_list import Rival
from identification.fit import evaluator, integrator_for
from identification.levenberg_marquardt import Outcome
from tests.identification.discrepancy.made_search import fitted, round_of
from vibrojax.effects import AbstractEffect, CoulombFriction, QuadraticDrag

FRICTION, DRAG = CoulombFriction(friction_force=0.05), QuadraticDrag(drag_coefficient=0.5)


@pytest.fixture(scope="module")
def rival(motion, allowed):
    """The example with an effect more, where the fit has left it."""
    before = fitted(motion, 0.5 * allowed.samples.astype(float))

    def of(effect: AbstractEffect) -> Rival:
        candidate = Candidate(members=(effect,), factors=np.ones(1), gain=100.0, degrees=1)
        prepared = extended(before, candidate, motion.courses)
        equations = evaluator(prepared, integrator_for(prepared))(prepared.start)
        outcome = Outcome(estimate=prepared.start, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
        return Rival(candidate=candidate, fitted=Fitted(prepared=prepared, outcome=outcome), cost=100.0)

    return of


@pytest.fixture(scope="module")
def asked(motion, allowed):
    """The sentence where one of two rivals was chosen."""

    def of(first: Rival, second: Rival, ambiguous: tuple[str, ...]) -> str:
        one = dataclasses.replace(round_of(motion, 0.5 * allowed.samples.astype(float), {}), rivals=(first, second))
        return next_experiment(Search(rounds=(one,), fitted=first.fitted, last=one.scored, ended=EXPLAINED), ambiguous, allowed)

    return of


def test_nothing_is_asked_for_where_nothing_is_in_doubt(rival, asked):
    assert asked(rival(FRICTION), rival(DRAG), ()) == ""


def test_what_parts_friction_from_drag_is_told_with_its_sigma(rival, asked):
    said = asked(rival(FRICTION), rival(DRAG), ("quadratic_drag",))
    assert re.search(r"(drop|free decay|drive) (from|of) [\d.]+ mm", said), said
    assert "sigma" in said
    assert FRICTION.summary in said.lower() and DRAG.summary in said.lower()


def test_no_record_parts_a_model_from_itself(rival, asked):
    first, second = rival(FRICTION), rival(FRICTION)
    said = asked(first, dataclasses.replace(second, candidate=rival(DRAG).candidate), ("quadratic_drag",))
    assert said.startswith("No simple further record would part"), said
