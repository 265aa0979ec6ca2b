"""Scores of several candidates at once."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis import scores as module
from identification.diagnosis.scores import Scored, Scores, _packed, _scored, _variances
from identification.trajectory.random_force import RandomForce
from identification.trajectory.variances import SMALLEST_FORCE, is_largest, vanishes
from tests.identification.diagnosis.candidates import probed

NAMES = ("reading_tone", "gap_step", "quadratic_drag")
"""With numbers of its own in each record, in one record alone, and in all."""


@pytest.fixture(scope="module")
def candidates(scores):
    return [probed(scores, name) for name in NAMES]


def test_signals_of_different_records_share_a_column(candidates):
    columns, places = _packed(candidates)
    assert all(len({signal.record for signal in each}) == len(each) for each in columns)
    for one, each in zip(candidates, places, strict=True):
        assert all(any(other is signal for other in columns[place]) for signal, place in zip(one.signals, each, strict=True))
    assert len(columns) < sum(len(one.signals) for one in candidates)


def test_scores_do_not_depend_on_what_else_is_scored_nor_on_shared_columns(scores: Scores, candidates):
    together = {one.candidate.name: one for one in _scored(scores.fitted, scores.by, candidates)}
    for candidate in candidates:
        apart = tuple(dataclasses.replace(signal, record=None) for signal in candidate.signals)
        (alone,) = _scored(scores.fitted, scores.by, [dataclasses.replace(candidate, signals=apart)])
        found = together[candidate.name]
        assert found.gain == pytest.approx(alone.gain, rel=1e-6)
        assert np.allclose(found.strengths, alone.strengths, rtol=1e-6, atol=1e-9)
        assert np.array_equal(found.known, alone.known)


def test_a_column_that_is_nowhere_has_neither_strength_nor_direction(scores: Scores, candidates):
    drag = candidates[2]
    nowhere = dataclasses.replace(drag.signals[0], force=0.0 * drag.signals[0].force)
    (found,) = _scored(scores.fitted, scores.by, [dataclasses.replace(drag, signals=(*drag.signals, nowhere))])
    (alone,) = _scored(scores.fitted, scores.by, [drag])
    assert found.gain == pytest.approx(alone.gain, rel=1e-9)
    assert found.strengths[1] == 0.0 and not found.directions[1].any() and not found.known[1]


def test_a_force_is_scored_where_the_fit_has_no_random_force(scores: Scores, candidates):
    """Under the variances of such a fit alone, rounding leaves nothing of it."""
    none = RandomForce(std=SMALLEST_FORCE * scores.fitted.problem.scales.force, memory=scores.fitted.variances.force.memory)
    without = dataclasses.replace(scores.fitted, variances=dataclasses.replace(scores.fitted.variances, force=none))
    own, some, first = _variances(without)
    assert own.force is none and not vanishes(without.problem, some.force) and is_largest(without.problem, first.force)
    (found,) = _scored(without, scores.by, [candidates[2]])
    assert found.known.all() and found.strengths[0] != 0.0


def test_where_equations_under_other_variances_cannot_be_solved_the_other_scores_count(scores: Scores, candidates, monkeypatch):
    own, *others = _variances(scores.fitted)
    original, unsolved = module.scorer, []

    def scorer(problem, at, linear, variances):
        if any(variances is one for one in unsolved):
            raise np.linalg.LinAlgError
        return original(problem, at, linear, variances)

    def gains(variances) -> dict[str, float]:
        monkeypatch.setattr(module, "_variances", lambda fitted: variances)
        return {one.candidate.name: one.gain for one in _scored(scores.fitted, scores.by, candidates)}

    monkeypatch.setattr(module, "scorer", scorer)
    for refused in ([others[0]], others):
        solvable = gains([one for one in (own, *others) if all(one is not each for each in refused)])
        unsolved[:] = refused
        assert gains([own, *others]) == solvable
        unsolved.clear()
    unsolved[:] = [own]
    with pytest.raises(np.linalg.LinAlgError):
        gains([own, *others])


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_a_candidate_that_takes_the_motion_too_far_takes_no_other_along(scores: Scores, candidates):
    """Though they share a column."""
    _, step, _ = candidates
    (signal,) = step.signals
    other = 1 - signal.record
    there = np.where(scores.fitted.problem.chains.record == other, np.inf, 0.0)[:, None]
    wild = dataclasses.replace(step, signals=(dataclasses.replace(signal, stop=np.where(there, there, 0.0 * signal.stop), record=other),))
    (alone,) = _scored(scores.fitted, scores.by, [step])
    (found,) = _scored(scores.fitted, scores.by, [step, wild])
    assert found.candidate is step
    assert found.gain == alone.gain


def test_only_a_stop_that_is_harder_in_depth_is_shown_by_the_loops_of_force_over_indentation(scores: Scores):
    """Whatever the fitted model: no motion is integrated."""
    one = Scored(candidate=probed(scores, "deep_stop"), gain=0.0, strengths=np.zeros(1), known=np.ones(1, bool))
    with_it, problem = dataclasses.replace(scores, listed=(one,)), scores.fitted.problem
    assert with_it.in_loops == frozenset()
    depths = [motion.u - record.gap for motion, record in zip(problem.motions, problem.experiment.records, strict=True)]
    first, most = 0.6 * max(depth.max() for depth in depths), max(motion.force.max() for motion in problem.motions)
    further = [2.0 * most * np.maximum(depth / first - 1.0, 0.0) ** 1.5 for depth in depths]
    harder = tuple(
        dataclasses.replace(motion, force=motion.force + more, inertia=motion.inertia + more)
        for motion, more in zip(problem.motions, further, strict=True)
    )
    fitted = dataclasses.replace(scores.fitted, problem=dataclasses.replace(problem, motions=harder))
    assert dataclasses.replace(with_it, fitted=fitted).in_loops == {"deep_stop"}
