"""Sensors whose zero the operator does not know: every record has one of its own."""

import dataclasses

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.experiment import ExperimentError, Sensor, load_experiment
from identification.trajectory.start import problem_of
from tests.identification.experiment.malformed import edit, write_valid
from tests.identification.testing_machine import DAMPING, MASS, NOISE, STIFFNESS, experiment, machine

ZEROS = (30.0, -12.0, 8.0)
"""N"""
SENSORS = {"relative_displacement": Sensor(unit="m", zero=1e-3), "reaction_force": Sensor(unit="N", zero=20.0)}


def shifted(frequency: float, seed: int, zero: float):
    """A record without contact, its gauge off by `zero`."""
    record = machine(frequency, seed)
    time = record.time
    u, v = 8e-3 * np.sin(2 * np.pi * frequency * time), 8e-3 * 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * time)
    noise = NOISE["reaction_force"] * np.random.default_rng(seed).standard_normal(len(time))
    force = STIFFNESS * u + DAMPING * v + zero + noise
    return dataclasses.replace(record, gap=1.0, channels=record.channels | {"reaction_force": force})


@pytest.fixture(scope="module")
def machines():
    records = [shifted(0.5, 1, ZEROS[0]), shifted(1.5, 2, ZEROS[1]), dataclasses.replace(shifted(1.0, 3, ZEROS[2]), held_back=True)]
    return dataclasses.replace(experiment(*records, law="none"), sensors=SENSORS)


@pytest.fixture(scope="module")
def fitted(machines):
    return fit_experiment(machines)


def test_zeros_are_estimated_record_by_record(fitted):
    omega = np.sqrt(STIFFNESS / MASS)
    truth = {"f_n": omega / (2 * np.pi), "zeta": DAMPING / (2 * MASS * omega)}
    assert fitted.chi2_reduced == pytest.approx(1.0, abs=0.1)
    for parameter in fitted.parameters:
        assert abs(parameter.value - truth[parameter.spec.name]) < 3.5 * parameter.stderr, parameter.spec.name
    for record, zero in zip(fitted.records, ZEROS, strict=False):
        (found,) = (n for n in record.nuisances if n.name.startswith("zero"))
        assert (found.name, found.unit) == ("zero.reaction_force", "N")
        assert found.stderr < 0.1
        assert abs(found.value - zero) < 3.5 * found.stderr


def test_without_the_option_a_shift_is_a_misfit(machines, fitted):
    plain = fit_experiment(dataclasses.replace(machines.fitting, sensors={}))
    assert plain.chi2_reduced > 100.0 * fitted.chi2_reduced
    assert not [n for record in plain.records for n in record.nuisances]


def test_a_record_held_back_has_its_own_zero(fitted):
    (predicted,) = fitted.held_back
    (zero,) = predicted.nuisances
    assert abs(zero.value - ZEROS[2]) < 3.5 * zero.stderr
    assert predicted.chi2_reduced["reaction_force"] == pytest.approx(1.0, abs=0.15)


def test_the_path_that_drives_the_model_keeps_its_zero(machines):
    """And each record has one prior of the zero that is estimated."""
    problem = problem_of(machines)
    border, place = problem.border, [problem.unknowns.own.index(f"zero.{name}") for name in ("relative_displacement", "reaction_force")]
    np.testing.assert_array_equal(border.own[:, place], [[False, True]] * 2)
    np.testing.assert_allclose(border.own_precision[:, place[1]], 20.0**-2)


def test_the_option_is_read_and_checked(tmp_path):
    write_valid(tmp_path)
    edit('unit = "N"\nnoise = 0.15', 'unit = "N"\nnoise = 0.15\nzero = 2.5')(tmp_path)
    assert load_experiment(tmp_path).sensors["impact_force"] == Sensor(unit="N", noise=0.15, zero=2.5)
    edit("zero = 2.5", "zero = 0.0")(tmp_path)
    with pytest.raises(ExperimentError, match=r"zero in \[sensors.impact_force\] is 0.0: expected a finite number above 0 in N"):
        load_experiment(tmp_path)
