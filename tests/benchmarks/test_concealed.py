import json
import sys
import types

import numpy as np
import pytest

from benchmarks.concealed import __main__ as command
from benchmarks.concealed.jobs import Draw, jobs
from benchmarks.concealed.outcome import outcome
from benchmarks.concealed.prediction import displacement_error, impact_peaks, peak_error, sealed_errors
from benchmarks.concealed.summary import null_gains, summary
from benchmarks.concealed.table import effects_table, methods_table, time_table, verdicts_table
from benchmarks.concealed.trial import BASELINES, trial, unanswered, written
from benchmarks.simulator import LISTED, UNLISTED, Order, draw_case, write_case
from benchmarks.simulator.case import WITHOUT, truth
from identification.experiment import load_experiment
from identification.guesses.declared_model import nominal_model

SMALL = (801, 1201)


def said(verdict, *effects, twins=(), after=0.1, before=1.0, location=None):
    sealed = {"largest_gain": None}
    sealed |= {"sealed_nominal": {"displacement": before, "peaks": before}, "sealed_augmented": {"displacement": after, "peaks": after}}
    return {"verdict": verdict, "effects": list(effects), "ambiguous_with": list(twins), "location": location or {}} | sealed


def case(key, group, truth, diagnosis, *, strength=1.0, bic=None, **more):
    effects = [{"name": name, "strength": strength} for name in truth]
    found = {"key": key, "group": group, "effects": effects, "where": None, "kind": "soft", "noise": 1.0, "channels": "all", "driven": 3}
    found |= {"seconds": 2.0, "cpu_seconds": 3.0} | more
    found |= {"failure": diagnosis} if isinstance(diagnosis, str) else {"diagnosis": diagnosis}
    return found | ({"baselines": {"bic": {"name": bic}}} if bic is not None else {})


TRIALS = [
    case("null-0", "null", (), said("adequate"), bic=[]),
    case("null-1", "null", (), said("missing", "force_lag"), bic=["unlisted"]),
    case("null-2", "null", (), "ValueError: no"),
    case("a", "listed", ("back_stop",), said("missing", "back_stop", "mains_hum"), strength=0.5, bic=["back_stop", "unlisted"]),
    case("b", "listed", ("back_stop",), said("missing", "gap_drift", twins=["back_stop"], after=0.3), bic=["unlisted", "back_stop"]),
    case("c", "listed", ("gap_drift",), said("unlisted", after=0.5), bic=[]),
    case("d", "listed", ("gap_drift",), "RuntimeError: bad", bic=["gap_drift"]),
    case("e", "off-list", ("x_magnet",), said("unlisted"), bic=["unlisted"]),
    case("f", "off-list", ("x_knocks",), said("missing", "gap_drift"), bic=[]),
    case("g", "pair", ("gap_drift", "hysteresis"), said("missing", "hysteresis", "gap_drift"), bic=["hysteresis"]),
    case("h", "weak", ("gap_drift",), said("adequate"), strength=0.1),
]


def test_shares_are_those_of_the_contract():
    result = summary(TRIALS)
    assert result["false_alarm"]["count"] == 1
    assert result["false_alarm"]["of"] == 2
    low, high = result["false_alarm"]["ci95"]
    assert low < 0.5 < high
    assert result["named"] == pytest.approx(1 / 4)
    assert result["named_or_twin"] == pytest.approx(2 / 4)
    assert result["named_alone"] == 0.0
    assert result["unlisted"] == pytest.approx(1 / 2)
    assert result["confusion"]["none"] == {"adequate": 1, "force_lag": 1, "failure": 1}
    assert result["confusion"]["gap_drift"] == {"unlisted": 1, "failure": 1}
    assert result["confusion"]["x_knocks"] == {"gap_drift": 1}
    assert result["held_out_ratio"] == pytest.approx(0.2)
    assert result["seconds_per_case"] == 2.0
    assert result["failures"] == {"null-2": "ValueError: no", "d": "RuntimeError: bad"}
    assert result["pairs"] == {"of": 1, "both": 1.0, "one": 1.0}
    assert (result["pairs_alone"]["count"], result["pairs_alone"]["of"]) == (1, 1)


