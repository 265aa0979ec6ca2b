"""Where a misfit acts, from free forms of known strength and from records whose misfit is made to order."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.free_forms import Form, free_forms
from identification.diagnosis.location import locate
from identification.diagnosis.scores import Candidate, Scored, Scores
from identification.estimation.prediction import record_fits
from identification.report.diagnosis_figures import _quantity
from identification.result.result import RecordFit
from identification.trajectory.additions import Reestimated
from vibrojax.effects import GainError, GapStep

SIZE = 0.2
"""Of the missing force over that of the suspension."""


@pytest.fixture(scope="module")
def forms(scores) -> dict[tuple[str, str], Form]:
    """By coordinate and quantity."""
    return {(one.coordinate, one.quantity): one for one in free_forms(scores.fitted, scores.courses, scores.scales)}


@pytest.fixture(scope="module")
def records(scores) -> tuple[RecordFit, ...]:
    """The load cell of the first record misses by three times its noise, everything else by one."""
    found = record_fits(scores.fitted)
    chi2 = [{name: 1.0 for name in one.chi2_reduced} for one in found]
    chi2[0]["impact_force"] = 9.0
    return tuple(dataclasses.replace(one, chi2_reduced=each) for one, each in zip(found, chi2, strict=True))


def weighed(scores: Scores, form: Form, strengths: np.ndarray, gain: float) -> tuple[Scored, Reestimated, float]:
    """A form with these strengths, known to a hundredth of one."""
    stderr = np.full(len(strengths), 0.01)
    known = np.ones(len(strengths), bool)
    candidate = Candidate(name=form.name, members=(), signals=form.signals, form=form)
    scored = Scored(candidate=candidate, gain=gain, strengths=strengths, known=known)
    fitted = scores.fitted
    return (
        scored,
        Reestimated(deviance=0.0, strengths=strengths, covariance=np.diag(stderr**2), variances=fitted.variances, at=fitted.at),
        gain,
    )


def braking(scores: Scores, form: Form) -> tuple[Scored, Reestimated, float]:
    """A force against fast motion towards the stop alone."""
    speed = form.knots[form.columns[:, 0]]
    return weighed(scores, form, np.where(speed > 0.5 * form.knots.max(), -SIZE, 0.0), 5000.0)


def test_forms_of_the_motion_hold_a_constant_force(scores, forms):
    for coordinate in ("displacement", "velocity"):
        total = sum(signal.force for signal in forms[coordinate, "force"].signals)
        np.testing.assert_allclose(total, scores.fitted.problem.scales.force)


def test_the_coordinate_is_that_of_the_best_free_form_with_its_range_and_size(scores, forms, records):
    other = weighed(scores, forms["displacement", "force"], np.full(len(forms["displacement", "force"].columns), 0.02), 900.0)
    found = locate(scores, records, [other, braking(scores, forms["velocity", "force"])], None)
    assert (found.coordinate, found.profiles[0].quantity) == ("velocity", "force")
    assert [profile.explained for profile in found.profiles] == pytest.approx([1.0, 0.18])
    fastest = forms["velocity", "force"].knots.max()
    assert found.interval is not None and 0.5 * fastest < found.interval[0] < found.interval[1] == pytest.approx(fastest)
    assert found.profiles[0].mean.min() == pytest.approx(-SIZE * scores.fitted.problem.scales.force)
    assert found.phase == "free flight"
    profile = found.profiles[0]
    acts = np.mean(profile.center > 0.5 * fastest)
    assert profile.rms == pytest.approx(np.sqrt(acts) * SIZE * scores.fitted.problem.scales.force, rel=0.01)
    hardly = dataclasses.replace(profile, mean=np.append(profile.mean, 1e3), stderr=np.append(profile.stderr, 1e3))
    assert hardly.rms == pytest.approx(profile.rms, rel=0.01), "where the motion hardly ever is, a large force says nothing"
    assert "sits in free flight" in found.sentence and "N rms" in found.sentence


def test_dry_friction_is_a_force_against_the_motion_everywhere(scores, forms, records):
    both = next(form for (_, quantity), form in forms.items() if quantity == "force" and (form.columns[:, 1] != 0).any())
    found = locate(scores, records, [weighed(scores, both, -SIZE * np.sign(both.columns[:, 1]), 5000.0)], None)
    assert found.profiles[0].turns and found.profiles[0].is_even
    assert found.interval is None
    np.testing.assert_allclose(found.profiles[0].mean, -SIZE * scores.fitted.problem.scales.force)
    assert "N against the motion" in found.sentence and "mostly" not in found.sentence


def test_channel_and_record_are_those_with_the_excess_misfit(scores, forms, records):
    found = locate(scores, records, [braking(scores, forms["velocity", "force"])], None)
    assert found.channel == "impact_force"
    assert found.records == {records[0].file: 1.0, records[1].file: 0.0}
    assert f"most of it in {records[0].file} (100 %)" in found.sentence


def test_what_acts_in_contact_is_said_to(scores, forms, records):
    deep = forms["indentation", "force"]
    strengths = np.where(deep.knots[deep.columns[:, 0]] > 0, 0.5, 0.0)
    assert locate(scores, records, [weighed(scores, deep, strengths, 5000.0)], None).phase == "contact"
    path = forms["time", "stop"]
    assert locate(scores, records, [weighed(scores, path, np.ones(len(path.columns)), 5000.0)], None).phase == "contact"


def test_a_named_effect_gives_its_channel_its_record_and_its_instant(scores, forms, records):
    form = [braking(scores, forms["velocity", "force"])]
    of_channel = locate(scores, records, form, GainError(factor=1.02, of_channel="hammer_displacement"))
    assert of_channel.channel == "hammer_displacement"
    file, last = records[1].file, float(records[1].time[-1])
    found = locate(scores, records, form, GapStep(gap_jump=1e-4, instant=0.3, in_file=file))
    assert (found.record, found.time, found.coordinate, found.interval) == (file, 0.3, "time", (0.3, last))
    assert found.sentence.startswith(f"The misfit starts at 0.30 s of {file}.")


def test_maps_show_when_and_at_which_phase(scores, forms, records):
    first = records[0]
    late = first.time > 0.5 * (first.time[0] + first.time[-1])
    wrong = {name: values + 5.0 * first.noise.get(name, 0.0) * late for name, values in first.measured.items()}
    shown = (dataclasses.replace(first, measured=wrong), records[1])
    found = locate(scores, shown, [braking(scores, forms["velocity", "force"])], None).maps[first.file]
    assert found.shape == (24, 24)
    assert np.nanmedian(found[13:]) > np.nanmedian(found[:11]) + 20.0


def test_an_error_common_to_both_directions_does_not_blur_a_force_that_turns(scores, forms, records):
    """As that of a stiffness, which adds to the force over the displacement in either direction."""
    both = next(form for (_, quantity), form in forms.items() if quantity == "force" and (form.columns[:, 1] != 0).any())
    scored, friction, gain = weighed(scores, both, -SIZE * np.sign(both.columns[:, 1]), 5000.0)
    common = (both.columns[:, :1] == both.columns[:, 0]).astype(float)
    blurred = dataclasses.replace(friction, covariance=friction.covariance + 25.0 * common)
    (profile,) = locate(scores, records, [(scored, blurred, gain)], None).profiles
    assert profile.turns
    np.testing.assert_allclose(profile.stderr, 0.01 / np.sqrt(2.0) * scores.fitted.problem.scales.force)


def test_a_gain_that_drifts_is_said_to_with_its_size(scores, forms, records):
    form = forms["time", "hammer_displacement"]
    drift = np.linspace(0.0, 0.03, len(form.columns))
    found = locate(scores, records, [weighed(scores, form, drift / form.size, 5000.0)], None)
    (profile,) = found.profiles
    np.testing.assert_allclose(profile.mean, drift, atol=1e-12)
    assert (found.coordinate, found.channel, profile.size_unit) == ("time", "hammer_displacement", "1")
    assert "with a gain that changes by 3.0 %" in found.sentence and "on the record's clock" in found.sentence
    assert _quantity(profile) == ("error of the gain of hammer displacement", 100.0, "%")
