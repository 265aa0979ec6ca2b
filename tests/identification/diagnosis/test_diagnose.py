"""The whole way from records to a verdict; what was concealed was made by a simulator that shares no line with the program."""

import dataclasses
import functools
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from identification.diagnosis.free_form.free_form import Learned
from identification.diagnosis.held_out import Predictions
from identification.diagnosis.score.scored import Scored
from identification.diagnosis.search.forward import Search

from benchmarks.simulator import Case, Order, draw_case, write_case
from identification.diagnosis import diagnose
from identification.diagnosis.diagnose import diagnose_experiment
from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNLISTED, Diagnosis
from identification.experiment import Experiment, load_experiment
from identification.likelihood.fitted import Fitted
from identification.likelihood.joint import Point
from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import Grams
from identification.windows.prepare import Prepared
from tests.identification.conftest import cropped
from vibrojax.cli import main
from vibrojax.effects import CoulombFriction
from vibrojax.model import Model
from vibrojax.model_file import read_model

SMALL = Order(kind="soft", driven=1, samples=(1601, 4001))
"""A drop test and one driven record of a random rig."""
ORDERS = {
    ADEQUATE: SMALL,
    MISSING: dataclasses.replace(SMALL, effects=(("coulomb_friction", 1.0),), unrest=("force", "colour")),
    UNLISTED: dataclasses.replace(SMALL, samples=(801, 2001), effects=(("x_position_damping", 2.0),)),
}


@dataclasses.dataclass(frozen=True)
class Diagnosed:
    """What a rig conceals, what is said of it, and the folder of results."""

    case: Case
    found: Diagnosis
    folder: Path