def test_names_of_what_is_not_there_are_counted_in_all_cases_with_a_verdict():
    wrong = summary(TRIALS)["wrong_names"]
    assert (wrong["count"], wrong["of"]) == (4, 9)
    low, high = wrong["ci95"]
    assert low < 4 / 9 < high


def test_undecided_is_neither_a_false_alarm_nor_a_wrong_name():
    found = summary([*TRIALS, case("null-3", "null", (), said("undecided"))])
    assert (found["false_alarm"]["count"], found["false_alarm"]["of"], found["wrong_names"]["of"]) == (1, 2, 9)


def test_gains_on_complete_rigs_are_kept_for_the_level():
    rigs = [case(f"null-{k}", "null", (), said("adequate") | {"largest_gain": gain}) for k, gain in enumerate((9.0, 14.0, None))]
    assert null_gains([*rigs, case("a", "listed", ("gap_drift",), said("missing") | {"largest_gain": 400.0})]) == [14.0, 9.0]


def test_each_verdict_is_counted():
    nothing = dict.fromkeys(("adequate", "restless", "unlisted", "missing", "undecided", "failure"), 0)
    more = case("i", "pair", ("gap_drift", "hysteresis"), said("restless")), case("null-3", "null", (), said("undecided"))
    found = summary([*TRIALS, *more])["verdicts"]
    assert found["null"] == nothing | {"adequate": 1, "missing": 1, "undecided": 1, "failure": 1}
    assert found["listed"] == nothing | {"missing": 2, "unlisted": 1, "failure": 1}
    assert found["off-list"] == nothing | {"missing": 1, "unlisted": 1}
    assert found["pair"] == nothing | {"missing": 1, "restless": 1}
    assert found["weak"] == nothing | {"adequate": 1}


@pytest.mark.parametrize("unrest", ["unrest", "colour", "scatter", None])
def test_restless_is_right_on_a_rig_that_is_so(unrest):
    rig = {name: 0.01 if name == unrest else None for name in ("unrest", "corner", "colour", "scatter")}
    found = [
        case("null-0", "null", (), said("restless"), **rig),
        case("null-1", "null", (), said("adequate"), **rig),
        case("null-2", "null", (), said("unlisted"), **rig),
        case("a", "off-list", ("x_magnet",), said("restless"), **rig),
        case("b", "off-list", ("x_magnet",), said("unlisted"), **rig),
        case("c", "off-list", ("x_magnet",), said("missing", "back_stop"), **rig),
        case("d", "off-list", ("x_magnet",), said("unlisted", "back_stop"), **rig),
        case("e", "listed", ("back_stop",), said("restless"), **rig),
    ]
    result, right = summary(found), unrest is not None
    assert (result["false_alarm"]["count"], result["false_alarm"]["of"]) == (1 if right else 2, 3)
    assert (result["unlisted_counts"]["count"], result["unlisted_counts"]["of"]) == (2 if right else 1, 4)
    assert result["detail"]["off_list"]["x_magnet"]["refrained"] == result["unlisted"] == (0.5 if right else 0.25)
    assert (result["wrong_names"]["count"], result["wrong_names"]["of"]) == (2, 8)
    assert result["confusion"]["none"] == {"restless": 1, "adequate": 1, "unlisted": 1}
    assert result["named"] == 0.0


def test_detail_tells_strength_and_effect():
    detail = summary(TRIALS)["detail"]
    assert detail["effect"]["back_stop"]["of"] == 2
    assert detail["effect"]["back_stop"]["named"] == 0.5
    shares = dict.fromkeys(("detected", "named", "named_or_twin", "unlisted", "refrained"), 0.0)
    assert detail["strength"]["0 to 0.4"] == {"of": 1} | shares
    assert detail["strength"]["0.4 to 0.7"]["named"] == 1.0
    assert detail["weak"]["0.1"]["detected"] == 0.0


def test_baselines_are_judged_as_the_program_is():
    bic = summary(TRIALS)["baselines"]["bic"]
    assert (bic["false_alarm"]["count"], bic["false_alarm"]["of"]) == (1, 2)
    assert bic["named"] == pytest.approx(2 / 4)
    assert bic["named_alone"] == pytest.approx(2 / 4)
    assert bic["unlisted"] == pytest.approx(1 / 2)
    assert bic["pairs"]["both"] == 0.0


