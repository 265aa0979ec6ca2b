import dataclasses
import re

import numpy as np
import pytest

from identification.report.verdict import GOOD, PARTLY, POOR, judge
from identification.result.evidence import Disagreement, Unrest
from identification.result.result import Quantity
from identification.wording.numbers import percent
from tests.identification.diagnosis.made_diagnosis import UNREST
from tests.identification.made_result import made_result


def test_a_complete_model_explains_its_records(good):
    verdict = judge(good)
    assert (verdict.level, verdict.remarks) == (GOOD, ())
    assert verdict.sentence.startswith("The model explains the records to the noise (reduced chi-square ")


def test_a_wrong_model_is_reported_with_its_worst_record_and_channel(poor):
    verdict = judge(poor)
    assert verdict.level == POOR
    assert "does NOT explain the records: the misfit is" in verdict.sentence
    worst = re.search(r"worst is impact force in contact of cart1\.csv, ([\d.]+) times the noise", verdict.sentence)
    assert worst is not None and float(worst[1]) > 5


@pytest.mark.parametrize(("variance", "correlation"), [(1.4, 0.0), (0.8, 0.0), (1.0, -0.3)])
def test_one_step_errors_that_are_not_white_are_in_the_headline(good, variance, correlation):
    force = dataclasses.replace(good.reading_error["impact_force"], variance=variance, correlation=correlation)
    verdict = judge(dataclasses.replace(good, reading_error=good.reading_error | {"impact_force": force}))
    assert verdict.level == PARTLY
    assert f"one-step errors of impact force are not white (variance {variance:.2f}, correlation {correlation:.2f})" in verdict.sentence


def test_records_that_contradict_each_other_are_in_the_headline(good):
    apart = Disagreement(name="k_i", chi2=237.0, degrees=3, chance=4e-51, records={})
    verdict = judge(dataclasses.replace(good, between_records=(apart,)))
    assert verdict.level == PARTLY
    assert "the records contradict each other in kᵢ (chi-square 237 of 3, chance 4.0 × 10⁻⁵¹)" in verdict.sentence
    for agreed in (dataclasses.replace(apart, chance=0.01), dataclasses.replace(apart, modelled=True)):
        assert judge(dataclasses.replace(good, between_records=(agreed,))).level == GOOD


@pytest.mark.parametrize(("error", "level"), [(0.02, GOOD), (1.3, PARTLY)])
def test_the_error_on_records_held_back_is_in_the_headline(good, error, level):
    cart = good.records[1]
    held_back = dataclasses.replace(cart, file="unseen.csv", nrmse={"impact_force": error})
    verdict = judge(dataclasses.replace(good, held_back=(held_back,)))
    assert verdict.level == level
    assert f"the error on records held back is {percent(min(error, 1.0), 1.0)}" in verdict.sentence
    assert ("impact force of unseen.csv is predicted no better than by its mean" in verdict.sentence) == (error > 1.0)


def test_a_random_force_is_stated_with_the_misfit_that_it_takes_up(good):
    verdict = judge(dataclasses.replace(good, chi2_reduced=36.0, unrest=UNREST))
    assert verdict.level == PARTLY
    assert verdict.sentence == (
        "Beside the model a random force of 0.021 N rms (1.2 % of the spring's force) acts on the hammer; "
        "without it the misfit is 6.0 times the noise (reduced chi-square 36.0)."
    )


def test_a_random_force_at_its_limit_is_no_fit(good):
    force = Unrest(force_rms=(0.5, 0.1), memory=(8e-3, 1e-3), share=0.3, reference="the spring's force", gain=40.0, at_limit=True)
    found = judge(dataclasses.replace(good, unrest=force))
    assert found.level == POOR
    assert "does NOT explain" in found.sentence
    assert "do not trust the parameters" in found.sentence


def test_a_record_that_alone_misfits_is_named_with_what_it_alone_has(poor, good):
    assert not any("Only" in remark for remark in judge(good).remarks)
    assert judge(poor).remarks[0].startswith("Only cart1.csv misfits; the model explains the other 1 to the noise. Look for what differs")
    drop, cart = poor.records
    seen = {name: values for name, values in cart.measured.items() if name != "cart_displacement"}
    sine = Quantity(name="base_amplitude", unit="m", value=1.25e-3, stderr=1e-6)
    cart = dataclasses.replace(cart, measured=seen, nuisances=(sine,), chi2_reduced={"impact_force": cart.chi2_reduced["impact_force"]})
    remark = judge(dataclasses.replace(poor, records=(drop, cart))).remarks[0]
    assert remark.endswith("Its cart was not recorded: the amplitude found, 1.25 mm, may be wrong, or its motion no sine.")
    both = dataclasses.replace(poor, records=(dataclasses.replace(poor.records[1], file="a.csv"), poor.records[1]))
    assert not any("Only" in remark for remark in judge(both).remarks)


def test_a_misfit_that_the_mean_hides_is_reported():
    result = made_result(misfit=0.01)
    assert result.chi2_reduced < 1.1
    verdict = judge(result)
    assert verdict.level == PARTLY
    assert "on the whole" in verdict.sentence
    assert "worst is impact force in contact of cart1.csv" in verdict.sentence


def test_no_convergence_is_never_good(good):
    verdict = judge(dataclasses.replace(good, converged=False))
    assert verdict.level == POOR
    assert "did NOT converge" in verdict.sentence


@pytest.mark.parametrize("chi2", [np.nan, np.inf])
def test_a_number_that_is_none_is_poor(good, chi2):
    assert judge(dataclasses.replace(good, chi2_reduced=chi2)).level == POOR


def test_noise_stated_too_large_and_noise_estimated_are_reported(good):
    records = tuple(dataclasses.replace(r, noise_estimated=frozenset({"impact_force"})) for r in good.experiment.records)
    experiment = dataclasses.replace(good.experiment, records=records)
    remarks = judge(dataclasses.replace(good, chi2_reduced=0.2, experiment=experiment)).remarks
    assert any("noise is stated too large" in remark for remark in remarks)
    assert any("estimated from the records themselves, is the noise of impact force" in remark for remark in remarks)
