"""From fits to what is asserted: probabilities, twins, and the list of candidates."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.assertion import asserted, considered, detail, probability, twins
from identification.diagnosis.calibration import ALPHA
from identification.diagnosis.diagnosis import Number
from identification.diagnosis.refit import with_model
from identification.diagnosis.search.forward import COMPLETE, Search, Step
from tests.identification.diagnosis import made_fit
from vibrojax.effects import CoulombFriction, GainError, GapStep


@pytest.fixture(scope="module")
def beside(motion):
    """The nominal model, and candidates beside it."""
    candidates = [made_fit.candidate(name, gain) for name, gain in (("coulomb_friction", 90.0), ("hysteresis", 80.0), ("gap_drift", 3.0))]
    return made_fit.scored(motion.fitted(motion.shown()), motion.courses, *candidates)


@pytest.fixture
def step(motion, beside):
    """One step, in which effects were fitted whose information criteria are so much above that of the first."""

    def of(**above: float) -> Step:
        worth = [
            made_fit.alternative(_worse(beside.fitted, criterion), made_fit.candidate(name), 100.0) for name, criterion in above.items()
        ]
        return Step(scored=beside, alternatives=tuple(worth))

    return of


def _worse(fitted, criterion: float):
    """The same fit, with an information criterion higher by so much: the number of the best one's residuals is raised."""
    inner = fitted.point.inner
    scales = inner.log_scale.copy()
    scales[0] += 0.5 * criterion
    return dataclasses.replace(fitted, point=dataclasses.replace(fitted.point, inner=dataclasses.replace(inner, log_scale=scales)))


def test_probability_is_that_of_the_information_criterion(step):
    one = step(coulomb_friction=0.0, hysteresis=2.0)
    assert probability((one,), "coulomb_friction") == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))
    with pytest.raises(KeyError):
        probability((one,), "hysteresis")


def test_what_chance_might_give_is_less_probable(step):
    one = step(coulomb_friction=0.0)
    weak = dataclasses.replace(one, alternatives=(dataclasses.replace(one.alternatives[0], gain=4.0),))
    assert probability((one,), "coulomb_friction") == pytest.approx(1.0)
    assert probability((weak,), "coulomb_friction") == pytest.approx(0.9545, abs=1e-3)


def test_what_fits_about_as_well_is_a_twin(step):
    limit = -2.0 * np.log(ALPHA)
    one = step(coulomb_friction=0.0, hysteresis=0.5 * limit, quadratic_drag=2.0 * limit)
    assert twins((one,), ("coulomb_friction",)) == ("hysteresis",)
    assert twins((one,), ("coulomb_friction", "hysteresis")) == ()
    assert twins((dataclasses.replace(one, alternatives=one.alternatives[:1]),), ("coulomb_friction",)) == ()


def test_every_candidate_is_listed_with_what_became_of_it(step, beside):
    one = step(coulomb_friction=0.0, hysteresis=30.0)
    rows = considered(Search(steps=(one,), last=beside, refused=one.alternatives[1:], ended=COMPLETE), lambda fitted: 0.1)
    assert [(row.name, row.drop) for row in rows] == [
        ("coulomb_friction", 100.0),
        ("hysteresis", 100.0),
        ("gap_drift", None),
        ("coulomb_friction", None),
        ("hysteresis", 100.0),
        ("gap_drift", None),
    ]
    assert [row.bic for row in rows[:3]] == [0.0, pytest.approx(30.0), None]
    assert rows[0].chance < ALPHA < rows[2].chance
    assert {row.held_out for row in rows} == {0.0, None}


def test_a_candidate_is_distinguished_from_others_of_its_kind():
    assert detail(made_fit.candidate(GainError(factor=1.1, of_channel="impact_force"))) == "impact_force"
    found = detail(made_fit.candidate(GapStep(gap_jump=1e-4, instant=0.3, in_file="cart1.csv")))
    assert found.startswith("cart1.csv, ") and "0.3 s" in found


def test_the_gap_is_that_of_all_records_if_they_have_one(motion, beside):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=0.1),))
    shared = (Number(name="coulomb_friction.friction_force", symbol="F_c", unit="N", value=0.1, stderr=0.01),)
    one = Step(scored=beside, alternatives=(made_fit.alternative(beside.fitted, made_fit.candidate("coulomb_friction"), 100.0),))
    ended = Search(steps=(one,), last=beside, refused=(), ended=COMPLETE)
    for gaps, expected in (((0.0, 1e-3), None), ((1.0, 1.0), 1.0)):
        records = tuple(dataclasses.replace(record, gap=gaps[k % 2]) for k, record in enumerate(motion.prepared.experiment.records))
        prepared = dataclasses.replace(motion.prepared, experiment=dataclasses.replace(motion.prepared.experiment, records=records))
        prepared = with_model(prepared, model, motion.estimate.nuisances, motion.estimate.states)
        with_effect = dataclasses.replace(
            beside.fitted, point=dataclasses.replace(beside.fitted.point, prepared=prepared, estimate=prepared.start)
        )
        (found,) = asserted(ended, with_effect, shared)
        assert (found.gap, [p.name for p in found.parameters]) == (expected, ["friction_force"])