def test_a_baseline_that_failed_named_nothing():
    broken = case("x", "listed", ("drag",), said("missing", "drag")) | {"baselines": {"bic": {"failure": "KeyError: 'x'"}}}
    assert outcome(broken, "bic").claim == "failure"


def test_a_baseline_that_failed_is_reported_and_asked_again():
    broken = case("x", "listed", ("drag",), said("missing", "drag")) | {
        "baselines": {"bic": {"name": []}, "sindy": {"failure": "no pysindy"}}
    }
    assert summary([broken])["failures"] == {"x, sindy": "no pysindy"}
    assert unanswered(["bic", "sindy"], broken) == ["sindy"]
    assert unanswered(["bic"], broken) == []


@pytest.mark.parametrize(("truth", "asked"), [((), ["grey_box"]), (("quadratic_drag",), ["grey_box"]), (("force_lag",), [])])
def test_a_model_of_flights_is_asked_of_what_acts_there(truth, asked):
    assert unanswered(["grey_box"], case("x", "listed", truth, said("adequate"))) == asked


def test_a_case_with_another_budget_is_another_case():
    (job,) = jobs(Draw(null=1))
    done = {job.key: {"job": json.loads(json.dumps(job.settings)), "budget_minutes": 5.0}}
    assert command.is_done(job, done, 5.0)
    assert not command.is_done(job, done, 2.0)
    assert not command.is_done(job, {job.key: done[job.key] | {"failure": "x"}}, 5.0)


def test_jump_is_located():
    place = {"record": "cart2.csv", "time": 1.31}
    where = {"record": "cart2.csv", "time": 1.30}
    found = case("j", "listed", ("gap_step",), said("missing", "gap_step", location=place), where=where)
    other = case("k", "listed", ("gap_step",), said("missing", "gap_step", location={"record": "cart1.csv", "time": 1.0}), where=where)
    late = pytest.approx(0.01)
    assert summary([found, other])["gap_step_located"] == {"of": 2, "record": 1, "time_error_median": late, "time_error_most": late}


def test_time_is_stated_by_group():
    slow = case("s", "pair", ("drag", "friction"), said("unlisted"), seconds=181.0, cpu_seconds=200.0)
    quick = case("t", "pair", ("drag", "friction"), said("unlisted"), seconds=20.0, cpu_seconds=30.0)
    result = summary([slow, quick, case("u", "pair", ("drag", "friction"), "ValueError: no")])
    assert result["time"] == {"pair": {"of": 2, "cpu_median": 115.0, "longest": 181.0, "over_limit": 1}}
    assert time_table(result).row_count == 1


def test_nothing_drawn_is_no_figure():
    result = summary([])
    assert result["false_alarm"] == {"count": 0, "of": 0, "ci95": None}
    assert result["named"] is None
    assert result["held_out_ratio"] is None
    json.dumps(result)


def test_tables_hold_every_truth_and_method():
    result = summary(TRIALS)
    assert effects_table(result).row_count == len(result["confusion"])
    assert methods_table(result).row_count == 2
    assert verdicts_table(result).row_count == 5


def test_jobs_cover_what_is_asked_for():
    drawn = jobs(Draw(null=4, per_effect=2, off_list=1, pairs=3, weak=(0.1, 0.2), noise=(1.0, 4.0), driven=(3, 1)))
    groups = [job.group for job in drawn]
    counts = {group: groups.count(group) for group in dict.fromkeys(groups)}
    assert counts == {"null": 4, "listed": 2 * len(LISTED), "off-list": len(UNLISTED), "weak": 4 * len(LISTED), "pair": 3}
    assert len({job.key for job in drawn}) == len({job.seed for job in drawn}) == len(drawn)
    assert {job.order.kind for job in drawn if job.group == "null"} == {"soft", "stiff"}
    assert all(0.4 <= job.order.effects[0][1] <= 1.3 for job in drawn if job.group == "listed")
    assert {job.order.noise for job in drawn} == {1.0, 4.0}
    assert {job.order.driven for job in drawn} == {1, 3}
    for job in drawn:
        if job.order.effects and job.order.effects[0][0] in ("force_lag", "force_clipping"):
            assert "impact_force" not in WITHOUT[job.order.channels]


