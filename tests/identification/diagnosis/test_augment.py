"""Where models with an effect begin."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.diagnosis import augment
from identification.diagnosis.augment import extended, strengthened, without
from identification.diagnosis.scores import LARGE_PART, Candidate, Scored, Scores
from identification.estimation import estimate
from identification.trajectory.start import begun_from, problem_of
from identification.trajectory.variances import LARGEST_FORCE
from tests.effects.start import at_start
from tests.identification.conftest import TRUTH
from tests.identification.diagnosis.candidates import probed
from vibrojax.contact import NoContact
from vibrojax.effects import EFFECTS, BackStop, ClockDrift, Motion, RecorderLowPass, TimeOffset
from vibrojax.errors import NoConvergenceError


def test_a_model_with_an_effect_begins_at_the_measured_trajectory_and_at_the_estimate_without_it(scores):
    moved = dataclasses.replace(scores.fitted.at, states=1.01 * scores.fitted.at.states)
    beside = dataclasses.replace(scores, fitted=dataclasses.replace(scores.fitted, at=moved))
    problem, near = extended(beside, probed(scores, "quadratic_drag"), np.ones(1))
    np.testing.assert_array_equal(problem.start.states, scores.fitted.problem.start.states)
    np.testing.assert_array_equal(near.states, moved.states)
    assert len(near.shared) == len(scores.fitted.at.shared) + 1


def test_an_effect_that_is_left_out_leaves_the_measured_trajectory_as_it_was(scores):
    problem, near = extended(scores, probed(scores, "quadratic_drag"), np.ones(1))
    with_it = dataclasses.replace(scores.fitted, problem=problem, at=near)
    again, estimate = without(with_it, "quadratic_drag")
    np.testing.assert_array_equal(again.start.states, scores.fitted.problem.start.states)
    np.testing.assert_allclose(estimate.shared, scores.fitted.at.shared, rtol=1e-12)


def test_a_stop_begins_at_its_place_whatever_its_first_order_says():
    stop = BackStop(0.007)
    assert strengthened((stop,), np.array([-0.3])) == (stop, {})


def made_late(scores: Scores, channel: str, lateness) -> Scores:
    """The scores beside records of which one channel is late by a function of the time."""
    problem, records = scores.fitted.problem, []
    for record in problem.experiment.records:
        late = np.interp(record.time - lateness(record.time), record.time, record.channels[channel])
        records.append(dataclasses.replace(record, channels=record.channels | {channel: late}))
    experiment = dataclasses.replace(problem.experiment, records=tuple(records))
    return dataclasses.replace(
        scores, fitted=dataclasses.replace(scores.fitted, problem=dataclasses.replace(problem, experiment=experiment))
    )


def scored(candidate: Candidate) -> Scored:
    return Scored(candidate=candidate, gain=1.0, strengths=np.ones(1), known=np.ones(1, bool))


@pytest.mark.parametrize("delay", [3e-3, -7e-3])
def test_a_late_channel_begins_where_it_follows_the_motion(scores, delay):
    """From any first strength: impacts that have been shifted by more than they last give no slope towards it."""
    candidate = probed(scores, "time_offset")
    beside = made_late(scores, candidate.channel, lambda t: delay)
    found = augment.aligned(beside, scored(candidate)).candidate
    _, near = extended(beside, found, np.array([0.3]))
    assert near.shared[-1] == pytest.approx(delay, abs=scores.scales.sampling)
    shift, course = found.signals[0].readings[candidate.channel], scores.courses[0]
    late = np.interp(course.motion.t - delay, course.motion.t, course.readings[candidate.channel]) - course.readings[candidate.channel]
    assert np.std(shift[scores.fitted.problem.chains.of_record(0)]) == pytest.approx(float(np.std(late)), rel=0.1)


def test_a_clock_that_drifts_begins_where_the_channels_agree_whatever_the_fitted_motion(scores):
    channel, ppm = "hammer_displacement", 5000.0
    late = made_late(scores, channel, lambda t: 1e-6 * ppm * t)
    courses = tuple(
        dataclasses.replace(one, readings={name: np.zeros_like(np.asarray(x)) for name, x in one.readings.items()})
        for one in scores.courses
    )
    shown = dataclasses.replace(late, courses=courses, scales=dataclasses.replace(scores.scales, lags={channel: 2e-3}))
    effect = ClockDrift(drift_ppm=10.0, of_channel=channel)
    found = augment.aligned(shown, scored(Candidate(name="clock_drift", members=(effect,), signals=()))).candidate
    step = 0.5e6 * scores.scales.sampling / scores.scales.latest  # ppm; half a sample at the end of the longest record
    assert found.members[0].drift_ppm == pytest.approx(ppm, abs=2.0 * step)
    begun, near = extended(shown, found, np.ones(1))
    assert near is None
    assert begun.values(begun.start)["k_i"] == pytest.approx(scores.fitted.problem.values(scores.fitted.problem.start)["k_i"], rel=0.1)


def test_other_candidates_stay_as_they_are(scores):
    one = scored(probed(scores, "quadratic_drag"))
    assert augment.aligned(scores, one) is one


@pytest.mark.parametrize("part", [0.2, -0.2])
def test_a_delay_by_a_part_of_a_sample_begins_at_its_first_order(scores, part):
    """Its derivative shows the way; the steps of the alignment are too coarse for it."""
    one = scored(probed(scores, "time_offset"))
    beside = made_late(scores, one.candidate.channel, lambda t: part * scores.scales.sampling)
    assert augment.aligned(beside, one) is one
    _, near = extended(beside, one.candidate, np.array([2.0 * part]))
    assert near.shared[-1] == pytest.approx(part * scores.scales.sampling)


def test_a_channel_that_is_shown_to_be_late_is_aligned_without_impacts_in_the_model(scores):
    delay, channel = 5e-3, "hammer_displacement"
    late = made_late(scores, channel, lambda t: delay)
    shown = dataclasses.replace(late, scales=dataclasses.replace(scores.scales, force=0.0, lags={channel: delay}))
    effect = TimeOffset(delay=0.5 * scores.scales.sampling, of_channel=channel)
    one = scored(Candidate(name="time_offset", members=(effect,), signals=()))
    assert augment.aligned(shown, one).candidate.members[0].delay == pytest.approx(delay, abs=scores.scales.sampling)
    assert augment.misalignment_of(shown, augment.aligned(shown, one).candidate) < 2.0 * augment.misalignment_of(shown, one.candidate) < 0.0


def test_a_delay_that_the_records_show_begins_at_the_channels_brought_together(scores):
    """Beside the motion that they show together, not beside that of a model which followed the late one."""
    problem, delay, channel = scores.fitted.problem, 5e-3, "hammer_displacement"
    late = tuple(
        dataclasses.replace(one, channels={**one.channels, channel: np.interp(one.time - delay, one.time, one.channels[channel])})
        for one in problem.experiment.records
    )
    beside = begun_from(dataclasses.replace(problem, experiment=dataclasses.replace(problem.experiment, records=late)), late)
    effect = TimeOffset(delay=delay, of_channel=channel)
    candidate = Candidate(name="time_offset", members=(effect,), signals=())
    shown = dataclasses.replace(
        scores,
        fitted=dataclasses.replace(scores.fitted, problem=beside, at=beside.start),
        scales=dataclasses.replace(scores.scales, lags={channel: delay}),
    )
    found, near = extended(shown, candidate, np.ones(1))
    assert near is None
    assert found.values(found.start)["time_offset.delay"] == pytest.approx(delay)
    off, before = (np.median(np.abs(one.start.states[:, 1] - problem.start.states[:, 1])) for one in (found, beside))
    assert off < 0.1 * before
    assert found.values(found.start)["k_i"] == pytest.approx(problem.values(problem.start)["k_i"], rel=0.05)


FILTER = RecorderLowPass(2e-3, channels=("hammer_displacement", "cart_displacement", "hammer_acceleration", "impact_force"))


@pytest.fixture
def smeared(scores) -> Scores:
    """The scores beside the records behind a recorder's low-pass, with a pause in one channel."""
    problem, records = scores.fitted.problem, []
    for record in problem.experiment.records:
        given, time = {name: jnp.asarray(values) for name, values in record.channels.items()}, jnp.asarray(record.time)
        motion = Motion(time, *[jnp.zeros(len(time))] * 4, jnp.zeros(len(time), bool))
        shown = FILTER.read(given, motion, jnp.zeros((len(time), len(FILTER.own_states))))
        records.append(dataclasses.replace(record, channels={name: np.array(values) for name, values in shown.items()}))
    records[0].channels["hammer_displacement"][200:230] = np.nan
    experiment = dataclasses.replace(problem.experiment, records=tuple(records))
    problem = begun_from(dataclasses.replace(problem, experiment=experiment), experiment.records)
    return dataclasses.replace(scores, fitted=dataclasses.replace(scores.fitted, problem=problem))


