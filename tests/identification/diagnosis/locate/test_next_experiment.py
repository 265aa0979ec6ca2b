"""The further record that separates two models which the present records do not."""

import dataclasses
import re

import pytest

from identification.diagnosis.locate.next_experiment import next_experiment
from identification.diagnosis.refit import extended
from identification.diagnosis.search.alternatives import Alternative
from identification.diagnosis.search.forward import COMPLETE, Search, Step
from tests.identification.diagnosis import made_fit
from vibrojax.effects import AbstractEffect, CoulombFriction, QuadraticDrag

FRICTION, DRAG = CoulombFriction(friction_force=0.05), QuadraticDrag(drag_coefficient=0.5)


@pytest.fixture(scope="module")
def beside(motion):
    """The model without either of them."""
    return motion.fitted(motion.shown(noise=False))


@pytest.fixture(scope="module")
def alternative(motion, beside):
    """The example with an effect more, where the fit has left it."""

    def of(effect: AbstractEffect) -> Alternative:
        one = made_fit.candidate(effect)
        fitted = made_fit.fitted_to_nothing(motion.point, extended(beside, one, motion.courses))
        return made_fit.alternative(fitted, one, 100.0)

    return of


@pytest.fixture(scope="module")
def asked(motion, beside):
    """The sentence where one of two alternatives was chosen."""

    def of(first: Alternative, second: Alternative, ambiguous: tuple[str, ...]) -> str:
        scored = made_fit.scored(beside, motion.courses)
        step = Step(scored=scored, alternatives=(first, second))
        return next_experiment(Search(steps=(step,), last=scored, refused=(), ended=COMPLETE), ambiguous)

    return of


def test_nothing_is_asked_for_where_nothing_is_in_doubt(alternative, asked):
    assert asked(alternative(FRICTION), alternative(DRAG), ()) == ""


def test_what_separates_friction_from_drag_is_stated_with_its_sigma(alternative, asked):
    said = asked(alternative(FRICTION), alternative(DRAG), ("quadratic_drag",))
    assert re.search(r"(drop|free decay|drive) (from|of) [\d.]+ mm", said), said
    assert "sigma" in said
    assert FRICTION.summary in said.lower() and DRAG.summary in said.lower()


def test_no_record_parts_a_model_from_itself(alternative, asked):
    first, second = alternative(FRICTION), alternative(FRICTION)
    said = asked(first, dataclasses.replace(second, candidate=alternative(DRAG).candidate), ("quadratic_drag",))
    assert said.startswith("No simple further record would separate"), said
