"""An effect taken into a model: its numbers survive, and are in proportion for the steps of a fit."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.errors import numbers
from identification.diagnosis.refit import extended, lengthened, strengthened, with_model, without
from identification.diagnosis.score.score import Candidate
from identification.likelihood.random_effects import Variation, with_variation
from identification.windows.prepare import windows_of
from tests.identification.diagnosis import made_fit
from vibrojax.effects import CoulombFriction, GapStep, MainsHum, QuadraticDrag, SecondMode


@pytest.mark.parametrize("force", [0.03, 9.4e3])
def test_a_parameter_is_in_proportion_whatever_the_size_of_the_rig(motion, force):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=force),))
    taken = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index = taken.layout.index("coulomb_friction.friction_force")
    assert abs(taken.start.shared[index]) <= 1.0
    assert taken.layout.physical(taken.start.shared)["coulomb_friction.friction_force"] == pytest.approx(force)


@pytest.mark.parametrize(("velocity", "scale"), [(0.001, 0.05), (0.9, 10.0)])
def test_an_own_state_has_room_for_its_motion_whatever_the_size_of_the_rig(motion, velocity, scale):
    mode = SecondMode(mode_mass=0.02, mode_frequency_hz=21.0, mode_damping_ratio=0.03)
    model = dataclasses.replace(motion.prepared.model, effects=(mode,))
    signs = np.where(np.arange(len(motion.estimate.states)) % 2, 1.0, -1.0)[:, None]
    states = np.concatenate([motion.estimate.states, 1e-5 * signs, velocity * signs], axis=1)
    taken = with_model(motion.prepared, model, motion.estimate.nuisances, states)
    assert [state.scale for state in taken.layout.own_states] == pytest.approx([1e-3, scale])


def drag(strength: float) -> Candidate:
    return dataclasses.replace(made_fit.candidate(QuadraticDrag(drag_coefficient=1e-3)), factors=np.array([1e3 * strength]))


@pytest.fixture(scope="module")
def rubbing(motion):
    """The example with dry friction of 0.2 N, which is what its windows show; set up with 0.01 N."""
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=0.01),))
    prepared = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    shared = prepared.start.shared.copy()
    shared[prepared.layout.index("coulomb_friction.friction_force")] *= 20.0
    prepared = dataclasses.replace(prepared, start=dataclasses.replace(prepared.start, shared=shared))
    return made_fit.fitted_to_nothing(motion.point, prepared)


def test_an_effect_found_earlier_keeps_its_fitted_strength_when_another_one_is_added(motion, rubbing):
    taken = extended(rubbing, drag(3e-9), motion.courses)
    start = taken.layout.physical(taken.start.shared)
    assert start["coulomb_friction.friction_force"] == pytest.approx(0.2, rel=1e-3)
    assert start["quadratic_drag.drag_coefficient"] == pytest.approx(3e-9)
    assert taken.model.values()["coulomb_friction.friction_force"] == pytest.approx(0.2, rel=1e-3)


def test_an_effect_is_removed_with_the_variations_of_its_parameters(motion, rubbing):
    varied = [
        Variation(name=name, std=std, chi2=1.0, chance=0.0) for name, std in (("coulomb_friction.friction_force", 0.1), ("k_i", 0.02))
    ]
    fit = rubbing
    for one in varied:
        prepared = with_variation(fit, one)
        fit = made_fit.with_prepared(fit, prepared)
        fit = dataclasses.replace(fit, point=dataclasses.replace(fit.point, estimate=prepared.start))
    nuisances = fit.estimate.nuisances.copy()
    nuisances[:, fit.prepared.layout.nuisances.index("variation.k_i")] = 0.5
    fit = dataclasses.replace(fit, point=dataclasses.replace(fit.point, estimate=dataclasses.replace(fit.estimate, nuisances=nuisances)))
    less = without(fit, "coulomb_friction")
    assert less.layout.variations == (("k_i", 0.02),)
    assert less.start.nuisances.shape == (len(motion.courses), less.layout.nuisance_count)
    np.testing.assert_array_equal(less.start.nuisances[:, less.layout.nuisances.index("variation.k_i")], 0.5)


def test_all_else_moves_to_where_it_is_best_beside_the_new_effect(motion):
    """Where a force of that kind acts, and the suspension and a random force have stood for a part of it."""
    put_in = motion.shown(force=-0.3 * motion.at.v * np.abs(motion.at.v), noise=False)
    fitted = motion.fitted(put_in)
    away = fitted.posterior.step[0, : motion.prepared.layout.shared]
    taken = extended(fitted, drag(0.3), motion.courses)
    there = taken.start.shared[: motion.prepared.layout.shared] - motion.estimate.shared
    assert np.abs(there).max() < 0.2 * np.abs(away).max()


def test_an_instant_stays_as_it_was_proposed_and_one_that_was_set_free_stays_free(motion):
    jump = made_fit.candidate(GapStep(gap_jump=1e-4, instant=0.3))
    taken = extended(motion.fitted(motion.shown(noise=False)), jump, motion.courses)
    assert taken.fixed["gap_step.instant"] == 0.3
    for free in (False, True):
        before = made_fit.fitted_to_nothing(motion.point, dataclasses.replace(taken, fixed={} if free else taken.fixed))
        both = extended(before, drag(1e-3), motion.courses)
        assert ("gap_step.instant" in both.fixed) is not free


def test_an_instant_is_known_no_better_than_its_equation_says_when(motion):
    taken = extended(motion.fitted(motion.shown(noise=False)), made_fit.candidate(GapStep(gap_jump=1e-4, instant=0.3)), motion.courses)
    found = made_fit.fitted_to_nothing(motion.point, dataclasses.replace(taken, fixed={}))
    sure = np.tile(1e8 * np.eye(taken.layout.size), (len(taken.record), 1, 1))
    posterior = dataclasses.replace(found.posterior, equations=dataclasses.replace(found.posterior.equations, hessian=sure))
    by_name = {one.name: one.stderr for one in numbers(dataclasses.replace(found, posterior=posterior))}
    assert by_name["gap_step.gap_jump"] < 1e-8
    assert by_name["gap_step.instant"] == pytest.approx(1e-3 / 12**0.5, rel=0.01)


def test_members_that_are_estimated_together_make_one_effect_or_one_number_of_each_record():
    hum = [MainsHum(frequency_hz=50.0, sine=s, cosine=c, of_channel="impact_force") for s, c in ((1.0, 0.0), (0.0, 1.0))]
    own = [p for p in hum[0].parameters if p.per_record]
    factors = np.arange(6.0) if own else np.array([2.0, 3.0])
    effect, of_records = strengthened(Candidate(members=tuple(hum), factors=factors, gain=1.0, degrees=2), records=3)
    assert own and of_records.shape == (3, len(own))
    np.testing.assert_allclose(of_records * [p.scale for p in own], np.stack([factors[:3], factors[3:]], axis=1))
    assert (effect.sine, effect.cosine) == (0.0, 0.0)


def test_windows_may_be_taken_more_than_once(motion):
    """As many as there are, but not the same."""
    prepared = motion.prepared
    count = len(prepared.record)
    repeated = windows_of(prepared, np.repeat([1], count))
    assert np.array_equal(repeated.start.states, np.tile(prepared.start.states[1], (count, 1)))
    assert windows_of(prepared, np.arange(count)) is prepared


@pytest.mark.thorough
def test_short_windows_are_replaced_by_ordinary_ones_that_the_model_nearly_fits(recovered):
    found = lengthened(recovered)
    assert found is not None
    assert len(found.prepared.record) < len(recovered.prepared.record)
    assert lengthened(found) is None
