"""The whole way from records to a verdict; what was concealed was made by a simulator that shares no line with the program."""

import json
import re

import numpy as np
import pytest

from identification import diagnose
from identification.diagnose import diagnose_experiment, ordinary, overlooks
from identification.discrepancy.diagnosis import ADEQUATE, MISSING, UNLISTED
from identification.discrepancy.robust import robust_fit
from identification.experiment import load_experiment
from identification.prepare import prepare
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def complete(example):
    """The embedded example, which conceals nothing, shortened."""
    return diagnose_experiment(cropped(example, 4000, (0, 1, 2, 3)), budget_minutes=np.inf)


def test_nothing_is_claimed_missing_from_a_complete_model(complete):
    assert complete.verdict == ADEQUATE
    assert complete.effects == ()
    assert complete.location is None
    assert "Nothing beyond the noise" in complete.sentences[0]
    assert complete.model is complete.nominal_model


@pytest.mark.parametrize(("mild", "arrives"), [(10.0, True), (0.5, False)])
def test_a_fit_that_is_slow_may_take_its_time_only_near_the_records(small, monkeypatch, mild, arrives):
    monkeypatch.setattr(diagnose, "_MOST_ITERATIONS", 1)
    monkeypatch.setattr(diagnose, "_MILD", mild)
    found = ordinary(prepare(small))
    assert (found is not None) is arrives
    assert found is None or found.outcome.converged


@pytest.mark.parametrize(("tolerant", "plain", "does"), [(0.9, 0.36, True), (0.9, 0.85, False), (0.3, 0.1, False)])
def test_a_tolerant_fit_overlooks_what_only_an_ordinary_one_describes(tolerant, plain, does):
    assert overlooks(tolerant, plain) is does


@pytest.mark.parametrize(("tolerant", "plain", "sound"), [(0.9, 0.3, True), (0.2, 0.1, False)])
def test_the_search_starts_from_the_fit_that_describes_the_motion(small, monkeypatch, tolerant, plain, sound):
    nominal, short = ordinary(prepare(small)), robust_fit(prepare(small))
    assert nominal is not None
    errors = {id(nominal): plain, id(short[0]): tolerant}
    monkeypatch.setattr(diagnose, "_MILD", 0.5)
    monkeypatch.setattr(diagnose, "ordinary", lambda prepared: nominal)
    monkeypatch.setattr(diagnose, "robust_fit", lambda prepared: short)
    monkeypatch.setattr(diagnose, "_fits", lambda fitted: errors[id(fitted)])
    monkeypatch.setattr(diagnose, "_rms_nrmse", lambda error: error)
    ground = diagnose._ground(small, None, lambda stage: None)
    assert (ground.fitted, ground.sound) == ((nominal, True) if sound else (short[0], False))


def test_the_document_holds_plain_json(complete):
    document = json.loads(json.dumps(complete.document()))
    assert document["verdict"] == "adequate"
    assert document["nominal"]["chi2_reduced"] == pytest.approx(1.0, abs=0.02)


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
    assert found.sentences[1] == "There was too little to leave anything out of the fit."
    assert np.isnan(found.nominal.held_out_nrmse)
    assert {p.name: p.value for p in found.nominal.parameters}["zeta"] == pytest.approx(0.02, rel=1e-2)
