"""An effect whose strength is another one in every record stands in for something else."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy import constancy, steadiness
from identification.discrepancy.constancy import unsteady
from identification.discrepancy.diagnosis import Disagreement, Number
from identification.discrepancy.drift import Drift
from identification.discrepancy.free_form import Learned
from identification.discrepancy.look import blank
from identification.discrepancy.search import BUDGET, EXPLAINED, HELPLESS, LEARNED, MOST_EFFECTS, Search
from identification.discrepancy.steadiness import steadily, steady_search
from tests.identification.discrepancy.made_search import fitted, model, round_of, stage
from vibrojax.effects import EFFECTS, BackStop, CoulombFriction, DeepStop, GapStep, QuadraticDrag, SecondMode
from vibrojax.effects.free_form import FreeForm

FRICTION, DRAG = CoulombFriction(friction_force=0.1), QuadraticDrag(drag_coefficient=0.01)


def differing(name: str, values: list[float], stderr: float) -> Disagreement:
    """A parameter as each record would have it, all with the same error."""
    chi2 = float(np.sum((np.array(values) - np.mean(values)) ** 2)) / stderr**2
    records = {f"cart{index}.csv": (value, stderr) for index, value in enumerate(values)}
    return Disagreement(name=name, chi2=chi2, degrees=len(values) - 1, chance=float(np.exp(-0.5 * chi2)), records=records)


@pytest.mark.parametrize(
    ("values", "stderr", "loose"),
    [
        ([0.05, 0.1, 0.15], 0.002, True),  # half of the value, and sure
        ([0.095, 0.1, 0.105], 0.0005, False),  # as sure, but a twentieth
        ([0.05, 0.1, 0.15], 0.05, False),  # half, but not sure
    ],
)
@pytest.mark.parametrize("nominal", ["f_n", "m"])
def test_only_what_differs_surely_and_widely_is_no_constant(motion, allowed, monkeypatch, nominal, values, stderr, loose):
    found = [differing(nominal, [1.0, 9.0], 0.01), differing("coulomb_friction.friction_force", values, stderr)]
    monkeypatch.setattr(constancy, "disagreements", lambda fitted, allowed: tuple(found))
    fitted = model(motion, allowed, 2.0, DRAG, FRICTION)
    assert unsteady(fitted, allowed) == (("coulomb_friction",) if loose else ())


@pytest.mark.parametrize(
    ("odd", "stderr", "loose"),
    [
        (0.04, 0.005, True),  # one record tells another one, though so much less surely than the others that they hardly scatter
        (0.07, 0.005, False),  # less than half away
        (0.04, 0.012, False),  # within six of its errors
    ],
)
def test_one_record_that_surely_tells_quite_another_strength_is_enough(motion, allowed, monkeypatch, odd, stderr, loose):
    one = differing("coulomb_friction.friction_force", [0.1, 0.1001, 0.0999, 0.1], 1e-4)
    one = dataclasses.replace(one, records=one.records | {"drop.csv": (odd, stderr)}, chance=0.0)
    assert one.scatter < 0.25 * 0.1
    monkeypatch.setattr(constancy, "disagreements", lambda fitted, allowed: (one,))
    assert unsteady(model(motion, allowed, 2.0, FRICTION), allowed) == (("coulomb_friction",) if loose else ())


@pytest.mark.parametrize(
    ("effect", "errors", "vague"),
    [
        (SecondMode(mode_mass=0.1, mode_frequency_hz=30.0, mode_damping_ratio=0.01), (None, 0.1, None), True),
        (SecondMode(mode_mass=0.1, mode_frequency_hz=30.0, mode_damping_ratio=0.01), (0.05, 0.1, 0.004), True),
        (SecondMode(mode_mass=0.1, mode_frequency_hz=30.0, mode_damping_ratio=0.01), (0.02, 0.1, None), False),
        (GapStep(gap_jump=1e-4, instant=12.0), (5e-5, 3e-4), True),  # however well its instant is told
        (GapStep(gap_jump=1e-4, instant=12.0), (1e-5, None), False),
        (FRICTION, (None,), True),
        (FRICTION, (0.02,), False),
        (BackStop(distance=0.01), (None,), False),  # it stands somewhere
        (DeepStop(stiffness=1e5, depth=0.03, damping=100.0), (None, 0.001, None), False),  # and this one there, hard or soft
        (DeepStop(stiffness=1e5, depth=0.03, damping=100.0), (None, 0.03, 10.0), True),
    ],
)
def test_what_the_records_hardly_tell_is_no_cause(motion, allowed, monkeypatch, effect, errors, vague):
    own = [
        Number(name=f"{effect.name}.{p.name}", symbol="", unit="", value=float(getattr(effect, p.field)), stderr=stderr)
        for p, stderr in zip(effect.parameters, errors, strict=True)
    ]
    monkeypatch.setattr(constancy, "disagreements", lambda fitted, allowed: ())
    monkeypatch.setattr(constancy, "numbers", lambda fitted, allowed: tuple(own))
    assert unsteady(model(motion, allowed, 2.0, effect), allowed) == ((effect.name,) if vague else ())


def test_what_is_held_or_each_record_has_of_its_own_is_not_asked_for(motion, allowed, monkeypatch):
    """The amplitude of hum belongs to records, and its frequency was searched for."""
    hum = blank(EFFECTS["mains_hum"])
    frequency = Number(name="mains_hum.frequency_hz", symbol="f_h", unit="Hz", value=50.0, stderr=None)
    monkeypatch.setattr(constancy, "disagreements", lambda fitted, allowed: ())
    monkeypatch.setattr(constancy, "numbers", lambda fitted, allowed: (frequency,))
    found = model(motion, allowed, 2.0, hum)
    assert unsteady(found, allowed) == ("mains_hum",)
    held = dataclasses.replace(found.prepared, fixed=found.prepared.fixed | {frequency.name: 50.0})
    assert unsteady(dataclasses.replace(found, prepared=held), allowed) == ()


@pytest.fixture
def searches(motion, allowed, monkeypatch):
    """What every further search ends with, in turn; and the calls. Friction never holds still."""
    last = round_of(motion, 0.5 * allowed.samples.astype(float), {}).scored

    def ended(how: str, *effects, left: float = 8.0) -> Search:
        levels = (11.0, *[left] * (len(effects) - 1), 2.0)
        rounds = tuple(stage(motion, allowed, *levels[count : count + 2], *effects[: count + 1]) for count in range(len(effects)))
        return Search(rounds=rounds, fitted=model(motion, allowed, 2.0, *effects), last=last, ended=how)

    def given(*results: tuple, left: float = 8.0) -> tuple[list[Search], list[dict]]:
        monkeypatch.setattr(steadiness, "drifts", lambda fitted, allowed: ())
        monkeypatch.setattr(steadiness, "learn", lambda first, **options: None)
        found, calls = [ended(*result, left=left) for result in results], []

        def search(start, allowed, deadline, progress, **options):
            calls.append(options)
            return dataclasses.replace(found[len(calls) - 1], without=options.get("without", ()))

        monkeypatch.setattr(steadiness, "search", search)
        monkeypatch.setattr(steadiness, "reopened", lambda one, allowed, *, without: ())
        monkeypatch.setattr(steadiness, "unsteady", lambda fitted, allowed: tuple(n for n in fitted.names if n == "coulomb_friction"))
        monkeypatch.setattr(steadiness, "vague", lambda fitted, allowed: ())
        return found, calls

    return given


def test_the_search_goes_back_to_where_the_unsteady_effect_came_in(motion, allowed, searches):
    found, calls = searches((HELPLESS, DRAG, FRICTION), (HELPLESS, DRAG))
    result = steady_search(found[0].fitted, allowed, np.inf)
    assert result.fitted.names == ("quadratic_drag",)
    assert result.without == ("coulomb_friction",)
    assert [call.get("begun") for call in calls] == [None, found[0].rounds[:1]]


@pytest.mark.parametrize("ended", [EXPLAINED, BUDGET])
def test_one_effect_that_explains_all_stands_and_no_second_search_is_begun_without_time(motion, allowed, searches, ended):
    found, calls = searches((ended, FRICTION))
    assert steady_search(found[0].fitted, allowed, np.inf).fitted.names == ("coulomb_friction",)
    assert len(calls) == 1


def test_one_effect_that_explains_all_and_is_not_told_is_doubted(motion, allowed, searches, monkeypatch):
    """As a hysteresis without strength, by whose states windows follow a restless rig; that another one explains all is another matter."""
    found, calls = searches((EXPLAINED, FRICTION), (EXPLAINED, DRAG))
    monkeypatch.setattr(steadiness, "vague", lambda fitted, allowed: tuple(n for n in fitted.names if n == "coulomb_friction"))
    result = steady_search(found[0].fitted, allowed, np.inf)
    assert (result.explained, result.fitted.names) == (True, ("quadratic_drag",))
    assert result.nearest is not None and result.nearest.names == ("coulomb_friction",)
    assert [call.get("without") for call in calls] == [None, ("coulomb_friction",)]


@pytest.mark.parametrize(("again", "names"), [(EXPLAINED, 1), (HELPLESS, 1), (BUDGET, 2)])
def test_several_effects_that_explain_all_are_doubted_where_one_does_not_hold_still(motion, allowed, searches, monkeypatch, again, names):
    """Not even for lack of time are they asserted; but they are remembered."""
    monkeypatch.setattr(steadiness, "pruned", lambda fitted, allowed: fitted)
    found, calls = searches((EXPLAINED, DRAG, FRICTION), (again, DRAG))
    result = steady_search(found[0].fitted, allowed, np.inf)
    assert found[0].explained
    assert result.explained is (again == EXPLAINED)
    assert result.fitted.names == ("quadratic_drag", "coulomb_friction")[:names]
    assert result.nearest is not None
    assert result.nearest.names == ("quadratic_drag", "coulomb_friction")
    assert [call.get("without") for call in calls] == [None, ("coulomb_friction",)]


def test_an_effect_that_a_later_one_makes_needless_may_be_as_loose_as_it_likes(motion, allowed, searches, monkeypatch):
    monkeypatch.setattr(steadiness, "pruned", lambda fitted, allowed: model(motion, allowed, 2.0, DRAG))
    found, calls = searches((EXPLAINED, FRICTION, DRAG))
    assert steady_search(found[0].fitted, allowed, np.inf).explained
    assert len(calls) == 1


def test_what_explains_most_by_itself_is_asserted_where_nothing_else_explains_the_rest(motion, allowed, searches, monkeypatch):
    """First what may explain the rest in place of the loose effect is looked for."""
    monkeypatch.setattr(steadiness, "pruned", lambda fitted, allowed: fitted)
    found, calls = searches((EXPLAINED, DRAG, FRICTION), (BUDGET, DRAG), left=2.0)
    result = steady_search(found[0].fitted, allowed, np.inf)
    most, share = steadily(result, allowed)
    assert [call.get("without") for call in calls] == [None, ("coulomb_friction",)]
    assert not result.explained
    assert most is not None
    assert (most.names, share) == (("quadratic_drag",), pytest.approx(0.9))


@pytest.mark.parametrize(("from_the_first", "dropped"), [(True, "coulomb_friction"), (False, "quadratic_drag")])
def test_what_never_held_still_goes_before_what_a_later_effect_has_made_loose(
    motion, allowed, searches, monkeypatch, from_the_first, dropped
):
    monkeypatch.setattr(steadiness, "pruned", lambda fitted, allowed: fitted)
    found, calls = searches((EXPLAINED, FRICTION, DRAG), (EXPLAINED, FRICTION))
    monkeypatch.setattr(steadiness, "unsteady", lambda fitted, allowed: fitted.names if from_the_first or len(fitted.names) == 2 else ())
    steady_search(found[0].fitted, allowed, np.inf)
    assert calls[1]["without"] == (dropped,)


def test_a_second_search_that_is_cut_short_is_not_believed(motion, allowed, searches):
    found, _ = searches((HELPLESS, DRAG, FRICTION), (BUDGET, DRAG))
    result = steady_search(found[0].fitted, allowed, np.inf)
    assert (result.ended, result.fitted.names) == (HELPLESS, ("quadratic_drag", "coulomb_friction"))
    assert result.cut_short


@pytest.mark.parametrize("all_by_term", [True, False])
def test_a_third_effect_is_tried_only_where_no_learned_term_explains_all(motion, allowed, searches, monkeypatch, all_by_term):
    found, calls = searches((MOST_EFFECTS, FRICTION, DRAG), (HELPLESS, FRICTION, DRAG))
    left = fitted(motion, (0.9 if all_by_term else 3.0) * 0.5 * allowed.samples.astype(float))
    learned = Learned(fitted=left, effect=FreeForm(terms=("u",), scales=(1.0,)), formula="c1 u", explained=0.99)
    asked = []
    monkeypatch.setattr(steadiness, "learn", lambda first, **options: asked.append(first) or learned)
    monkeypatch.setattr(steadiness, "unsteady", lambda fitted, allowed: ())
    result = steady_search(found[0].fitted, allowed, np.inf)
    assert (result.ended, result.learned) == (LEARNED if all_by_term else HELPLESS, learned)
    assert [call.get("begun") for call in calls] == [None, found[0].rounds][: len(calls)]
    assert len(calls) == (1 if all_by_term else 2)
    assert asked[0] is found[0].first


def test_what_held_still_before_trifles_were_added_to_it_is_enough(motion, allowed, searches, monkeypatch):
    """Friction does not hold still beside drag, but alone it does, and explains nine tenths."""
    found, calls = searches((HELPLESS, FRICTION, DRAG), left=2.0)
    monkeypatch.setattr(steadiness, "unsteady", lambda fitted, allowed: fitted.names if len(fitted.names) == 2 else ())
    result = steady_search(found[0].fitted, allowed, np.inf)
    assert len(calls) == 1
    most, share = steadily(result, allowed)
    assert most is not None
    assert (most.names, share) == (("coulomb_friction",), pytest.approx(0.9))


@pytest.mark.parametrize(
    ("share", "change", "chance", "mimics"),
    [
        (0.3, 0.009, 1e-9, True),  # as it was without drag
        (0.3, 0.001, 1e-9, False),  # drag brings it to rest, nearly
        (0.3, 0.009, 1e-3, False),  # drag brings it to rest, as far as one can tell
        (0.03, 0.009, 1e-9, False),  # it drifts, but that is not what the misfit is about
    ],
)
def test_what_leaves_a_parameter_drifting_within_records_only_stands_in_for_that(
    motion, allowed, monkeypatch, searches, share, change, chance, mimics
):
    found, _ = searches((EXPLAINED, DRAG))
    nominal = found[0].first.fitted
    before = Drift(name="f_n", chance=0.0, gain=share * 2.0 * (found[0].rounds[0].cost - allowed.noise), change=0.008, halves={})
    beside = Drift(name="f_n", chance=chance, gain=1.0, change=change, halves={})
    monkeypatch.setattr(steadiness, "drifts", lambda fitted, allowed: (before,) if fitted is nominal else (beside,))
    result = steady_search(nominal, allowed, np.inf)
    assert result.mimics == (before if mimics else None)
    assert result.explained is not mimics
    assert (steadily(result, allowed)[0] is None) is mimics