def test_a_recorder_low_pass_begins_at_the_records_with_the_filter_undone(scores, smeared):
    """At the motion of an ideal recorder, with the memory of every filter, from which that has its size."""
    candidate, ideal = Candidate(name=FILTER.name, members=(FILTER,), signals=()), scores.fitted.problem
    found, near = extended(smeared, candidate, np.ones(1))
    assert near is None
    off, before = (np.median(np.abs(one.start.states[:, 1] - ideal.start.states[:, 1])) for one in (found, smeared.fitted.problem))
    assert off < 0.1 * before
    for index, knots in enumerate(found.chains.knots):
        shown, without_it = (one.experiment.records[index].channels for one in (found, ideal))
        for name in FILTER.channels:
            place = found.unknowns.states.index(f"recorder_low_pass.{name}")
            rows = np.minimum(np.arange(knots.stop - knots.start) * found.chains.samples, len(without_it[name]) - 1)
            memory = np.nan_to_num(shown[name] - without_it[name])[rows]
            known = np.isfinite(shown[name][np.maximum(rows - 1, 0)])  # the first sample after a pause is not
            scale = np.abs(without_it[name]).max()
            np.testing.assert_allclose(found.start.states[knots, place][known], memory[known], atol=1e-9 * scale, err_msg=name)
    states = found.start.states[:, 2:]
    np.testing.assert_allclose(found.scales.own, np.sqrt(np.mean(states**2, axis=0)))


