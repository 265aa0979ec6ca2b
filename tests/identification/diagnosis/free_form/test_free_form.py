"""A free-form term learned from residuals that were made to order."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.free_form.formula import bracketed, common_phase, formula
from identification.diagnosis.free_form.free_form import learn, strongest_line
from identification.diagnosis.free_form.terms import columns_of, force_groups, reading_groups, select
from identification.diagnosis.score.score import information, projector
from identification.diagnosis.score.scored import score_all
from vibrojax.effects.free_form import FreeForm


def chosen(motion, at, channel="", most=3):
    by = projector(motion.fitted(at))
    if channel:
        groups = reading_groups(by, motion.courses, motion.mass, channel)
    else:
        groups = force_groups(motion.prepared, by, motion.courses, motion.mass)
    return select(by, groups, int((at.weight > 0).sum()), most)


def terms(choice):
    return [group.members[0].terms[0] for group in choice.groups]


def test_finds_the_term_that_acts(motion):
    at = motion.shown(force=-20.0 * np.abs(motion.at.u) * motion.at.v)
    choice = chosen(motion, at)
    assert terms(choice) == ["|u| u'"]
    assert choice.factors[0][0] == pytest.approx(-20.0, rel=0.1)


def test_finds_a_line_of_which_every_record_has_its_phase(motion):
    phase = np.array([0.3, 2.0, -1.5, 1.0])[motion.at.record, None]
    at = motion.shown(force=0.15 * np.sin(2 * np.pi * 11.3 * motion.at.ts + phase))
    choice = chosen(motion, at)
    assert terms(choice) == ["sine_1"]
    (line,) = choice.groups
    assert line.members[0].f1_hz == pytest.approx(11.3, abs=0.5)
    sine, cosine = choice.factors[0].reshape(2, -1)
    assert np.hypot(sine, cosine) == pytest.approx(0.15, rel=0.25)


def test_finds_what_a_sensor_adds(motion):
    at = motion.shown(readings={"hammer_displacement": 1e-3 * motion.at.ts})
    choice = chosen(motion, at, "hammer_displacement")
    assert terms(choice)[0] == "t" and choice.worth > chosen(motion, at).worth


def test_no_line_where_no_force_is_identifiable(motion, monkeypatch):
    """As where none of the channels that determine it was recorded."""
    monkeypatch.setattr("identification.diagnosis.free_form.free_form.lines", lambda *given: [])
    assert strongest_line(score_all(motion.fitted(motion.shown()))) == 0.0


def test_noise_teaches_nothing(motion):
    assert chosen(motion, motion.shown()).groups == ()
    assert chosen(motion, motion.shown(), "hammer_displacement").groups == ()


@pytest.mark.thorough
def test_learns_a_damping_and_its_error(motion):
    nominal = motion.recorded(FreeForm(terms=("|u| u'",), c1=-60.0))
    learned = learn(score_all(nominal))
    assert learned is not None and learned.effect.terms == ("|u| u'",)
    assert learned.effect.c1 == pytest.approx(-60.0, rel=0.05)
    assert learned.formula.startswith("force = -") and learned.formula.endswith(" N s/m^2 |u| u'")
    assert learned.fitted.model.effects == (learned.effect,)
    assert learned.gain > 100.0
    assert learned.fitted.chi2_reduced < 1.05 < nominal.chi2_reduced


def test_learns_nothing_from_noise(recovered):
    assert learn(score_all(recovered)) is None


def test_columns_are_linear(motion):
    by = projector(motion.fitted(motion.shown()))
    two = tuple(FreeForm(terms=("u^3",), c1=value) for value in (1.0, 2.0))
    _, matrix = information(by, columns_of(by, motion.courses, motion.mass, two))
    assert matrix[1, 1] == pytest.approx(4.0 * matrix[0, 0], rel=1e-6)


@pytest.mark.parametrize(
    ("value", "stderr", "text"),
    [
        (0.14062, 0.00123, "0.1406(12)"),
        (-31234.0, 210.0, "-3.123(21)e+04"),
        (12.0, 30.0, "12(30)"),
        (0.5, None, "0.5"),
        (0.5, np.inf, "0.5"),
        (6.2656, 0.00096, "6.26560(96)"),
    ],
)
def test_errors_in_brackets(value, stderr, text):
    assert bracketed(value, stderr) == text


def test_formula_says_everything():
    effect = FreeForm(terms=("sine_1", "u^3", "near"), c1=-0.141, c2=-3.1e5, c3=0.2, f1_hz=6.27, d=1e-3)
    errors = {"c1": 0.002, "c2": 2e4, "c3": 0.01, "f1_hz": 0.01, "d": 1e-4}
    own = formula(effect, errors, {})
    assert own == (
        "force = 0.1410(20) N sin(2 pi 6.270(10) Hz t + p1) - 3.10(20)e+05 N/m^3 u^3"
        " + 0.200(10) N 1/(1 + (gap - u)/(0.00100(10) m))^2, p1 another in each record"
    )
    shared = formula(dataclasses.replace(effect, c1=0.141), errors, {"p1": (4.12, 0.02)})
    assert "t + 4.120(20))" in shared and "another" not in shared


def test_a_phase_is_shared_where_all_records_agree():
    errors = np.full(4, 0.02)
    common = common_phase(np.array([4.12, 4.13 - 2 * np.pi, 4.1, 4.14]), errors)
    assert common is not None and common == (pytest.approx(4.1225, abs=1e-3), pytest.approx(0.01))
    assert common_phase(np.array([4.12, 1.0, 4.1, 4.14]), errors) is None
    assert common_phase(np.zeros(4), np.full(4, np.inf)) is None