def command(*arguments: str | Path) -> None:
    """`vibrojax` in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["vibrojax", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main.main()
    assert ended.value.code == 0


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """A complete rig, one with a listed effect, and one with an effect that is on no list: each diagnosed once, by the command."""

    @functools.cache
    def once(verdict: str) -> Diagnosed:
        folder, rng, kept = tmp_path_factory.mktemp(verdict), np.random.default_rng(1), []
        case = draw_case(rng, ORDERS[verdict])
        write_case(folder / "rig", case, rng)

        def keeping(*given, **options):
            kept.append(diagnose_experiment(*given, **options))
            return kept[0]

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("identification.commands.run.diagnose_experiment", keeping)
            command("diagnose", folder / "rig", "--out", folder / "results", "--budget-minutes", "inf", "--quiet")
        return Diagnosed(case, kept[0], folder / "results")

    return once


def assert_recovered(found: Diagnosis, case: Case) -> None:
    """The parameters of the nominal model, each within four standard errors."""
    numbers = {p.name: p for p in found.augmented.parameters if p.name in case.rig.fitted}
    assert set(numbers) == {"k_i", "n", "lambda_i", "zeta", "f_n"}
    for name, one in numbers.items():
        assert one.stderr is not None and abs(one.value - case.rig.fitted[name]) < 4.0 * one.stderr, name


def test_nothing_is_claimed_missing_from_a_complete_quiet_rig(diagnosed):
    found = diagnosed(ADEQUATE).found
    assert (found.verdict, found.effects, found.unrest, found.location) == (ADEQUATE, (), None, None)
    assert "Nothing beyond the noise" in found.sentences[0]
    assert found.model is found.nominal_model
    assert found.warnings == ()
    assert found.nominal.chi2_reduced == pytest.approx(1.0, abs=0.05)
    assert_recovered(found, diagnosed(ADEQUATE).case)


def test_dry_friction_is_named_alone_under_random_force_and_coloured_noise(diagnosed):
    found, case = diagnosed(MISSING).found, diagnosed(MISSING).case
    assert (found.verdict, [one.effect.name for one in found.effects]) == (MISSING, ["coulomb_friction"])
    assert found.ambiguous_with == ()
    assert found.effects[0].probability > 0.99
    (friction,) = found.effects[0].parameters
    true = case.parts[0].numbers()["motion"]["friction_force"]
    assert friction.stderr is not None and abs(friction.value - true) < 4.0 * friction.stderr
    assert_recovered(found, case)
    assert found.location is not None
    assert (found.location.phase, found.location.coordinate) == ("free flight", "velocity")
    assert found.augmented.held_out_nrmse < 0.5 * found.nominal.held_out_nrmse


def test_a_damping_that_is_on_no_list_is_given_no_name_and_learned(diagnosed):
    found, case = diagnosed(UNLISTED).found, diagnosed(UNLISTED).case
    assert (found.verdict, found.effects) == (UNLISTED, ())
    assert found.location is not None and found.location.phase == "free flight"
    learned = re.fullmatch(r"force = -([0-9.]+)\([0-9]+\) N s/m\^2 \|u\| u'", found.free_form)
    assert learned is not None
    assert float(learned.group(1)) == pytest.approx(case.parts[0].numbers()["motion"]["position_damping"], rel=0.05)
    assert found.augmented.chi2_reduced < 1.1 < 2.0 < found.nominal.chi2_reduced


@pytest.mark.parametrize("verdict", ORDERS)
def test_files_say_what_was_found_and_the_page_is_drawn_again_from_them(diagnosed, verdict, tmp_path):
    found, folder = diagnosed(verdict).found, diagnosed(verdict).folder
    document = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    names = [one.effect.name for one in found.effects]
    assert (document["verdict"], [one["name"] for one in document["effects"]]) == (verdict, names)
    assert document["nominal"]["chi2_reduced"] == found.nominal.chi2_reduced
    assert document["files"].keys() == {path.name for path in folder.iterdir()} - {"diagnosis.json"}
    for file, model in (("nominal.json", found.nominal_model), ("model.json", found.model)):
        assert read_model(folder / file).values() == pytest.approx(model.values())
    command("report", folder, "--out", tmp_path / "page", "--quiet")
    drawn = sorted((tmp_path / "page").iterdir())
    assert {"report.html"} < {path.name for path in drawn}
    assert [path.name for path in drawn if path.read_bytes() != (folder / path.name).read_bytes()] == []


def test_a_complete_rig_under_a_random_force_is_restless(tmp_path):
    rng = np.random.default_rng(1)
    case = draw_case(rng, dataclasses.replace(SMALL, unrest=("force",)))
    write_case(tmp_path, case, rng)
    found = diagnose_experiment(load_experiment(tmp_path), budget_minutes=np.inf)
    assert (found.verdict, found.effects, found.location) == (RESTLESS, (), None)
    assert found.is_complete and found.model is found.nominal_model
    assert_recovered(found, case)
    assert found.unrest is not None and case.unrest.share is not None
    (rms, stderr), (memory, of_memory) = found.unrest.force_rms, found.unrest.memory
    true = case.unrest.share * case.rig.k * case.rig.base_amplitude
    assert stderr is not None and abs(rms - true) < 3.0 * stderr
    assert rms == pytest.approx(true, rel=0.3)
    assert found.unrest.share == pytest.approx(case.unrest.share, rel=0.3)
    assert of_memory is not None and abs(memory - 1.0 / (2.0 * np.pi * case.unrest.corner)) < 3.0 * of_memory
    assert "a random force acts on the hammer" in found.sentences[0]
    document = json.loads(json.dumps(found.document()))
    assert document["unrest"]["force_rms"] == {"value": rms, "stderr": stderr, "unit": "N"}


@pytest.mark.thorough
def test_nothing_is_claimed_missing_from_the_embedded_example(example):
    complete = diagnose_experiment(cropped(example, 4000, (0, 1, 2, 3)), budget_minutes=np.inf)
    assert (complete.verdict, complete.effects, complete.location) == (ADEQUATE, (), None)
    assert "Nothing beyond the noise" in complete.sentences[0]
    assert complete.model is complete.nominal_model
    document = json.loads(json.dumps(complete.document()))
    assert document["verdict"] == "adequate"
    assert document["nominal"]["chi2_reduced"] == pytest.approx(1.0, abs=0.02)


@pytest.mark.thorough
def test_a_sudden_change_of_the_gap_is_named_with_its_record_and_instant(shared):
    found = diagnose_experiment(load_experiment(shared / "concealed" / "case-01"), budget_minutes=np.inf)
    truth = json.loads((shared / "concealed" / "case-01" / "sealed" / "truth.json").read_text())
    assert found.verdict == MISSING
    assert found.effects[0].effect.name == "gap_step"
    assert found.location is not None
    assert found.location.record == truth["where"]["record"]
    assert found.location.time == pytest.approx(truth["where"]["time"], abs=0.05)
    values = {p.name: p.value for p in found.effects[0].parameters}
    assert values["gap_jump"] == pytest.approx(truth["numbers"]["gstep"], rel=0.02)
    assert found.augmented.held_out_nrmse < 0.5 * found.nominal.held_out_nrmse


@pytest.mark.thorough
def test_what_is_on_no_list_is_said_to_be_so_and_learned(shared):
    found = diagnose_experiment(load_experiment(shared / "concealed" / "case-11"), budget_minutes=np.inf)
    truth = json.loads((shared / "concealed" / "case-11" / "sealed" / "truth.json").read_text())
    assert found.verdict == UNLISTED
    assert found.effects == ()
    frequency = truth["numbers"]["wf"] / (2 * np.pi)
    learned = re.search(r"2 pi ([0-9.]+)", found.free_form)
    assert learned is not None
    assert float(learned.group(1)) == pytest.approx(frequency, abs=2e-3)
    assert found.augmented.chi2_reduced < 1.1


def bare(kind: type, **values):
    """An object of a class with some of its attributes and no others."""
    made = object.__new__(kind)
    for name, value in values.items():
        object.__setattr__(made, name, value)
    return made


@pytest.mark.parametrize(
    ("model_error", "term_error", "verdict"),
    [(0.10, 0.05, UNLISTED), (0.10, 0.0999, MISSING), (0.10, 0.12, MISSING), (float("nan"), float("nan"), UNLISTED)],
)
def test_a_term_that_predicts_nothing_hides_no_listed_effect(monkeypatch, model_error, term_error, verdict):
    monkeypatch.setattr(diagnose, "share_added", lambda *models: 0.5)
    predicted = Predictions(bare(Experiment, records=()))
    prepared = bare(Prepared, model=bare(Model, effects=(CoulombFriction(0.1),)))
    model, more = (bare(Fitted, point=bare(Point, prepared=prepared)) for _ in range(2))
    for fitted, error in ((model, model_error), (more, term_error)):
        predicted._windows[id(fitted)], predicted._records[id(fitted)] = (fitted, error), (fitted, ())
    found = bare(Search, steps=(), last=bare(Scored, fitted=model))
    cause = diagnose._cause(found, bare(Learned, fitted=more, formula="f"), predicted)
    assert (cause.verdict, cause.fitted is more, cause.formula) == (verdict, verdict == UNLISTED, "f" if verdict == UNLISTED else "")


@pytest.mark.thorough
def test_restitution_that_falls_with_speed_varies_between_records_of_one_impact(tmp_path):
    """Free riders whose restitution falls with speed, beside Newton's constant one."""
    t, gap, noise = np.arange(122) / 500.0, 0.01, 2e-5
    rng, head = np.random.default_rng(0), 'schema = 1\n[experiment]\nname = "riders"\n[hammer]\nmass = 0.15\n[suspension]\nkind = "free"\n'
    records = []
    for number, speed in enumerate((0.03, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)):
        after = 0.3 * (speed / 0.03) ** -0.5 * speed
        late = t - 0.1213
        x = gap + np.where(late < 0, speed * late, -after * late) + noise * rng.standard_normal(len(t))
        np.savetxt(tmp_path / f"{number}.csv", np.stack([t, x], axis=1), delimiter=",", header="t,x", comments="")
        records.append(
            f'[[record]]\nfile = "{number}.csv"\nkind = "drop-test"\ngap = {gap}\ncolumns = {{ time = "t", hammer_displacement = "x" }}\n'
        )
    sensor = f'[contact]\nlaw = "newton"\n[sensors.hammer_displacement]\nunit = "m"\nnoise = {noise}\n'
    (tmp_path / "experiment.toml").write_text(head + sensor + "".join(records))
    found = diagnose_experiment(load_experiment(tmp_path), budget_minutes=np.inf)
    assert (found.verdict, found.effects, found.nominal.varying) == (ADEQUATE, (), ("e",))
    assert found.sentences[0].startswith("With a separate value of e in each record, the nominal model explains the records to the noise")
    slow, fast = ((one, 0.3 * (speed / 0.03) ** -0.5) for one, speed in (("0.csv", 0.03), ("7.csv", 0.5)))
    (own,) = (one.records for one in found.nominal.disagreements)
    for file, true in (slow, fast):
        assert abs(own[file][0] - true) < 4.0 * own[file][1] and own[file][1] < 0.01 * true


