"""The course of a search, with the gains of its candidates made to order; and limits of it on request."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from identification.diagnosis import diagnose
from identification.diagnosis import scores as scores_module
from identification.diagnosis import search as module
from identification.diagnosis.free_forms import Form
from identification.diagnosis.scores import LARGE_PART, Candidate, Scored, Scores, among_effects, limit_warning
from identification.diagnosis.search import MOST_EFFECTS, Alternative, OutOfBudgetError, Search, Step, is_significant, search
from identification.trajectory.additions import Reestimated
from identification.trajectory.fit import Fitted
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.variances import LARGEST_FORCE, Variances
from tests.effects.start import at_start
from vibrojax.contact import NoContact
from vibrojax.effects import EFFECTS, AbstractEffect, TimeOffset
from vibrojax.effects.free_form import TonalForce
from vibrojax.errors import InputError


def fitted(scores: Scores, *names: str, deviance: float = 0.0) -> Fitted:
    """A model with these effects, as likely as this."""
    one = scores.fitted
    model = dataclasses.replace(one.problem.model, effects=tuple(at_start(EFFECTS[name]) for name in names))
    problem = dataclasses.replace(one.problem, model=model)
    return dataclasses.replace(one, problem=problem, solution=dataclasses.replace(one.solution, deviance=deviance))


def first_order(scores: Scores, variances: Variances) -> Reestimated:
    """A model with a candidate at first order, with these variances."""
    return Reestimated(deviance=0.0, strengths=np.zeros(1), covariance=np.eye(1), variances=variances, at=scores.fitted.at)


def alternative(name: str, gain: float, found: Fitted | None = None) -> Alternative:
    """A candidate that was refitted, where there is a fit."""
    candidate = Candidate(name=name, members=(at_start(EFFECTS[name]),), signals=())
    return Alternative(candidate=candidate, gain=gain, degrees=1, tried=200, fitted=found, drop=None if found is None else gain)


@pytest.fixture
def gains(scores, monkeypatch):
    """Sets what scoring finds in each step: effects in the order in which they are taken in, with their gains."""

    def found(*order: tuple[str, float]) -> None:
        offered = iter(order)

        def step(at: Scores, weighed, judge, progress, known=(), no_worse_than=None) -> Step:
            if known:
                return Step(scores=at, alternatives=known)
            if (one := next(offered, None)) is None:
                return Step(scores=at, alternatives=())
            names, (name, gain) = [effect.name for effect in at.fitted.problem.model.effects], one
            after = fitted(scores, *names, name, deviance=at.fitted.solution.deviance - gain)
            return Step(scores=at, alternatives=(alternative(name, gain, after), alternative("gain_error", 0.5 * gain)))

        monkeypatch.setattr(module, "_step", step)
        monkeypatch.setattr(module, "score_all", lambda at, among, terms: dataclasses.replace(scores, fitted=at))
        monkeypatch.setattr(module, "_weighed", lambda at: [])
        monkeypatch.setattr(module, "contradicted", lambda at: ())

    return found


def names_of(one: Fitted) -> list[str]:
    return [effect.name for effect in one.problem.model.effects]


def names(found: Search) -> list[str]:
    return names_of(found.final)


def test_effects_are_taken_in_while_their_gain_is_more_than_chance(scores, gains, monkeypatch):
    gains(("coulomb_friction", 900.0), ("gap_drift", 80.0), ("mains_hum", 12.0))
    monkeypatch.setattr(module, "refitted", lambda problem, near, beside, progress: fitted(scores, "gap_drift", deviance=-80.0))
    found = search(fitted(scores), judge=refusing())
    assert (names(found), found.finished) == (["coulomb_friction", "gap_drift"], True)
    assert [step.alternatives[0].name for step in found.steps] == names(found)
    assert found.last is not None and found.last.alternatives[0].name == "mains_hum"
    assert not is_significant(found.last.alternatives[0])


def test_an_effect_that_a_later_one_makes_needless_is_left_out(scores, gains, monkeypatch):
    gains(("coulomb_friction", 900.0), ("hysteresis", 800.0))
    monkeypatch.setattr(module, "refitted", lambda problem, near, beside, progress: fitted(scores, "hysteresis", deviance=-1695.0))
    found = search(fitted(scores), judge=refusing())
    assert names(found) == ["hysteresis"] == [step.alternatives[0].name for step in found.steps]


def test_where_an_effect_was_needless_the_search_goes_on_beside_the_others(scores, gains, monkeypatch):
    gains(("coulomb_friction", 900.0), ("hysteresis", 800.0), ("mains_hum", 12.0), ("gap_drift", 80.0), ("mains_hum", 12.0))
    left = {"coulomb_friction": -1695.0, "hysteresis": -80.0}
    monkeypatch.setattr(module, "without", lambda final, name: (name, None))
    monkeypatch.setattr(
        module, "refitted", lambda name, near, beside, progress: fitted(scores, *({"hysteresis"} - {name}), deviance=left[name])
    )
    assert names(search(fitted(scores), judge=refusing())) == ["hysteresis", "gap_drift"]


@pytest.fixture
def in_steps(scores, monkeypatch):
    """Sets what is weighed beside each model, by the names of its effects; a refit gains as much, which a model without it loses."""

    def found(**beside: dict[str, float]) -> None:
        gained = {name: gain for each in beside.values() for name, gain in each.items()}
        one = scores.fitted
        anew = first_order(scores, one.variances)
        model = lambda held: fitted(scores, *held, deviance=-sum(gained[name] for name in held))  # noqa: E731

        def refitted(at: Scores, one: Alternative, weighed, progress) -> list[Alternative]:
            return [alternative(one.name, one.gain, model([*names_of(at.fitted), one.name]))]

        def weighed(at: Scores) -> list[tuple[Alternative, Reestimated]]:
            return [(alternative(n, gain), anew) for n, gain in beside.get("_".join(names_of(at.fitted)) or "nothing", {}).items()]

        monkeypatch.setattr(module, "_weighed", weighed)
        monkeypatch.setattr(module, "_refitted", refitted)
        monkeypatch.setattr(module, "score_all", lambda at, among, terms: dataclasses.replace(scores, fitted=at))
        monkeypatch.setattr(module, "contradicted", lambda at: ())
        monkeypatch.setattr(module, "without", lambda final, name: ([n for n in names_of(final) if n != name], None))
        monkeypatch.setattr(module, "refitted", lambda held, near, beside, progress: model(held))

    return found


ERRORS = {
    "": 0.32,
    "coulomb_friction": 0.08,
    "power_law_damping": 0.066,
    "power_law_damping nonlinear_reading": 0.077,
    "nonlinear_reading": 0.323,
}


@pytest.mark.parametrize(("friction", "kept"), [(0.034, True), (0.07, False), (None, False)], ids=["smaller", "larger", "none"])
def test_an_effect_may_raise_the_error_where_the_search_then_ends_with_a_smaller_one(scores, in_steps, friction, kept):
    """Beside a power law in place of friction the true curvature of a sensor does; beside it, friction takes the place of the law."""
    beside_reading = {"power_law_damping": 900.0} | ({} if friction is None else {"coulomb_friction": 1200.0})
    in_steps(nothing={"power_law_damping": 900.0}, power_law_damping={"nonlinear_reading": 300.0}, nonlinear_reading=beside_reading)
    judge = Judge(known=ERRORS | {"nonlinear_reading coulomb_friction": friction})
    found = search(fitted(scores), judge=judge)
    assert names(found) == (["nonlinear_reading", "coulomb_friction"] if kept else ["power_law_damping"])
    assert [step.alternatives[0].name for step in found.steps] == names(found)
    assert found.finished and (found.last is None or [one.name for one in found.last.refused] == ([] if kept else ["nonlinear_reading"]))


def test_an_effect_that_raised_the_error_leaves_where_it_still_does_beside_the_others(scores, in_steps):
    """A drift of the gap, allowed beside hysteresis, spoils what friction in its place explains."""
    in_steps(
        nothing={"hysteresis": 900.0},
        hysteresis={"gap_drift": 300.0},
        hysteresis_gap_drift={"coulomb_friction": 200.0},
    )
    errors = {"": 0.5, "hysteresis": 0.1, "hysteresis gap_drift": 0.15, "hysteresis gap_drift coulomb_friction": 0.09}
    errors |= {"gap_drift coulomb_friction": 0.2, "hysteresis coulomb_friction": 0.03, "coulomb_friction": 0.4}
    assert names(search(fitted(scores), judge=Judge(known=errors))) == ["hysteresis", "coulomb_friction"]


@pytest.mark.parametrize(("gain", "first"), [(299.0, "coulomb_friction"), (200.0, "gap_drift")], ids=["a twin", "far below"])
def test_of_twins_one_that_raises_no_error_stands_first(scores, in_steps, gain, first):
    in_steps(nothing={"gap_drift": 300.0, "coulomb_friction": gain})
    judge = Judge(known={"": 0.1, "gap_drift": 0.15, "coulomb_friction": 0.03, "hysteresis": 0.5})
    at = dataclasses.replace(scores, fitted=fitted(scores))
    step = module._step(at, module._weighed(at), judge, lambda line: None, no_worse_than=fitted(scores, "hysteresis"))
    assert step.alternatives[0].name == first and step.alternatives[0].fitted is not None


def a_free_form() -> Candidate:
    """A force at one frequency."""
    wave = TonalForce(9.0, 0.1, 0.1)
    form = Form(
        coordinate="frequency",
        quantity="force",
        unit="Hz",
        knots=np.array([9.0]),
        columns=np.zeros((2, 2), int),
        size=1.0,
        signals=(),
        members=(wave,),
    )
    return Candidate(name="tonal_force", members=(wave,), signals=(), form=form)


def test_an_effect_in_whose_place_a_free_form_says_more_is_left_out(scores, gains, monkeypatch):
    gains(("coulomb_friction", 900.0), ("gap_drift", 80.0), ("mains_hum", 12.0))
    offered = module._step

    def step(at: Scores, weighed, judge, progress, known=(), no_worse_than=None) -> Step:
        if not known:
            return offered(at, weighed, judge, progress)
        more = dataclasses.replace(known[0], candidate=a_free_form(), drop=5000.0)
        return Step(scores=at, alternatives=(more, *known))

    monkeypatch.setattr(module, "_step", step)
    monkeypatch.setattr(module, "refitted", lambda problem, near, beside, progress: fitted(scores, "gap_drift", deviance=-80.0))
    assert "coulomb_friction" not in names(search(fitted(scores), judge=refusing()))


def test_a_search_ends_with_the_budget_and_says_so(scores, gains):
    gains(("coulomb_friction", 900.0), ("gap_drift", 80.0))
    lines = []

    def progress(line: str) -> None:
        lines.append(line)
        if len(lines) == 2:
            raise OutOfBudgetError

    found = search(fitted(scores), judge=refusing(), progress=progress)
    assert (names(found), found.finished, found.last) == (["coulomb_friction"], False, None)


def test_a_search_adds_so_many_effects_and_no_more(scores, gains, monkeypatch):
    monkeypatch.setattr(module, "_needed", lambda found, *rest: found)
    order = list(EFFECTS)[: MOST_EFFECTS + 1]
    gains(*((name, 900.0) for name in order))
    found = search(fitted(scores), judge=refusing())
    assert (names(found), found.finished) == (order[:MOST_EFFECTS], True)


def test_effects_are_looked_for_again_beside_values_in_each_record(scores, gains, monkeypatch):
    """The second effect shows only beside values that no effect is asked for before; of them it is asked once."""
    gains(("coulomb_friction", 900.0), ("gap_drift", 12.0))
    asked = []

    def with_values(at: Fitted, differing, progress) -> Fitted:
        gains(("gap_drift", 80.0), ("mains_hum", 12.0))
        asked.append((names_of(at), differing))
        return at

    monkeypatch.setattr(module, "contradicted", lambda at: ("f_n",))
    monkeypatch.setattr(module, "with_values", with_values)
    monkeypatch.setattr(module, "refitted", lambda problem, near, beside, progress: fitted(scores, "gap_drift", deviance=-80.0))
    assert names(search(fitted(scores), judge=refusing())) == ["coulomb_friction", "gap_drift"]
    assert asked == [(["coulomb_friction"], ("f_n",))]


@pytest.mark.parametrize(("gain", "first"), [(2000.0, True), (500.0, False)])
def test_values_in_each_record_come_before_an_effect_that_says_less(scores, gains, monkeypatch, gain, first):
    gains(("coulomb_friction", 900.0))
    asked = []
    best = dataclasses.replace(alternative("coulomb_friction", 900.0), fitted=None)
    monkeypatch.setattr(module, "_weighed", lambda at: [(best, first_order(scores, scores.fitted.variances))])
    monkeypatch.setattr(module, "contradicted", lambda at: () if asked else ("f_n",))
    monkeypatch.setattr(module, "gain_of_values", lambda at, differing: (gain, 3))
    monkeypatch.setattr(module, "with_values", lambda at, differing, progress: asked.append(names_of(at)) or at)
    assert names(search(fitted(scores), judge=refusing())) == ["coulomb_friction"]
    assert asked[0] == ([] if first else ["coulomb_friction"])


@pytest.mark.parametrize(("gain", "first"), [(2000.0, True), (500.0, False)])
def test_where_gains_at_first_order_compare_nothing_values_are_compared_with_effects_as_fitted(scores, gains, monkeypatch, gain, first):
    """At first order the values say more than the effect, whatever they gain in a fit."""
    gains(("coulomb_friction", 900.0))
    large = Variances(
        force=RandomForce(std=0.1 * scores.fitted.problem.scales.force, memory=0.1), readings=scores.fitted.variances.readings
    )
    asked = []

    def with_values(at: Fitted, differing, progress) -> Fitted:
        asked.append(names_of(at))
        if first:  # the effect is asked again beside them
            gains(("coulomb_friction", 900.0))
        return fitted(scores, deviance=at.deviance - gain)

    monkeypatch.setattr(module, "_weighed", lambda at: [(alternative("coulomb_friction", 10.0), first_order(scores, large))])
    monkeypatch.setattr(module, "contradicted", lambda at: () if asked else ("f_n",))
    monkeypatch.setattr(module, "with_values", with_values)
    found = search(fitted(scores), judge=refusing())
    assert (names(found), asked) == (["coulomb_friction"], [[]])
    assert found.steps[0].scores.fitted.deviance == (-gain if first else 0.0)


def test_an_effect_that_was_fitted_is_kept_where_the_budget_ends_before_values_are(scores, gains, monkeypatch):
    gains(("coulomb_friction", 900.0))
    large = dataclasses.replace(scores.fitted.variances, force=RandomForce(std=0.1 * scores.fitted.problem.scales.force, memory=0.1))

    def with_values(at: Fitted, differing, progress) -> Fitted:
        raise OutOfBudgetError

    monkeypatch.setattr(module, "_weighed", lambda at: [(alternative("coulomb_friction", 10.0), first_order(scores, large))])
    monkeypatch.setattr(module, "contradicted", lambda at: ("f_n",))
    monkeypatch.setattr(module, "with_values", with_values)
    found = search(fitted(scores), judge=refusing())
    assert (names(found), found.finished) == (["coulomb_friction"], False)


@pytest.mark.parametrize(
    ("gain", "varying", "only_force", "likelier"), [(905.0, 1, False, False), (905.0, 3, False, True), (905.0, 1, True, True)]
)
def test_values_pay_for_each_standard_deviation_and_gain_nothing_by_the_largest_force(
    scores, monkeypatch, gain, varying, only_force, likelier
):
    step = Step(
        scores=dataclasses.replace(scores, fitted=fitted(scores)), alternatives=(alternative("coulomb_friction", 900.0, scores.fitted),)
    )
    monkeypatch.setattr(module, "variations", lambda problem: dict.fromkeys(("k_i", "n", "f_n")[:varying], 0))
    monkeypatch.setattr(module, "only_by_force", lambda one, other: only_force)
    assert module._is_likelier(step, fitted(scores, deviance=-gain)) == likelier
    assert not module._is_likelier(dataclasses.replace(step, alternatives=()), fitted(scores, deviance=-gain))


@pytest.fixture
def weighed(scores, monkeypatch):
    """Sets the candidates of one model with their gains at first order; a refit gains as much. Returns what was refitted, in order."""

    def found(**gains: float) -> list[str]:
        tried: list[str] = []
        one = scores.fitted
        anew = first_order(scores, one.variances)

        def refitted(at: Scores, one: Alternative, weighed, progress) -> list[Alternative]:
            tried.append(one.name)
            return [alternative(one.name, one.gain, fitted(at, one.name, deviance=-one.gain))]

        monkeypatch.setattr(module, "_weighed", lambda at: [(alternative(n, gain), anew) for n, gain in gains.items()])
        monkeypatch.setattr(module, "_refitted", refitted)
        return tried

    return found


@dataclasses.dataclass(frozen=True)
class Judge:
    """Refuses some effects, and knows what records held back say of others."""

    refused: tuple[str, ...] = ()
    held_back: dict[str, float] = dataclasses.field(default_factory=dict)
    asked: list[str] = dataclasses.field(default_factory=list)
    known: dict[str, float] = dataclasses.field(default_factory=dict)

    def errors(self, before: Fitted, after: Fitted) -> tuple[float, float]:
        return self.known[" ".join(names_of(before))], self.known[" ".join(names_of(after))]

    def with_held_back(self, before: Fitted, one: Alternative) -> Alternative:
        return dataclasses.replace(one, held_back=self.held_back.get(one.name, 0.0))

    def __call__(self, before: Fitted, one: Alternative, no_worse_than: Fitted | None = None) -> Alternative:
        self.asked.append(one.name)
        errors = self.errors(before, one.fitted) if self.known else None
        allowed = (
            max(errors[0], self.errors(no_worse_than, one.fitted)[0]) if errors and no_worse_than is not None else errors and errors[0]
        )
        refused = one.name in self.refused or bool(errors and errors[1] > allowed)
        return dataclasses.replace(one, refused="it does not predict" if refused else "", errors=errors)


def refusing(*refused: str) -> Judge:
    return Judge(refused=refused)


def test_the_next_one_is_fitted_where_the_best_is_refused(scores, weighed):
    tried = weighed(second_mode=900.0, coulomb_friction=300.0, quadratic_drag=200.0, mains_hum=9.0)
    step = module._step(scores, module._weighed(scores), refusing("second_mode"), lambda line: None)
    assert tried == ["second_mode", "coulomb_friction", "quadratic_drag"], "the last of them within a half of the one before"
    assert [one.name for one in step.alternatives] == ["coulomb_friction", "quadratic_drag", "mains_hum"]
    assert [(one.name, one.refused) for one in step.refused] == [("second_mode", "it does not predict")]


def test_a_step_that_runs_out_of_time_keeps_what_was_fitted_and_says_so(scores, weighed, monkeypatch):
    tried, refitted = weighed(second_mode=900.0, coulomb_friction=800.0, quadratic_drag=700.0), module._refitted

    def until_the_second(at, one, weighed, progress):
        if len(tried) == 1:
            raise OutOfBudgetError
        return refitted(at, one, weighed, progress)

    monkeypatch.setattr(module, "_refitted", until_the_second)
    monkeypatch.setattr(module, "score_all", lambda at, among, terms: dataclasses.replace(scores, fitted=at))
    found = search(fitted(scores), judge=refusing())
    assert (tried, found.finished, names(found)) == (["second_mode"], False, ["second_mode"])
    assert "(coulomb_friction and quadratic_drag not fitted)" in diagnose._warnings(found)[0]


def test_where_the_best_is_taken_in_nothing_far_below_it_is_fitted(scores, weighed):
    tried = weighed(second_mode=900.0, coulomb_friction=300.0)
    step = module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert (tried, step.refused) == (["second_mode"], ())
    assert [one.fitted is None for one in step.alternatives] == [False, True]


def test_of_a_twin_the_model_is_kept_and_says_what_to_record_next(scores, weighed, monkeypatch):
    weighed(second_mode=900.0, coulomb_friction=890.0)
    step = module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert [(one.name, one.fitted is None, one.cause is None) for one in step.alternatives] == [
        ("second_mode", False, True),
        ("coulomb_friction", True, False),
    ]
    asked = []
    monkeypatch.setattr(diagnose, "next_experiment", lambda *given: asked.append(given) or "one more")
    final = step.alternatives[0].fitted
    found = Search(nominal=scores.fitted, final=final, steps=(step,), last=None, finished=True)
    side = SimpleNamespace(records=("with their predictions",))
    assert diagnose._next_experiment("the rig", found, {"second_mode": diagnose._twins(step)}, side) == "one more"
    experiment, named, twins, name, records = asked[0]
    assert (experiment, named.at is final.at, name, records) == ("the rig", True, "second_mode", ("with their predictions",))
    assert twins == {"coulomb_friction": step.alternatives[1].cause}


def test_what_records_held_back_say_against_an_effect_counts(scores, weighed):
    weighed(second_mode=60.0, coulomb_friction=50.0)
    judge = Judge(held_back={"second_mode": -55.0, "coulomb_friction": 40.0})
    step = module._step(scores, module._weighed(scores), judge, lambda line: None)
    assert [one.name for one in step.alternatives] == ["coulomb_friction", "second_mode"]
    assert step.alternatives[0].best == 90.0 and not is_significant(step.alternatives[1])


def test_fitted_alternatives_are_ranked_with_the_records_held_back(scores, weighed):
    weighed(second_mode=60.0, coulomb_friction=50.0)
    judge = Judge(held_back={"second_mode": 5.0, "coulomb_friction": 40.0})
    step = module._step(scores, module._weighed(scores), judge, lambda line: None)
    assert [(one.name, one.best) for one in step.alternatives] == [("coulomb_friction", 90.0), ("second_mode", 65.0)]


@pytest.mark.parametrize(("gain", "first"), [(310.0, "coulomb_friction"), (340.0, "power_law_damping")])
def test_a_special_case_stands_first_unless_the_records_reject_it(scores, weighed, gain, first):
    weighed(power_law_damping=gain, coulomb_friction=300.0)
    assert module._step(scores, module._weighed(scores), refusing(), lambda line: None).alternatives[0].name == first


@pytest.mark.parametrize(
    ("first", "others", "refused", "exchanged"),
    [
        pytest.param("power_law_damping", {"coulomb_friction": 897.0}, (), True, id="a special case"),
        pytest.param("power_law_damping", {"coulomb_friction": 860.0}, (), False, id="a special case that is rejected"),
        pytest.param("hysteresis", {"cubic_stiffness": 1200.0}, (), True, id="a better one"),
        pytest.param("hysteresis", {"cubic_stiffness": 890.0}, (), False, id="a twin"),
        pytest.param("hysteresis", {"cubic_stiffness": 400.0}, (), False, id="far below"),
        pytest.param("hysteresis", {"cubic_stiffness": 60.0}, ("hysteresis",), False, id="refused, and the other far below"),
        pytest.param("hysteresis", {}, ("hysteresis",), False, id="refused, and no other"),
    ],
)
def test_beside_a_later_effect_another_may_be_better_than_the_first(scores, weighed, monkeypatch, first, others, refused, exchanged):
    """The first effect gains 900 beside the later one."""
    tried = weighed(**{first: 900.0, **others})
    again = lambda at, one, *rest: [alternative(one.name, one.gain, fitted(at, "nonlinear_reading", one.name, deviance=-80 - one.gain))]  # noqa: E731
    monkeypatch.setattr(module, "_refitted", lambda *given: tried.append(given[1].name) or again(*given))
    candidates = module._weighed
    monkeypatch.setattr(module, "_weighed", lambda at: candidates(at) if names_of(at.fitted) == ["nonlinear_reading"] else [])
    monkeypatch.setattr(module, "score_all", lambda at, among, terms: dataclasses.replace(scores, fitted=at))
    monkeypatch.setattr(module, "without", lambda final, name: (name, None))
    kept = {first: "nonlinear_reading", "nonlinear_reading": next(iter(others), "")}
    left = {first: -80.0, "nonlinear_reading": -900.0}
    monkeypatch.setattr(module, "refitted", lambda problem, near, beside, progress: fitted(scores, kept[problem], deviance=left[problem]))
    both = fitted(scores, first, "nonlinear_reading", deviance=-980.0)
    steps = (
        Step(scores=scores, alternatives=(alternative(first, 900.0, fitted(scores, first)),)),
        Step(scores=scores, alternatives=(alternative("nonlinear_reading", 80.0, both),)),
    )
    found = Search(nominal=scores.fitted, final=both, steps=steps, last=None, finished=True)
    found = module._needed(found, EFFECTS, (), refusing(*refused), lambda line: None)
    expected = ["nonlinear_reading", *others] if exchanged else [first, "nonlinear_reading"]
    assert sorted(names(found)) == sorted(expected)
    assert [step.alternatives[0].name for step in found.steps] == expected
    assert tried[:1] == [name for name, gain in others.items() if gain > 0.5 * 900.0 or refused]
    assert [one.name for one in diagnose._twins(found.steps[0])] == [name for name, gain in others.items() if gain == 890.0]


@pytest.mark.parametrize(("gain", "first"), [(895.0, "reading_tone"), (700.0, "tonal_force")])
def test_a_listed_effect_stands_before_a_free_form_that_says_no_more(scores, gain, first):
    both = [alternative("reading_tone", gain, scores.fitted), alternative("reading_tone", 900.0, scores.fitted)]
    both[1] = dataclasses.replace(both[1], candidate=a_free_form())
    assert [one.name for one in module._ranked(both, 1000)][0] == first


def test_the_best_is_asked_and_what_chance_could_have_put_first(scores, weighed):
    weighed(second_mode=900.0, coulomb_friction=890.0, quadratic_drag=700.0)
    judge = refusing()
    module._step(scores, module._weighed(scores), judge, lambda line: None)
    assert judge.asked == ["second_mode", "coulomb_friction"]


def test_all_listed_effects_are_looked_for_unless_limited():
    assert among_effects() == tuple(EFFECTS)
    assert limit_warning(EFFECTS) == ()
    assert limit_warning(("hysteresis",)) == ("limited on request: of the listed effects, only hysteresis could be named",)
    assert limit_warning(among_effects(without=["hysteresis"])) == (
        "limited on request: of the listed effects, hysteresis could not be named",
    )


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"only": ["hysteresis"], "without": ["hysteresis"]}, "no effect is left to look for"),
        ({"only": ["Stiction, I think"]}, "expected one of coulomb_friction.*asymmetric_damping"),
        ({"without": ["histeresis"]}, "did you mean 'hysteresis'"),
        ({"only": "hysteresis"}, r"expected a list of names of effects, such as \['hysteresis'\]"),
    ],
)
def test_names_that_are_none_are_refused(given, expected):
    with pytest.raises(InputError, match=expected):
        among_effects(**given)


def test_a_special_case_is_fitted_however_far_its_first_order_is_below(scores, weighed):
    tried = weighed(power_law_damping=900.0, second_mode=300.0, coulomb_friction=200.0)
    module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert tried == ["power_law_damping", "coulomb_friction"]


@pytest.mark.parametrize(
    ("alone", "spent", "left", "finished"),
    [("", False, 1, True), ("no", False, 2, True), ("", True, 2, False)],
    ids=["the first is asserted alone", "nor is the first", "no time to see"],
)
def test_a_last_effect_that_is_not_asserted_leaves_the_model(scores, monkeypatch, alone, spent, left, finished):
    first, both = fitted(scores, "coulomb_friction"), fitted(scores, "coulomb_friction", "gap_drift")
    steps = (
        Step(scores=scores, alternatives=(alternative("coulomb_friction", 900.0, first),)),
        Step(scores=dataclasses.replace(scores, fitted=first), alternatives=(alternative("gap_drift", 80.0, both),)),
    )
    found = Search(nominal=scores.fitted, final=both, steps=steps, last=None, finished=True)

    def weigh(found: Search, last, judge, progress) -> diagnose._Weighed:
        if len(found.steps) == 1:
            progress("a round of a fit")
        reasons = {"coulomb_friction": "", "gap_drift": "no"} if len(found.steps) == 2 else {"coulomb_friction": alone}
        return diagnose._Weighed(search=found, left=(), forms=1, form=None, reasons=reasons)

    monkeypatch.setattr(diagnose, "_weigh", weigh)
    course = diagnose._Course(0.0 if spent else 10.0, lambda line: None)
    kept = diagnose._supported(found, scores, None, course).search
    assert kept.finished == finished
    assert names(kept) == ["coulomb_friction", "gap_drift"][:left]


def test_candidates_that_are_weighed_side_by_side_keep_their_places(scores, monkeypatch):
    def one(at, candidate):
        if candidate == 3:
            raise np.linalg.LinAlgError
        return at, candidate

    monkeypatch.setattr(scores_module, "weighed_anew", one)
    assert scores_module.all_weighed_anew(scores, range(9)) == [None if each == 3 else (scores, each) for each in range(9)]


def test_a_channel_that_reads_little_but_noise_hides_no_order(scores):
    chains = scores.fitted.problem.chains
    noise = np.random.default_rng(0).standard_normal(chains.weight.shape)
    quiet = dataclasses.replace(chains, measured=noise / np.maximum(chains.weight, 1e-300))
    beside = dataclasses.replace(scores.fitted, problem=dataclasses.replace(scores.fitted.problem, chains=quiet))

    def hides(times: float) -> bool:
        readings = tuple(ReadingError(innovation=times) for _ in chains.channels)
        return module.hides_the_order(beside, dataclasses.replace(scores.fitted.variances, readings=readings))

    assert not hides(1.1) and hides(2.0)


def test_what_the_records_show_without_a_model_is_weighed_where_scores_do_not_order(scores):
    """Stops of a model without one, whatever their score, and what makes late the channel that is."""
    prompt, late = (TimeOffset(delay=1e-4, of_channel=channel) for channel in ("hammer_acceleration", "impact_force"))
    members = (at_start(EFFECTS["coulomb_friction"]), prompt, late, at_start(EFFECTS["missing_stop"]))
    listed = tuple(
        Scored(
            candidate=Candidate(name=one.name, members=(one,), signals=()),
            gain=gain,
            strengths=np.ones(1),
            known=np.ones(1, bool),
        )
        for one, gain in zip(members, (900.0, 800.0, 3.0, 0.0), strict=True)
    )
    problem = dataclasses.replace(scores.fitted.problem, model=dataclasses.replace(scores.fitted.problem.model, law=NoContact()))
    scales = dataclasses.replace(scores.scales, lags={"impact_force": 8e-3})

    def chosen(part: float) -> list[AbstractEffect]:
        variances = dataclasses.replace(scores.fitted.variances, force=RandomForce(std=part * problem.scales.force, memory=0.01))
        beside = dataclasses.replace(scores.fitted, problem=problem, variances=variances)
        return [
            one.candidate.members[0] for one in module._shortlist(dataclasses.replace(scores, fitted=beside, scales=scales, listed=listed))
        ]

    assert chosen(0.5 * LARGE_PART) == [members[0], prompt]
    assert chosen(2.0 * LARGE_PART) == [members[0], prompt, late, members[3]]


def test_what_the_records_show_without_a_model_is_fitted_first_where_scores_do_not_order(scores, weighed, monkeypatch):
    monkeypatch.setattr(module, "_is_shown", lambda at, candidate: candidate.name == "time_offset")
    tried = weighed(second_mode=900.0, time_offset=0.0)
    module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert tried == ["second_mode"]
    monkeypatch.setattr(module, "hides_the_order", lambda *given: True)
    tried.clear()
    module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert tried == ["time_offset", "second_mode"]


@pytest.mark.parametrize(("size", "drop"), [(0.1, 40.0), (1.0, 0.0)])
def test_what_only_the_random_force_explains_is_no_gain(scores, monkeypatch, size, drop):
    largest = RandomForce(std=size * LARGEST_FORCE * scores.fitted.problem.scales.force, memory=0.01)
    variances = dataclasses.replace(scores.fitted.variances, force=largest)
    found = dataclasses.replace(fitted(scores, deviance=-40.0), variances=variances)
    monkeypatch.setattr(module, "augmented", lambda *of, progress: found)
    (one,) = module._refitted(
        dataclasses.replace(scores, fitted=fitted(scores)), alternative("quadratic_drag", 30.0), None, lambda line: None
    )
    assert one.drop == pytest.approx(drop)


def test_what_the_records_show_is_fitted_even_where_it_takes_the_motion_too_far_at_first_order(scores, monkeypatch):
    listed = [
        Scored(candidate=alternative(n, 0.0).candidate, gain=9.0, strengths=np.ones(1), known=np.ones(1, bool))
        for n in ("time_offset", "second_mode")
    ]
    monkeypatch.setattr(module, "_is_shown", lambda at, candidate: candidate.name == "time_offset")
    monkeypatch.setattr(module, "_shortlist", lambda at: listed)
    monkeypatch.setattr(module, "all_weighed_anew", lambda at, shortlist: [None for _ in shortlist])
    assert [one.name for one, _ in module._weighed(scores)] == ["time_offset"]


def test_beside_one_that_brings_scores_into_order_its_rivals_at_first_order_are_fitted(scores, weighed, monkeypatch):
    hidden = iter([True, False])
    monkeypatch.setattr(module, "hides_the_order", lambda *given: next(hidden, False))
    tried = weighed(zero_drift=900.0, gap_drift=800.0, gap_step=300.0)
    refitted = module._refitted
    more = lambda *given: [dataclasses.replace(one, drop=9e4) for one in refitted(*given)]  # noqa: E731
    monkeypatch.setattr(module, "_refitted", more)
    module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert tried == ["zero_drift", "gap_drift"]


def test_a_stop_without_gain_is_left_where_another_effect_brings_scores_into_order(scores, weighed, monkeypatch):
    hidden = iter([True, False])
    monkeypatch.setattr(module, "hides_the_order", lambda *given: next(hidden, False))
    tried = weighed(second_mode=900.0, back_stop=-0.1)
    step = module._step(scores, module._weighed(scores), refusing("second_mode"), lambda line: None)
    assert (tried, step.finished) == (["second_mode"], True)


def test_of_two_channels_that_the_records_show_apart_either_is_fitted_as_the_late_one(scores, weighed, monkeypatch):
    """By the same effect: where a delay of the one explains all, a drift of the other is not asked."""
    tried = weighed(time_offset=900.0, clock_drift=300.0)
    (first, anew), (drift, _) = module._weighed(scores)
    other = dataclasses.replace(
        first, gain=300.0, candidate=dataclasses.replace(first.candidate, members=(TimeOffset(1e-3, "impact_force"),))
    )
    monkeypatch.setattr(module, "is_shown_late", lambda at, candidate: True)
    module._step(scores, [(first, anew), (drift, anew), (other, anew)], refusing(), lambda line: None)
    assert tried == ["time_offset", "time_offset"]


def test_of_what_makes_a_channel_late_the_one_that_brings_channels_together_is_fitted_first(scores, weighed, monkeypatch):
    tried = weighed(clock_drift=900.0, time_offset=300.0)
    monkeypatch.setattr(module, "hides_the_order", lambda *given: True)
    monkeypatch.setattr(module, "_is_shown", lambda at, candidate: True)
    monkeypatch.setattr(module, "misalignment_of", lambda at, candidate: -50.0 if candidate.name == "time_offset" else -20.0)
    module._step(scores, module._weighed(scores), refusing(), lambda line: None)
    assert tried == ["time_offset", "clock_drift"]