def test_a_case_does_not_depend_on_what_else_is_drawn():
    few, many = (jobs(Draw(null=count, per_effect=1, effects=names)) for count, names in ((1, ("gap_drift",)), (5, tuple(LISTED))))
    assert few[0] == many[0]
    assert next(job for job in many if job.key == few[1].key).seed == few[1].seed


def test_unrest_acts_in_every_case_and_leaves_the_rest_as_it_is():
    quiet, restless = (jobs(Draw(null=2, per_effect=1, unrest=unrest)) for unrest in ((), ("scatter", "force", "force")))
    assert {job.order.unrest for job in restless} == {("force", "scatter")}
    assert [(job.key, job.seed) for job in quiet] == [(job.key, job.seed) for job in restless]
    assert all("unrest" not in job.settings["order"] for job in quiet)
    assert all(job.settings["order"]["unrest"] == ("force", "scatter") for job in restless)


def test_series_share_no_seed():
    seeds = [{job.seed for job in jobs(Draw(null=9, per_effect=1, series=series, seed=3))} for series in ("calibration", "published")]
    assert not seeds[0] & seeds[1]


def test_peaks_of_impacts():
    force = np.array([0.0, 2.0, 5.0, 1.0, 0.0, 0.0, 3.0, 0.0])
    np.testing.assert_array_equal(impact_peaks(force, 0.5), [5.0, 3.0])
    assert peak_error(force, force) == 0.0
    assert peak_error(np.roll(force, 1), force) == 0.0
    assert peak_error(np.zeros(8), force) == pytest.approx(1.0)
    assert peak_error(np.full(8, np.nan), force) == 1.0
    assert displacement_error(np.full(8, np.nan), force) == 10.0


class FakeResult:
    """Claims that a force lags; both its models are the nominal one."""

    def __init__(self, experiment):
        self.nominal_model = self.model = nominal_model(experiment, None)

    def document(self):
        effects = [{"name": "force_lag", "probability": 0.8, "parameters": {}}]
        scores = {"chi2_reduced": 2.0, "held_out_nrmse": 0.1}
        return {
            "verdict": "missing",
            "effects": effects,
            "ambiguous_with": ["gain_error"],
            "location": {"time": None},
            "warnings": [],
            "considered": [{"drop": 31.0}, {"drop": 4.0}, {"drop": None}],
            "nominal": scores,
            "augmented": scores,
        }


@pytest.fixture
def program(monkeypatch):
    asked = []

    def diagnose_experiment(experiment, *, budget_minutes):
        asked.append((experiment, budget_minutes))
        return FakeResult(experiment)

    module = types.ModuleType("identification.diagnosis.diagnose")
    module.diagnose_experiment = diagnose_experiment
    monkeypatch.setitem(sys.modules, "identification.diagnosis.diagnose", module)
    return asked


def test_trial_asks_the_program_and_scores_sealed_records(program):
    job = next(job for job in jobs(Draw(per_effect=1, samples=SMALL)) if job.order.effects[0][0] == "force_lag")
    found = json.loads(json.dumps(trial(job, budget_minutes=2.0, baselines=["bic", "sindy", "grey_box"])))
    ((experiment, budget),) = program
    assert budget == 2.0
    assert [record.stem for record in experiment.records] == ["drop", "cart1", "cart2", "cart3"]
    assert outcome(found).named
    assert 0.0 < found["diagnosis"]["sealed_nominal"]["displacement"] < 10.0
    assert found["diagnosis"]["largest_gain"] == 31.0
    assert found["effects"][0]["faults"][0]["kind"] == "LowPass"
    assert set(found["baselines"]) == {"bic", "sindy"}


def test_a_trial_keeps_what_unrest_was_drawn(program):
    (job,) = jobs(Draw(null=1, samples=SMALL, unrest=("force", "scatter")))
    found = json.loads(json.dumps(trial(job, baselines=())))
    known = truth(draw_case(job.rng(), job.order))
    assert 0.002 <= found["unrest"] <= 0.02 and 0.001 <= found["scatter"] <= 0.005
    assert {name: found[name] for name in ("unrest", "corner", "colour", "scatter")} == {
        name: known[name] for name in ("unrest", "corner", "colour", "scatter")
    }
    assert found["colour"] is None
    assert outcome(found).unrest
    assert not outcome(json.loads(json.dumps(trial(jobs(Draw(null=1, samples=SMALL))[0], baselines=())))).unrest


