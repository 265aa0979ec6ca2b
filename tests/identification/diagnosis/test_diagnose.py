"""The whole way from records to a verdict; what was concealed was made by a simulator that shares no line with the program."""

import dataclasses
import functools
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from benchmarks.simulator import Case, Order, draw_case, write_case
from identification.diagnosis.diagnose import diagnose_experiment
from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNDECIDED, UNLISTED, Diagnosis
from identification.experiment import load_experiment
from tests.identification.conftest import cropped
from vibrojax.cli import main
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
    friction = next(p for p in found.effects[0].parameters if p.name == "friction_force")
    true = case.parts[0].numbers()["motion"]["friction_force"]
    assert friction.stderr is not None and abs(friction.value - true) < 4.0 * friction.stderr
    assert_recovered(found, case)
    assert found.location is not None
    assert found.location.phase == "free flight"
    assert found.location.coordinate in ("displacement", "velocity"), "a form over place and direction of motion holds it too"
    assert found.location.profiles[0].quantity == "force"
    assert found.augmented.held_out_nrmse < 0.5 * found.nominal.held_out_nrmse


def test_a_damping_that_is_on_no_list_is_given_no_name_and_located(diagnosed):
    found = diagnosed(UNLISTED).found
    assert (found.verdict, found.effects) == (UNLISTED, ())
    assert found.location is not None and found.location.phase == "free flight"
    assert found.location.profiles[0].quantity == "force"
    assert found.sentences[0] == "Something real is missing, and no listed effect explains it."


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


@pytest.mark.thorough
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


@pytest.fixture(scope="module")
def stepped(shared) -> Diagnosis:
    """A development case of which the gap changes at one instant."""
    return diagnose_experiment(load_experiment(shared / "concealed" / "case-01"), budget_minutes=np.inf)


@pytest.mark.thorough
def test_a_sudden_change_of_the_gap_is_named_with_its_record_and_instant(shared, stepped):
    found = stepped
    truth = json.loads((shared / "concealed" / "case-01" / "sealed" / "truth.json").read_text())
    assert found.verdict == MISSING
    assert found.effects[0].effect.name == "gap_step"
    assert found.location is not None
    assert found.location.record == truth["where"]["record"]
    assert found.location.time == pytest.approx(truth["where"]["time"], abs=0.05)
    values = {p.name: p.value for p in found.effects[0].parameters}
    assert values["gap_jump"] == pytest.approx(truth["numbers"]["gstep"], rel=0.02)
    assert found.nominal.chi2_reduced > 10.0 and found.augmented.chi2_reduced == pytest.approx(1.0, abs=0.05)


@pytest.mark.thorough
@pytest.mark.xfail(strict=True, reason="0.52 of the nominal model's: the change is in one record of four, and noise makes up the rest")
def test_a_sudden_change_of_the_gap_halves_the_error_left_out(stepped):
    assert stepped.augmented.held_out_nrmse < 0.5 * stepped.nominal.held_out_nrmse


@pytest.mark.thorough
def test_without_time_nothing_is_decided(diagnosed):
    found = diagnose_experiment(load_experiment(diagnosed(MISSING).folder.parent / "rig"), budget_minutes=1e-9)
    assert (found.verdict, found.effects, found.is_finished) == (UNDECIDED, (), False)
    assert found.document()["verdict"] == "undecided"


def test_the_verdict_is_the_same_on_a_loaded_machine(diagnosed):
    first, rig = diagnosed(MISSING).found, diagnosed(MISSING).folder.parent / "rig"
    with ThreadPoolExecutor(max_workers=2) as both:
        again, beside = both.map(lambda folder: diagnose_experiment(load_experiment(folder), budget_minutes=np.inf), (rig, rig))
    for found in (again, beside):
        assert (found.verdict, found.sentences, found.ambiguous_with) == (first.verdict, first.sentences, first.ambiguous_with)
        assert found.model.values() == pytest.approx(first.model.values(), rel=1e-9)
