"""Records of a testing machine: the motion is prescribed, the force is what the model is compared with."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.estimation.simulate import simulate_record
from identification.experiment import ExperimentError, load_experiment
from identification.trajectory.start import problem_of
from tests.identification.testing_machine import DAMPING, K_I, LAMBDA_I, MASS, NOISE, STIFFNESS, N, experiment, machine


@pytest.fixture(scope="module")
def fitted():
    return fit_experiment(experiment(machine(0.5, 1), machine(1.5, 2)))


def test_spring_damper_and_stop_are_recovered(fitted):
    omega = np.sqrt(STIFFNESS / MASS)
    truth = {"f_n": omega / (2 * np.pi), "zeta": DAMPING / (2 * MASS * omega), "k_i": K_I, "n": N, "lambda_i": LAMBDA_I}
    assert fitted.converged
    assert fitted.chi2_reduced == pytest.approx(1.0, abs=0.1)
    for parameter in fitted.parameters:
        assert abs(parameter.value - truth[parameter.spec.name]) < 3.5 * parameter.stderr, parameter.spec.name
    gaps = [n for record in fitted.records for n in record.nuisances if n.name == "gap_error"]
    assert all(abs(gap.value - 1e-4) < 4.0 * gap.stderr for gap in gaps)


def test_the_path_is_not_compared_with_itself(fitted):
    assert [set(record.nrmse) for record in fitted.records] == [{"reaction_force"}] * 2


def test_a_prescribed_window_has_no_free_state(fitted):
    samples = sum(len(record.time) for record in fitted.records)
    assert fitted.degrees == samples - len(fitted.parameters) - 2


def test_simulate_leads_the_hammer_along_the_path(fitted):
    record = machine(1.5, 2)
    series = simulate_record(fitted.model, record)
    assert np.std(series["relative_displacement"] - record.channels["relative_displacement"]) < 2 * NOISE["relative_displacement"]
    assert np.nanstd(series["reaction_force"] - record.channels["reaction_force"]) < 0.05 * np.std(record.channels["reaction_force"])


def test_stiffness_and_damping_are_read_off_before_the_fit():
    problem = problem_of(experiment(machine(0.5, 1), law="none"))
    k = MASS * (2 * np.pi * problem.values(problem.start)["f_n"]) ** 2
    assert k == pytest.approx(STIFFNESS, rel=0.02)


def written(folder: Path, channels: tuple[str, ...]) -> Path:
    record = machine(0.5, 1)
    columns = {"time": record.time} | {name: record.channels[name] for name in channels}
    np.savez(folder / "a.npz", **columns)
    units = {"relative_displacement": "m", "reaction_force": "N"}
    sensors = "".join(f'[sensors.{name}]\nunit = "{units[name]}"\nnoise = {NOISE[name]}\n' for name in channels)
    (folder / "experiment.toml").write_text(
        'schema = 1\n[hammer]\nmass = 1.0\n[suspension]\nkind = "linear"\n'
        f'{sensors}[[record]]\nfile = "a.npz"\nkind = "prescribed"\ngap = 1.0\n'
    )
    return folder


def test_a_prescribed_record_is_read(tmp_path):
    (record,) = load_experiment(written(tmp_path, ("relative_displacement", "reaction_force"))).records
    assert record.kind == "prescribed"
    assert set(record.channels) == {"relative_displacement", "reaction_force"}


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        ("reaction_force", "is 'prescribed' and its motion is not recorded: expected relative_displacement or hammer_displacement"),
        ("relative_displacement", "is 'prescribed' and no force is recorded: expected reaction_force or impact_force or hammer_acc"),
    ],
)
def test_an_incomplete_prescribed_record_is_refused(tmp_path, channel, message):
    with pytest.raises(ExperimentError, match=message):
        load_experiment(written(tmp_path, (channel,)))


def test_a_motion_that_was_never_recorded_cannot_be_prescribed():
    record = machine(0.5, 1)
    without = dataclasses.replace(record, channels={"reaction_force": record.channels["reaction_force"]})
    with pytest.raises(ExperimentError, match="prescribed but its motion is not recorded"):
        problem_of(experiment(without))
