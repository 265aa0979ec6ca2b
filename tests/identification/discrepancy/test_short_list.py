"""Which candidates are fitted, how far, and in what order; with fits whose costs are made to order."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy import short_list
from identification.discrepancy.refit import extended, windows_of
from identification.discrepancy.score import Candidate
from identification.discrepancy.short_list import beyond_scores, short_listed, takes_long, with_other_starts
from identification.discrepancy.tried import Tried
from tests.identification.discrepancy.made_search import model, round_of, settled
from vibrojax.effects import CoulombFriction, StopCompliance, TimeOffset


@pytest.fixture
def compiled(monkeypatch):
    """Names of the effects whose programs were asked for ahead of their turn."""
    names = []
    monkeypatch.setattr(short_list, "_compiled", lambda thin, scored, candidate, tried: names.append(candidate.name))
    return names


@pytest.fixture
def fits(motion, allowed, monkeypatch, compiled):
    """Short-list these effects, each with its gain and the cost of its fit over noise; returns the order of the rivals, and of the fits."""
    noise = 0.5 * allowed.samples.astype(float)

    def short_list_of(**effects: tuple[float, float]) -> tuple[list[str], list[str], list[str]]:
        rough, full = [], []

        def fit_tolerantly(prepared, tolerance, *, in_short=False, **options):
            name = prepared.model.effects[-1].name
            (rough if in_short else full).append(name)
            return settled(prepared, prepared.start, effects[name][1] * 0.5 * tolerance.samples)

        monkeypatch.setattr(short_list, "fit_tolerantly", fit_tolerantly)
        one = round_of(motion, 3.0 * noise, dict.fromkeys(effects, 1.0))
        found = [dataclasses.replace(each, gain=effects[each.name][0]) for each in one.scored.found]
        scored = dataclasses.replace(one.scored, found=found, significant={each.name: each for each in found})
        return [rival.name for rival in short_listed(scored, allowed, lambda stage: None, Tried())], rough, full

    return short_list_of


def test_a_candidate_that_promises_little_is_not_fitted(fits):
    ranked, rough, _ = fits(coulomb_friction=(1000.0, 1.5), quadratic_drag=(99.0, 1.0), cubic_stiffness=(101.0, 2.0))
    assert rough == ["coulomb_friction", "cubic_stiffness"]
    assert ranked == ["coulomb_friction", "cubic_stiffness"]


def test_where_one_explains_nearly_everything_only_what_may_be_its_twin_is_tried(fits):
    _, rough, _ = fits(coulomb_friction=(1000.0, 1.1), quadratic_drag=(310.0, 1.0), cubic_stiffness=(290.0, 1.0))
    assert rough == ["coulomb_friction", "quadratic_drag"]


@pytest.mark.parametrize("friction", [1.52, 2.0])  # near the best, and not: then it is fitted in full where nothing becomes of the best
@pytest.mark.parametrize("rings", [{1, 2}, {3}], ids=["in short and when it has settled", "in full"])
def test_what_rings_by_itself_is_no_candidate_be_it_found_out_in_short_or_in_full(fits, monkeypatch, friction, rings):
    monkeypatch.setattr(short_list, "rings_by_itself", _drag_rings_when_asked(rings))
    ranked, _, full = fits(coulomb_friction=(1000.0, friction), quadratic_drag=(1000.0, 1.5))
    assert ranked == ["coulomb_friction"]
    assert full == ["quadratic_drag", "coulomb_friction"]


def test_what_rings_in_short_may_only_be_on_its_way(fits, monkeypatch):
    monkeypatch.setattr(short_list, "rings_by_itself", _drag_rings_when_asked({1}))
    ranked, rough, full = fits(coulomb_friction=(1000.0, 2.0), quadratic_drag=(1000.0, 1.5))
    assert ranked == ["quadratic_drag", "coulomb_friction"]
    assert (rough, full) == (["coulomb_friction", "quadratic_drag"], ["quadratic_drag", "quadratic_drag"])


def _drag_rings_when_asked(times: set[int]):
    """Whether the newest effect is drag, in these of the times when it is asked of drag."""
    asked = []

    def rings_by_itself(after, courses) -> bool:
        asked.append(after.names[-1])
        return asked[-1] == "quadratic_drag" and asked.count("quadratic_drag") in times

    return rings_by_itself


@pytest.mark.parametrize(("level", "finalists"), [(1.1, 3), (1.5, 2)])
def test_all_that_are_near_are_fitted_in_full_where_one_explains_nearly_everything_and_two_where_none_does(fits, level, finalists):
    costs = {"coulomb_friction": level + 0.002, "quadratic_drag": level, "cubic_stiffness": level + 0.001, "hysteresis": level + 0.5}
    ranked, rough, full = fits(**{name: (1000.0, cost) for name, cost in costs.items()})
    assert rough == list(costs)
    assert full == ["quadratic_drag", "cubic_stiffness", "coulomb_friction"][:finalists]
    assert ranked == ["quadratic_drag", "cubic_stiffness", "coulomb_friction", "hysteresis"]


def test_the_next_that_will_be_tried_is_compiled_while_one_is_fitted(fits, compiled):
    fits(coulomb_friction=(1000.0, 1.1), quadratic_drag=(310.0, 1.0), cubic_stiffness=(290.0, 1.0))
    assert compiled == ["quadratic_drag"]
    compiled.clear()
    fits(coulomb_friction=(1000.0, 1.5), quadratic_drag=(290.0, 1.4), cubic_stiffness=(280.0, 1.4))
    assert compiled == ["cubic_stiffness"], "of the second nobody knew yet whether it would be tried"


def test_what_is_compiled_ahead_is_what_is_fitted(motion, allowed, monkeypatch):
    evaluated = []
    monkeypatch.setattr(short_list, "evaluator", lambda prepared, integrator: lambda estimate: evaluated.append(prepared))
    one = round_of(motion, 1.5 * allowed.samples, {"coulomb_friction": 1.0})
    (candidate,) = one.scored.found
    thin = short_list._thinned(one.scored, allowed)
    short_list._compiled(thin, one.scored, candidate, Tried())
    fitted = windows_of(extended(one.scored.fitted, candidate, one.scored.courses), thin.chosen)
    assert [prepared.model.effects[-1].name for prepared in evaluated] == ["coulomb_friction"]
    assert [group.ts.shape for group in evaluated[0].groups] == [group.ts.shape for group in fitted.groups]


def test_memory_must_do_better_by_more_than_noise_gains_with_it(fits, monkeypatch):
    def order(margin: float) -> list[str]:
        monkeypatch.setattr(short_list, "states_margin", lambda fitted: margin * ("hysteresis" in fitted.names))
        return fits(constant_force=(1000.0, 1.01), hysteresis=(1000.0, 1.0))[0]

    assert order(0.0) == ["hysteresis", "constant_force"]
    assert order(1e6) == ["constant_force", "hysteresis"]


def test_a_faster_vibration_is_tried_only_where_it_promises_about_as_much_as_the_best(fits):
    assert fits(coulomb_friction=(1000.0, 2.0), stop_compliance=(290.0, 2.0), cubic_stiffness=(290.0, 2.0))[1] == [
        "coulomb_friction",
        "cubic_stiffness",
    ]
    assert "stop_compliance" in fits(coulomb_friction=(1000.0, 2.0), stop_compliance=(310.0, 2.0))[1]


@pytest.mark.parametrize(("gain", "first", "ranked"), [(2000.0, [0, 1, 8, 9], 2), (900.0, [0, 1, 2, 3], 3)])
def test_where_much_is_promised_a_quarter_of_the_windows_tells_candidates_apart(fits, allowed, monkeypatch, gain, first, ranked):
    """Two neighbours of every eight; what has been fitted to these alone is not ranked beside what has been fitted to all."""
    parts, windows_of = [], short_list.windows_of
    monkeypatch.setattr(short_list, "windows_of", lambda prepared, chosen: parts.append(chosen) or windows_of(prepared, chosen))
    order, rough, full = fits(coulomb_friction=(gain, 1.5), quadratic_drag=(gain, 1.49), cubic_stiffness=(gain, 1.9))
    assert [list(part[:4]) for part in parts] == [first] * 3
    assert rough == ["coulomb_friction", "quadratic_drag", "cubic_stiffness"]
    assert full == ["quadratic_drag", "coulomb_friction"]
    assert order == [*full, "cubic_stiffness"][:ranked]


def test_a_deep_stop_is_tried_from_its_two_most_promising_depths_and_friction_once(motion, allowed):
    one = round_of(motion, 0.5 * allowed.samples, {"deep_stop": 1.0, "coulomb_friction": 2.0})
    found = [dataclasses.replace(each, gain=gain) for each in one.scored.found for gain in (90.0, 60.0, 30.0)]
    short = [each for each in found if each.gain == 90.0]
    tried = with_other_starts(short, dataclasses.replace(one.scored, found=found))
    assert [(each.name, each.gain) for each in tried] == [("deep_stop", 90.0), ("deep_stop", 60.0), ("coulomb_friction", 90.0)]
    none = [dataclasses.replace(each, gain=each.gain if each in short else 0.0) for each in found]
    assert with_other_starts(short, dataclasses.replace(one.scored, found=none)) == short


def test_what_vibrates_much_faster_than_the_rig_takes_long_and_a_force_does_not(motion, allowed):
    nominal, friction = model(motion, allowed, 2.0), model(motion, allowed, 2.0, CoulombFriction(friction_force=0.1))
    sprung = model(motion, allowed, 2.0, StopCompliance(stop_stiffness=1e6, stop_frequency_hz=500.0, stop_damping_ratio=0.05))
    assert takes_long(sprung.prepared, nominal)
    assert takes_long(sprung.prepared, friction)
    assert not takes_long(friction.prepared, nominal)
    assert not takes_long(sprung.prepared, sprung)


def test_what_the_records_show_is_tried_as_it_is_proposed_however_little_it_promises(motion):
    shown, half = (Candidate(members=(TimeOffset(d, "impact_force"),), factors=np.array([0.01]), gain=0.0, degrees=1) for d in (3e-3, 1e-4))
    scored = round_of(motion, np.zeros(1), {}).scored
    scored = dataclasses.replace(scored, found=[half, shown], known=dataclasses.replace(scored.known, lags={"impact_force": 3e-3}))
    (tried,) = beyond_scores(scored, [])
    assert tried.members == shown.members and tried.factors == 1.0
    assert [one.members for one in beyond_scores(scored, [half])] == [shown.members]  # another start
    assert beyond_scores(scored, [shown]) == []
