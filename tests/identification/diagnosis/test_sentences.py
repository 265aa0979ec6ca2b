"""What is said with each verdict."""

import dataclasses
from types import MappingProxyType

import pytest

from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNDECIDED, UNLISTED
from identification.diagnosis.sentences import sentences
from identification.report.diagnosis_tables import headline
from identification.result.evidence import Disagreement
from tests.identification.diagnosis.made_diagnosis import UNREST, made_diagnosis
from tests.identification.made_result import made_result


@pytest.fixture(scope="module")
def made():
    result = made_result(samples=300)
    return {verdict: made_diagnosis(result, verdict) for verdict in (ADEQUATE, RESTLESS, MISSING, UNLISTED, UNDECIDED)}


def said(diagnosis, *, ambiguous=MappingProxyType({}), unrest=None, after=None) -> str:
    of = (diagnosis.verdict, diagnosis.effects, ambiguous, diagnosis.location, diagnosis.nominal, after or diagnosis.augmented)
    return " ".join(sentences(*of, diagnosis.free_form, unrest))


def test_nothing_missing_is_said_with_the_error_of_prediction(made):
    text = said(made[ADEQUATE])
    assert text.startswith("Nothing beyond the noise: the nominal model explains the records (reduced chi-square")
    assert "on records left out in turn is 1.2 %." in text
    assert "random force" not in text


def test_an_error_over_a_part_of_a_period_is_said_to_be_one(made):
    one = made[MISSING]
    text = said(one, after=dataclasses.replace(one.augmented, brief=True))
    assert "left out in turn (with impacts: over a quarter of a period, from the state estimated there) falls from" in text


def test_an_error_that_lasts_longer_than_the_noise_that_was_seen_is_not_called_noise(made):
    one = made[ADEQUATE]
    of = (ADEQUATE, (), {}, one.location, one.nominal, one.augmented, "")
    text = sentences(*of, longer={"hammer_displacement": 16.2})[0]
    assert "the error of hammer displacement is 16 times its noise from sample to sample" in text and "declare" in text


def test_the_random_force_of_a_restless_rig_is_stated(made):
    text = said(made[RESTLESS], unrest=UNREST)
    assert text.startswith(
        "The misfit exceeds the sensors' noise, and no function of motion, drive, time or record explains it: a random force acts"
    )
    assert "random force on the hammer is 0.021 N rms (1.2 % of the spring's force) with a correlation time of 8.2 ms." in text


def test_readings_that_are_off_by_more_than_their_noise_are_stated_where_no_force_acts(made):
    of = (RESTLESS, (), {}, None, made[RESTLESS].nominal, made[RESTLESS].augmented, "", None, {"impact_force": 162.0})
    text = " ".join(sentences(*of))
    assert "drive, time or record explains it: the error of impact force is 160 times its noise (reduced chi-square" in text
    found = headline(dataclasses.replace(made[RESTLESS], unrest=None))
    assert found == "No listed effect is missing, but readings are off by more than their noise"


@pytest.mark.parametrize("verdict", [MISSING, UNLISTED])
def test_a_random_force_is_stated_beside_a_cause_as_well(made, verdict):
    assert "random force on the hammer is 0.021 N rms" in said(made[verdict], unrest=UNREST)
    assert "random force" not in said(made[verdict])


def test_what_is_missing_comes_first_then_where_then_what_it_does_to_the_error(made):
    text = said(made[MISSING], ambiguous={"coulomb_friction": ["quadratic_drag", "power_law_damping"]})
    in_order = [
        "Dry friction in the suspension (F_c = ",
        "free flight",
        "falls from 19 % to 1.2 %",
        "In place of dry friction in the suspension, these records allow drag that grows with the square of the velocity or ",
    ]
    places = [text.find(piece) for piece in in_order]
    assert -1 not in places and places == sorted(places)


def test_what_is_on_no_list_is_described_by_what_was_learned(made):
    text = said(made[UNLISTED])
    assert text.startswith("Something real is missing, and no listed effect explains it.")
    assert f"describes it: {made[UNLISTED].free_form}." in text


def test_what_is_not_asserted_is_named_with_the_reason(made):
    one = made[UNLISTED]
    of = (one.verdict, (), {}, one.location, one.nominal, one.augmented, one.free_form)
    text = " ".join(sentences(*of, reasons={"quadratic_drag": "a free form explains more than it does"}))
    assert "The best of them, quadratic drag, is not asserted: a free form explains more than it does." in text
    assert "no effect that was looked for explains it" in " ".join(sentences(*of, limited=True))


def test_without_a_decision_there_is_no_verdict(made):
    one = made[UNDECIDED]
    of = (one.verdict, (), {}, one.location, one.nominal, one.nominal, "")
    assert sentences(*of)[0] == "The model has not converged: there is no verdict."
    assert sentences(*of, finished=False)[0] == "The budget ended the search: there is no verdict."


@pytest.mark.parametrize(("by_chance", "stated"), [(1e-9, True), (1e-4, False)])
def test_a_parameter_that_varies_between_records_is_described_by_its_extremes(made, by_chance, stated):
    values = {"a.csv": (1.5e6, 1e4), "b.csv": (2.5e6, 2e4), "c.csv": (2e6, 1e4)}
    sure = Disagreement(name="k_i", chi2=60.0, degrees=2, chance=by_chance, records=values)
    vague = dataclasses.replace(sure, name="n", chance=0.3)
    text = said(made[ADEQUATE], after=dataclasses.replace(made[ADEQUATE].augmented, disagreements=(vague, sure)))
    assert ("varies between records" in text) is stated
    if stated:
        assert text.index("in a.csv") < text.index("in b.csv") and "c.csv" not in text


def test_a_value_for_each_record_is_no_nominal_model(made):
    """What is estimated anew in each record explains less than one value for all of them."""
    values = {"a.csv": (1.5e6, 3e5), "b.csv": (2.5e6, 3e5)}
    one = Disagreement(name="k_i", chi2=1.0, degrees=1, chance=0.3, records=values, modelled=True)
    diagnosis = dataclasses.replace(made[ADEQUATE], augmented=dataclasses.replace(made[ADEQUATE].augmented, disagreements=(one,)))
    text = said(diagnosis)
    assert text.startswith(
        "With a separate value of k_i in each record, the nominal model explains the records to the noise (reduced chi-square"
    )
    assert "k_i varies between records: (1.50 ± 0.30) × 10⁶ N/mⁿ in a.csv, (2.50 ± 0.30) × 10⁶ N/mⁿ in b.csv." in text
    assert headline(diagnosis) == "No listed effect is missing, but k_i varies between records"
    restless = dataclasses.replace(made[RESTLESS], augmented=dataclasses.replace(made[RESTLESS].augmented, disagreements=(one,)))
    assert "drive, time or record explains it beside a separate value of k_i in each record: a random force acts" in said(restless)
    assert headline(restless) == "No listed effect is missing, but a random force acts on the hammer, and k_i varies between records"


def test_an_unlisted_cause_without_a_term_states_the_error_of_the_nominal_model(made):
    one = made[UNLISTED]
    text = said(dataclasses.replace(one, augmented=one.nominal, free_form=""))
    assert "The error of the nominal model on records left out in turn is 19 %." in text and "describes it" not in text
