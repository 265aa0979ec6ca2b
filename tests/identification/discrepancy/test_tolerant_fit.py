"""What a fit holds while all else gives way to a new effect, and how windows astray find back."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.refit import Fitted, with_model
from identification.discrepancy.tolerant_fit import fit_tolerantly, fitted_from, resettled, settled_like
from identification.fit import evaluator, integrator_for
from identification.levenberg_marquardt import LevenbergMarquardt, Outcome, settle
from tests.identification.conftest import TRUTH
from vibrojax.effects import CoulombFriction


@pytest.mark.parametrize(("newest", "first_holds"), [("coulomb_friction", True), ("", False)])
def test_all_else_gives_way_to_the_newest_effect_before_it_moves(motion, allowed, monkeypatch, newest, first_holds):
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=0.01),))
    prepared = with_model(motion.prepared, model, motion.estimate.nuisances, motion.estimate.states)
    index, free = prepared.layout.index("coulomb_friction.friction_force"), []
    minimise = LevenbergMarquardt.__call__

    def watched(self, evaluate, start, active, limits):
        free.append(bool(active.shared[index]))
        return minimise(self, evaluate, start, active, limits)

    monkeypatch.setattr(LevenbergMarquardt, "__call__", watched)
    fitted = fit_tolerantly(prepared, allowed, newest=newest, in_short=True)
    assert free[0] is not first_holds
    assert all(free[1:])
    assert fitted is not None
    assert np.isfinite(fitted.chi2)


@pytest.fixture(scope="module")
def settled(motion) -> Fitted:
    """Every window where it belongs."""
    estimate, _ = settle(evaluator(motion.prepared, integrator_for(motion.prepared)), motion.estimate, iterations=8)
    return evaluated(motion.prepared, estimate)


def evaluated(prepared, estimate) -> Fitted:
    equations = evaluator(prepared, integrator_for(prepared))(estimate)
    outcome = Outcome(estimate=estimate, equations=equations, cost=equations.total(estimate), converged=True, iterations=1, decrement=0.0)
    return Fitted(prepared=prepared, outcome=outcome)


def moved(fitted: Fitted, windows: np.ndarray) -> Fitted:
    """Some of the windows begin 0.3 mm and 20 mm/s beside where they should."""
    states = fitted.outcome.estimate.states.copy()
    states[windows] += [3e-4, 2e-2]
    return evaluated(fitted.prepared, dataclasses.replace(fitted.outcome.estimate, states=states))


def test_a_window_astray_finds_back_from_where_a_fuller_model_has_it(settled):
    windows = np.argsort(settled.outcome.equations.cost)[:2]
    cost = settled.outcome.equations.cost[windows]
    astray = moved(settled, windows)
    assert np.all(astray.outcome.equations.cost[windows] > 10.0 * cost)
    back = settled_like(astray, settled)
    assert np.all(back.outcome.equations.cost[windows] <= 1.01 * cost)
    np.testing.assert_array_equal(back.outcome.estimate.shared, astray.outcome.estimate.shared)


def test_only_windows_that_resist_settle_anew_each_from_its_best_start(settled, allowed):
    windows = np.argsort(settled.outcome.equations.cost)[:2]
    cost = settled.outcome.equations.cost[windows]
    astray = moved(settled, windows)
    evaluate = evaluator(settled.prepared, integrator_for(settled.prepared))
    estimate, equations = resettled(astray.prepared, evaluate, astray.outcome.estimate, allowed)
    assert np.all(equations.cost[windows] <= 1.01 * cost)
    changed = np.flatnonzero(np.any(estimate.states != astray.outcome.estimate.states, axis=1))
    assert set(windows) <= set(changed)
    assert len(changed) < 0.1 * len(settled.prepared.record)
    np.testing.assert_array_equal(equations.cost, evaluate(estimate).cost)


def test_a_fit_in_a_wrong_place_is_led_out_of_it_by_a_fuller_one_and_needs_no_effect(motion, settled, allowed):
    values = settled.prepared.layout.physical(settled.outcome.estimate.shared) | {"k_i": 2e6, "f_n": 5.0}
    wrong = dataclasses.replace(settled.outcome.estimate, shared=settled.prepared.layout.internal(values))
    stuck = evaluated(settled.prepared, wrong)
    model = dataclasses.replace(motion.prepared.model, effects=(CoulombFriction(friction_force=1e-9),))
    estimate = settled.outcome.estimate
    prepared = with_model(settled.prepared, model.replace(TRUTH), estimate.nuisances, estimate.states)
    fuller = evaluated(prepared, prepared.start)
    anew = fitted_from(stuck, fuller, allowed)
    assert anew.names == ()
    assert allowed.total(anew.outcome.equations.cost) < 1.01 * allowed.total(fuller.outcome.equations.cost)
    assert allowed.total(stuck.outcome.equations.cost) > 2.0 * allowed.total(fuller.outcome.equations.cost)
    assert fitted_from(settled, evaluated(prepared, dataclasses.replace(prepared.start, states=wrong.states + 1e-3)), allowed) is settled


def test_windows_that_a_new_effect_sets_astray_settle_before_anything_else_moves(settled, allowed, monkeypatch):
    astray, first = moved(settled, np.arange(0, len(settled.prepared.record), 3)), []
    minimise = LevenbergMarquardt.__call__

    def watched(self, evaluate, start, active, limits):
        first.append(start)
        return minimise(self, evaluate, start, active, limits)

    monkeypatch.setattr(LevenbergMarquardt, "__call__", watched)
    fit_tolerantly(dataclasses.replace(astray.prepared, start=astray.outcome.estimate), allowed, in_short=True)
    begun = evaluated(settled.prepared, first[0]).outcome.equations.cost
    assert astray.outcome.equations.cost.sum() > 10.0 * settled.outcome.equations.cost.sum()
    assert begun.sum() < 1.1 * settled.outcome.equations.cost.sum()


def test_windows_are_left_alone_where_nothing_or_nearly_everything_improves(settled):
    assert settled_like(settled, settled) is settled
    whole = moved(settled, np.arange(len(settled.prepared.record)))
    assert settled_like(whole, settled) is whole
