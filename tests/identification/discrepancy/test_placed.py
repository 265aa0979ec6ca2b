"""A jump of the gap that falls into a contact is looked for there; with fits whose costs are made to order, and once for real."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from benchmarks.simulator import Hidden, Order, draw_case, write_case
from benchmarks.simulator.experiment import true_signals
from identification.discrepancy import placed
from identification.discrepancy.look import look
from identification.discrepancy.placed import better_placed
from identification.discrepancy.refit import extended
from identification.discrepancy.robust import robust_fit
from identification.discrepancy.score import Candidate
from identification.discrepancy.tolerant_fit import fit_tolerantly
from identification.experiment import load_experiment
from identification.fit import free_unknowns
from identification.prepare import prepare
from tests.identification.discrepancy.made_search import round_of, settled
from vibrojax.effects import CoulombFriction, GapStep
from vibrojax.errors import NoConvergenceError

CONTACTS = {"drop.csv": ((0.10, 0.12), (0.30, 0.34), (0.50, 0.52))}


@pytest.fixture
def places(motion, allowed, monkeypatch):
    """The fit with this effect at so many times the noise, after each place's fit has ended with its cost; and what was fitted."""
    first = round_of(motion, 3.0 * 0.5 * allowed.samples, {}).scored
    known = dataclasses.replace(first.known, contacts=CONTACTS)

    def placed_again(effect, level: float, costs: dict[float, float | None]):
        asked, candidate = [], Candidate(members=(effect,), factors=np.ones(1), gain=1.0, degrees=1)
        prepared = extended(first.fitted, candidate, first.courses)
        fitted = settled(prepared, prepared.start, level * 0.5 * allowed.samples)

        def fit_tolerantly(start, tolerance):
            asked.append(start)
            cost = costs[round(start.layout.physical(start.start.shared)["gap_step.instant"], 6)]
            if cost is None:
                raise NoConvergenceError("for the test")
            return settled(start, start.start, cost * 0.5 * tolerance.samples)

        monkeypatch.setattr(placed, "fit_tolerantly", fit_tolerantly)
        return better_placed(fitted, known, allowed), fitted, asked

    return placed_again


STEP = GapStep(gap_jump=1e-4, instant=0.21, in_file="drop.csv")
PLACES = (0.105, 0.115, 0.31, 0.33)


def test_a_jump_is_looked_for_in_the_contacts_beside_its_flight_and_the_best_place_is_kept(places):
    found, before, asked = places(STEP, 3.0, dict(zip(PLACES, (3.5, 2.0, None, 1.5), strict=True)))
    assert float(found.model.effects[-1].instant) == pytest.approx(0.33)
    column = before.prepared.layout.index("gap_step.instant")
    assert not free_unknowns(before.prepared).shared[column]
    assert [bool(free_unknowns(one).shared[column]) for one in asked] == [True] * 4


def test_no_place_is_tried_after_one_that_leaves_nothing_but_noise(places):
    found, _, asked = places(STEP, 3.0, {PLACES[0]: 1.0})
    assert (float(found.model.effects[-1].instant), len(asked)) == (pytest.approx(PLACES[0]), 1)
    same, before, none = places(STEP, 1.0, {})
    assert same is before and not none


def test_a_jump_in_flight_stays_where_no_contact_is_better_and_friction_has_no_place(places):
    found, before, asked = places(STEP, 2.0, dict.fromkeys(PLACES, 2.0))
    assert found is before and len(asked) == 4
    found, before, asked = places(CoulombFriction(friction_force=0.1), 2.0, {})
    assert found is before and not asked


@pytest.mark.parametrize(("drop", "moves"), [(7.5, False), (8.5, True)])
def test_a_place_in_a_contact_must_do_better_than_chance(places, allowed, drop, moves):
    def total(level: float) -> float:
        return allowed.total(level * 0.5 * allowed.samples)

    level = brentq(lambda level: total(2.0) - total(level) - drop, 1.0, 2.0, xtol=1e-12)
    found, before, _ = places(STEP, 2.0, dict.fromkeys(PLACES, level))
    assert (found is not before) == moves


def test_a_jump_that_was_concealed_in_a_contact_is_found_there(tmp_path):
    """Made by a simulator that shares no line with the program; its jump takes no time, the model's a millisecond."""
    rng = np.random.default_rng(5)
    case = draw_case(rng, Order(kind="soft", effects=(("gap_step", 1.0),), driven=1, samples=(1601, 4001)))
    driven = case.plans[1]
    truth = {"gap_jump": 2e-4, "jump_time": _within_a_contact(true_signals(case.rig, driven))}
    write_case(tmp_path / "rig", dataclasses.replace(case, parts=(Hidden(records={driven.file: truth}),)), rng)
    nominal, tolerance = robust_fit(prepare(load_experiment(tmp_path / "rig")))
    scored = look(nominal, tolerance)
    candidate = max((one for one in scored.significant.values() if one.name == "gap_step"), key=lambda one: one.gain)
    in_flight = fit_tolerantly(extended(nominal, candidate, scored.courses), tolerance)
    assert in_flight is not None
    step = better_placed(in_flight, scored.known, tolerance).model.effects[-1]
    assert abs(float(in_flight.model.effects[-1].instant) - truth["jump_time"]) > 5e-3
    assert float(step.instant) == pytest.approx(truth["jump_time"], abs=1e-3)
    assert float(step.gap_jump) == pytest.approx(truth["gap_jump"], rel=0.1)


def _within_a_contact(signals: dict[str, np.ndarray]) -> float:
    """Middle of a contact halfway through a record, s."""
    touching = np.pad(signals["impact_force"] > 0, 1).astype(int)
    touches, releases = np.flatnonzero(np.diff(touching) == 1), np.flatnonzero(np.diff(touching) == -1)
    return float(signals["time"][(touches + releases) // 2][len(touches) // 2])