def test_a_low_pass_begins_at_the_time_constant_of_its_candidate_whatever_its_first_order_says(smeared):
    found, _ = extended(smeared, Candidate(name=FILTER.name, members=(FILTER,), signals=()), np.array([0.05]))
    assert found.values(found.start)["recorder_low_pass.time_constant"] == pytest.approx(float(FILTER.time_constant))


def test_beside_another_effect_or_without_impacts_a_low_pass_begins_at_the_estimate_without_it(scores, smeared):
    candidate = Candidate(name=FILTER.name, members=(FILTER,), signals=())
    other, at = extended(scores, probed(scores, "quadratic_drag"), np.ones(1))
    beside = dataclasses.replace(smeared, fitted=dataclasses.replace(scores.fitted, problem=other, at=at))
    free = dataclasses.replace(smeared, scales=dataclasses.replace(smeared.scales, force=0.0))
    assert all(extended(one, candidate, np.ones(1))[1] is not None for one in (beside, free))


def test_a_filter_is_undone_within_the_bounds_of_its_time_constant(smeared):
    """The grid of a slow rig goes beyond them."""
    slow = dataclasses.replace(FILTER, time_constant=2.0)
    found, _ = extended(smeared, Candidate(name=FILTER.name, members=(slow,), signals=()), np.ones(1))
    assert found.values(found.start)["recorder_low_pass.time_constant"] == pytest.approx(1.0)


