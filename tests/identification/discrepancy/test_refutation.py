"""An explanation stands or falls with what it predicts."""

import dataclasses

import pytest

from identification.discrepancy.diagnosis import MISSING, UNLISTED
from identification.discrepancy.explanation import Explanation
from identification.discrepancy.refutation import refutation
from tests.identification.discrepancy.made_diagnosis import made_diagnosis
from tests.identification.discrepancy.made_search import model
from tests.identification.made_result import made_result
from vibrojax.effects import CoulombFriction


@pytest.fixture(scope="module")
def sides():
    made = made_diagnosis(made_result(), MISSING)
    return made.nominal, made.augmented


def test_what_predicts_better_stands(sides, named):
    assert refutation(named, *sides) == ""


def test_effects_that_predict_worse_are_dropped_with_both_errors(sides, named):
    before, after = sides
    said = refutation(named, before, dataclasses.replace(after, held_out_nrmse=2.0 * before.held_out_nrmse))
    assert said.startswith("coulomb_friction would lower")
    assert "from 0.19 to 0.37" in said


def test_a_learned_term_that_predicts_worse_is_dropped_with_its_formula(sides, named):
    before, after = sides
    learned = dataclasses.replace(named, verdict=UNLISTED, formula="force = c1 u")
    assert "force = c1 u" in refutation(learned, before, dataclasses.replace(after, held_out_nrmse=1.0))
    assert refutation(learned, before, dataclasses.replace(after, held_out_nrmse=before.held_out_nrmse)) == ""
    assert refutation(learned, before, dataclasses.replace(after, held_out_nrmse=float("nan"))) != ""
    assert refutation(learned, dataclasses.replace(before, held_out_nrmse=float("nan")), after) == ""


@pytest.fixture(scope="module")
def named(motion, allowed) -> Explanation:
    return Explanation(verdict=MISSING, fitted=model(motion, allowed, 2.0, CoulombFriction(friction_force=0.1)), share=0.9)