@pytest.mark.parametrize(("deviation", "verdict"), [([1e3, 1e5, 1e3], UNLISTED), ([1e3, 1e3, 1e3], RESTLESS)])
def test_a_random_force_that_does_not_carry_the_motion_explains_nothing(monkeypatch, deviation, verdict):
    """Three windows of a thousand samples, of which one deviates by ten times the noise."""
    monkeypatch.setattr(diagnose, "unrest", lambda *model, alpha: object())
    at, prepared = bare(Linearised, finite=np.ones(3, bool)), bare(Prepared, model=bare(Model, effects=()))
    inner = bare(Grams, samples=np.full(3, 1000))
    model = bare(Fitted, point=bare(Point, prepared=prepared, at=at, inner=inner, deviation=np.array(deviation)))
    found = bare(Search, steps=(), last=bare(Scored, fitted=model))
    assert diagnose._cause(found, None, Predictions(bare(Experiment, records=()))).verdict == verdict


def test_a_single_short_record_is_diagnosed_although_nothing_can_be_left_out(tmp_path):
    """One free decay of one window."""
    t, omega = np.arange(400) / 2000.0, 2.0 * np.pi * 6.0
    x = 5e-3 * np.cos(omega * t) * np.exp(-0.02 * omega * t) + 1e-6 * np.random.default_rng(0).standard_normal(len(t))
    np.savetxt(tmp_path / "free.csv", np.stack([t, x], axis=1), delimiter=",", header="t,x", comments="")
    (tmp_path / "experiment.toml").write_text(
        'schema = 1\n[experiment]\nname = "short"\n[hammer]\nmass = 0.5\n[suspension]\nkind = "linear"\n[contact]\nlaw = "none"\n'
        '[sensors.hammer_displacement]\nunit = "m"\nnoise = 1e-6\n[[record]]\nfile = "free.csv"\nkind = "free-decay"\ngap = 1.0\n'
        'columns = { time = "t", hammer_displacement = "x" }\n'
    )
    found = diagnose_experiment(load_experiment(tmp_path), budget_minutes=np.inf)
    assert found.verdict == ADEQUATE
    assert found.sentences[1] == "The records are too short to leave windows out of the fit."
    assert np.isnan(found.nominal.held_out_nrmse)
    assert {p.name: p.value for p in found.nominal.parameters}["zeta"] == pytest.approx(0.02, rel=1e-2)