def test_undoing_a_filter_makes_noise_louder_and_moving_a_channel_does_not(scores):
    record = scores.fitted.problem.experiment.records[0]
    a = np.exp(-np.diff(record.time)[0] / 2e-3)
    louder = augment._undone(record, FILTER).noise["hammer_displacement"] / record.noise["hammer_displacement"]
    assert louder == pytest.approx(np.sqrt(1 + a**2) / (1 - a), rel=1e-6)
    moved = augment._undone(record, TimeOffset(delay=5e-3, of_channel="hammer_displacement"))
    assert moved.noise == record.noise


def test_an_input_of_the_rig_stays_as_it_is(scores):
    record = dataclasses.replace(scores.fitted.problem.experiment.records[1], base="measured")
    moved = {name: augment._undone(record, TimeOffset(delay=5e-3, of_channel=name)) for name in record.channels}
    np.testing.assert_array_equal(moved["cart_displacement"].channels["cart_displacement"], record.channels["cart_displacement"])
    assert not np.array_equal(moved["hammer_displacement"].channels["hammer_displacement"], record.channels["hammer_displacement"])


@pytest.mark.parametrize("law", [None, "newton"])
def test_a_problem_begun_from_its_own_records_begins_where_it_did(small, law):
    felt = [{name: one.channels[name] for name in one.channels if law is None or name != "impact_force"} for one in small.records]
    records = tuple(dataclasses.replace(one, channels=channels) for one, channels in zip(small.records, felt, strict=True))
    problem = problem_of(dataclasses.replace(small, records=records), law=law)
    again = begun_from(problem, problem.experiment.records)
    for name in ("states", "shared", "own"):
        np.testing.assert_array_equal(getattr(again.start, name), getattr(problem.start, name))


def test_a_missing_stop_begins_where_the_loops_of_force_over_indentation_show_it(small, scores):
    off = 3e-4
    nearer = tuple(dataclasses.replace(record, gap=record.gap - off) for record in small.records)
    problem = problem_of(dataclasses.replace(small, records=nearer), law="none")
    scales = dataclasses.replace(scores.scales, law=NoContact())
    beside = dataclasses.replace(scores, fitted=dataclasses.replace(scores.fitted, problem=problem, at=problem.start), scales=scales)
    candidate = Candidate(name="missing_stop", members=(next(iter(EFFECTS["missing_stop"].probe.effects(scales))),), signals=())
    found, near = extended(beside, candidate, np.ones(1))
    begun, gap = found.values(found.start), found.unknowns.own.index("gap_error")
    assert near is None, "a motion that went through the stop says nothing"
    assert begun["missing_stop.k_i"] == pytest.approx(TRUTH["k_i"], rel=0.2)
    assert begun["missing_stop.n"] == pytest.approx(TRUTH["n"], rel=0.03)
    assert begun["missing_stop.gap_offset"] == pytest.approx(off, abs=5e-5)
    np.testing.assert_array_equal(found.start.own[~found.border.own[:, gap], gap], 0.0)


def test_the_strength_of_a_loss_goes_with_its_estimate():
    drag = at_start(EFFECTS["quadratic_drag"])
    (found, own) = strengthened((drag,), np.array([2.0]))
    assert found.drag_coefficient == 2.0 * drag.drag_coefficient
    assert not own


CASES = (
    ((True, 10.0), (False, -1e6), "near"),
    ((True, 10.0), (True, 5.0), "anew"),
    ((False, 1.0), (True, 5.0), "anew"),
    ((True, 10.0), None, "near"),
)
"""Whether each fit converges, and its deviance; None where the second one diverges."""


@pytest.mark.parametrize(("near", "anew", "taken"), CASES)
def test_the_likelier_of_the_fits_that_converged_is_taken(scores, monkeypatch, near, anew, taken):
    def fit(problem, *, at=None, **given):
        converged, deviance = near if at is not None else anew or (False, 0.0)
        if at is None and anew is None:
            raise NoConvergenceError("diverged")
        solution = dataclasses.replace(scores.fitted.solution, deviance=deviance)
        return dataclasses.replace(scores.fitted, solution=solution, converged=converged, rounds=1 if at is not None else 2)

    monkeypatch.setattr(augment, "fit", fit)
    found = augment.refitted(scores.fitted.problem, scores.fitted.at, scores.fitted, lambda line: None)
    assert found.rounds == {"near": 1, "anew": 2}[taken]