def test_a_case_whose_hammer_runs_away_is_drawn_anew(tmp_path, monkeypatch):
    def fails_once(rng, order):
        drawn.append(rng.bit_generator.state["state"]["state"])
        if len(drawn) == 1:
            raise ArithmeticError("the hammer runs away")
        return draw_case(rng, order)

    drawn = []
    monkeypatch.setattr("benchmarks.concealed.trial.draw_case", fails_once)
    written(jobs(Draw(null=1, samples=SMALL))[0], tmp_path / "rig")
    assert len(set(drawn)) == 2
    assert (tmp_path / "rig" / "experiment.toml").exists()


def test_a_failure_is_reported(program, monkeypatch):
    def broken(experiment, *, budget_minutes):
        raise RuntimeError("no convergence")

    monkeypatch.setattr(sys.modules["identification.diagnosis.diagnose"], "diagnose_experiment", broken)
    found = trial(jobs(Draw(null=1, samples=SMALL))[0], baselines=())
    assert found["failure"] == "RuntimeError: no convergence"
    assert outcome(found).claim == "failure"


def test_the_true_model_predicts_sealed_records_and_what_does_not_run_predicts_nothing(tmp_path):
    rng = np.random.default_rng(2)
    drawn = draw_case(rng, Order(kind="soft", samples=SMALL))
    sealed = load_experiment(write_case(tmp_path / "x", drawn, rng))
    right = sealed_errors(nominal_model(sealed, None).replace(drawn.rig.fitted), sealed)
    assert right["displacement"] < 1e-4
    assert right["peaks"] < 1e-3
    errors = sealed_errors(None, sealed)
    assert errors["displacement"] == errors["peaks"] == 1.0
    assert len(errors["failures"]) == 2


def test_resuming_keeps_what_is_done_and_repeats_failures(tmp_path, monkeypatch, capsys):
    def fake_run(what, trial, wanted, lines, *, workers):
        ran.append([job.key for job in wanted])
        with lines.open("a", encoding="utf-8") as file:
            for number, job in enumerate(wanted):
                one = case(job.key, job.group, [name for name, _ in job.order.effects], "Error: x" if number else said("adequate"))
                file.write(json.dumps(one | {"job": job.settings}) + "\n")

    ran = []
    monkeypatch.setattr(command, "run_trials", fake_run)
    for arguments in (["--null", "2"], ["--null", "3", "--resume"], ["--null", "1", "--resume", "--noise", "2"]):
        monkeypatch.setattr(sys, "argv", ["concealed", *arguments, "--no-baselines", "--json", str(tmp_path / "x.json")])
        command.main()
    assert ran == [["null-0000", "null-0001"], ["null-0001", "null-0002"], ["null-0000"]]
    result = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert result["false_alarm"]["of"] == 1
    assert (result["settings"]["noise"], result["settings"]["unrest"]) == ([2.0], [])
    capsys.readouterr()


def test_resuming_adds_the_baselines_that_were_left_out(program, tmp_path, monkeypatch, capsys):
    def in_this_process(what, trial, wanted, lines, *, workers):
        ran[what] = len(wanted)
        with lines.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(trial(one)) + "\n" for one in wanted)

    ran = {}
    monkeypatch.setattr(command, "run_trials", in_this_process)
    monkeypatch.setitem(BASELINES, "bic", lambda folder: [])
    monkeypatch.setitem(BASELINES, "sindy", lambda folder: ["drag"])
    for arguments in (["--no-baselines"], ["--resume"], ["--resume"]):
        monkeypatch.setattr(sys, "argv", ["concealed", "--null", "1", "--json", str(tmp_path / "x.json"), *arguments])
        command.main()
        found = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
        assert set(found["baselines"]) == (set() if arguments == ["--no-baselines"] else {"bic", "sindy"})
    assert len(program) == 1
    assert ran == {"cases": 0, "baselines": 1}
    capsys.readouterr()
