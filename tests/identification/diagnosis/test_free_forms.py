"""A force at a frequency of its own, which is neither the drive's nor the rig's."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.augment import at_first_order, continued, learned
from identification.diagnosis.evidence import Judge
from identification.diagnosis.free_forms import free_forms
from identification.diagnosis.location import locate
from identification.diagnosis.scores import Scores, score_all, weighed_anew
from identification.diagnosis.search import search
from identification.diagnosis.signals import on_segments
from identification.estimation.prediction import record_fits
from identification.experiment import Experiment
from identification.trajectory.fit import fit
from identification.trajectory.start import problem_of
from tests.identification.trajectory.conftest import NOISE, RATE, Linear, shaken

HZ, SIZE, SAMPLES = 9.3, 0.05, 1200
"""Hz, N"""


def vibrated() -> Experiment:
    """Free decays of a rig under a sine force, with another phase in each record."""
    rng, experiment, found = np.random.default_rng(2), shaken(2), []
    phi, by_first, by_last = Linear().passed(1.0 / RATE, 1.0 / RATE)
    for phase, record in zip((0.4, 2.0), experiment.records, strict=True):
        time = np.arange(SAMPLES) / RATE
        force = SIZE * np.sin(2.0 * np.pi * HZ * time + phase)
        states = [np.array([4e-3, 0.0])]
        for here, there in zip(force[:-1], force[1:], strict=True):
            states.append(phi @ states[-1] + by_first * here + by_last * there)
        read = np.array(states)[:, 0] + NOISE * rng.standard_normal(SAMPLES)
        found.append(dataclasses.replace(record, time=time, channels={"hammer_displacement": read}))
    return dataclasses.replace(experiment, records=tuple(found))


@pytest.fixture(scope="module")
def beside() -> Scores:
    """Scores beside the nominal model, whose random force has taken up the sine."""
    return score_all(fit(problem_of(vibrated()), both=False), ["quadratic_drag"])


def test_it_is_the_best_free_form(beside):
    best = beside.free[0].candidate
    assert best.form.coordinate == "frequency"
    assert best.form.knots == pytest.approx(HZ, abs=0.25 / (SAMPLES / RATE))
    assert best.tried > 100


def test_it_is_fitted_with_a_size_and_phase_of_its_own_in_each_record(beside):
    weighed = weighed_anew(beside, beside.free[0])
    begun = at_first_order(beside, weighed)
    found = continued(*learned(begun, beside.free[0].candidate, weighed.strengths), begun.fitted, lambda line: None)
    places, phases = [found.problem.unknowns.own.index(f"tonal_force.{name}") for name in ("sine", "cosine")], np.array([0.4, 2.0])
    errors = found.solution.own_error[:, places] * found.problem.border.own_scale[places]
    assert errors.max() < 0.05 * SIZE
    off = found.at.own[:, places] - SIZE * np.stack([np.cos(phases), np.sin(phases)], axis=1)
    assert np.abs(off / errors).max() < 4.0
    assert found.converged and found.problem.values(found.at)["tonal_force.frequency_hz"] == pytest.approx(HZ, rel=1e-3)
    assert found.deviance < weighed.deviance + 1.0


def test_no_effect_is_taken_in_where_it_says_more(beside):
    found = search(beside.fitted, ["second_mode", "coulomb_friction"], judge=Judge(beside.fitted.problem.experiment))
    assert found.steps == () and found.last.alternatives[0].name == "tonal_force"


def test_the_location_tells_its_frequency_and_size(beside):
    weighed = weighed_anew(beside, beside.free[0])
    gain = beside.deviance - weighed.deviance
    found = locate(beside, record_fits(beside.fitted), ((beside.free[0], weighed, gain),), None)
    (profile,) = found.profiles
    assert profile.mean.max() == pytest.approx(SIZE / np.sqrt(2.0), rel=0.05)
    assert profile.center[np.argmax(profile.mean)] == pytest.approx(HZ, abs=0.2)
    assert found.coordinate == "frequency"
    assert found.interval[0] < HZ < found.interval[1]
    assert "vibrates at 9." in found.sentence
    assert "0.035 N rms" in found.sentence


@pytest.mark.parametrize("tied", [True, False])
def test_a_gain_over_time_is_a_form_where_something_else_sets_the_size_of_the_motion(scores, tied):
    """Its columns are the channel's deviation from its mean, each about its own knot from the first sample to the last."""
    forms = free_forms(scores.fitted, scores.courses, dataclasses.replace(scores.scales, tied=tied))
    found = [one for one in forms if (one.coordinate, one.quantity) == ("time", "impact_force")]
    assert len(found) == tied
    for form in found:
        chains, records = scores.fitted.problem.chains, scores.fitted.problem.experiment.records
        readings = [np.asarray(course.readings["impact_force"]) for course in scores.courses]
        whole = np.concatenate([one[: len(record.time)] for one, record in zip(readings, records, strict=True)])
        assert form.size == pytest.approx(scores.scales.noise["impact_force"] / np.std(whole))
        time = np.asarray(scores.courses[1].motion.t)
        share = np.clip(1.0 - np.abs(time - form.knots[2]) / (form.knots[1] - form.knots[0]), 0.0, 1.0)
        expected = on_segments(chains, 1, form.size * share * (readings[1] - np.mean(whole)))
        np.testing.assert_allclose(form.signals[2].readings["impact_force"][chains.of_record(1)], expected, atol=1e-9)
        assert form.knots[[0, -1]] == pytest.approx([0.0, max(record.time[-1] for record in records)])
        assert form.name == "any gain of impact force over time"