def test_a_fit_that_is_as_likely_as_expected_is_not_repeated(scores, monkeypatch):
    begun = []

    def fit(problem, *, at=None, **given):
        begun.append(at is not None)
        return dataclasses.replace(scores.fitted, solution=dataclasses.replace(scores.fitted.solution, deviance=10.0))

    monkeypatch.setattr(augment, "fit", fit)
    for deviance, expected in ((11.0, [True]), (9.0, [True, True, False])):
        simpler = dataclasses.replace(scores.fitted, solution=dataclasses.replace(scores.fitted.solution, deviance=deviance))
        augment.refitted(scores.fitted.problem, scores.fitted.at, scores.fitted, lambda line: None, simpler=simpler)
        assert begun == expected


@pytest.mark.parametrize(("part", "repeated"), [(0.5, False), (2.0, True)])
def test_a_fit_that_leaves_much_random_is_repeated_however_likely(scores, monkeypatch, part, repeated):
    force = dataclasses.replace(scores.fitted.variances.force, std=part * LARGE_PART * scores.fitted.problem.scales.force)
    variances = dataclasses.replace(scores.fitted.variances, force=force)
    begun = []

    def fit(problem, *, at=None, **given):
        begun.append(at is not None)
        return dataclasses.replace(scores.fitted, variances=variances, solution=dataclasses.replace(scores.fitted.solution, deviance=10.0))

    monkeypatch.setattr(augment, "fit", fit)
    simpler = dataclasses.replace(scores.fitted, solution=dataclasses.replace(scores.fitted.solution, deviance=1e6))
    augment.refitted(scores.fitted.problem, scores.fitted.at, scores.fitted, lambda line: None, simpler=simpler)
    assert begun == ([True, False] if repeated else [True])


def test_a_fit_with_the_force_at_its_limit_comes_second_where_the_simpler_model_has_less(scores, monkeypatch):
    size = LARGEST_FORCE * scores.fitted.problem.scales.force
    largest = dataclasses.replace(scores.fitted.variances, force=dataclasses.replace(scores.fitted.variances.force, std=size))
    likelier = dataclasses.replace(scores.fitted, variances=largest, solution=dataclasses.replace(scores.fitted.solution, deviance=-1e6))
    monkeypatch.setattr(augment, "fit", lambda problem, *, at=None, **given: likelier if at is not None else scores.fitted)
    for simpler, found in ((scores.fitted, scores.fitted), (likelier, likelier)):
        taken = augment.refitted(scores.fitted.problem, scores.fitted.at, scores.fitted, lambda line: None, simpler=simpler)
        assert taken.deviance == found.deviance


def test_a_continued_fit_begins_with_the_estimate_and_the_variances_of_the_model_beside(scores, monkeypatch):
    given = []

    def fit(problem, **options):
        given.append(options)
        return scores.fitted

    monkeypatch.setattr(augment, "fit", fit)
    beside = dataclasses.replace(scores.fitted, of_readings=True)
    found = augment.continued(scores.fitted.problem, scores.fitted.at, beside, lambda line: None)
    assert found.of_readings
    assert (given[0]["at"], given[0]["begin"], given[0]["both"]) == (scores.fitted.at, beside.variances, False)


def test_an_effect_that_is_asked_for_by_name_is_aligned_too(scores, monkeypatch):
    delay, channel = 5e-3, "hammer_displacement"
    late, asked = made_late(scores, channel, lambda t: delay), []

    def augmented(at, candidate, weighed, progress):
        asked.append(candidate.members[0])
        return at.fitted

    monkeypatch.setattr(estimate, "augmented", augmented)
    estimate.with_effects(late.fitted, ["time_offset"], progress=lambda line: None)
    (one,) = asked
    assert abs(one.delay) > scores.scales.sampling
