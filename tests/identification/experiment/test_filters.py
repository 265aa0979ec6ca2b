"""Filters of the recorder and of sensors that are known, declared in the experiment."""

import numpy as np
import pytest

from identification.experiment import ExperimentError, load_experiment
from identification.guesses.declared_model import nominal_model

TIME = np.arange(400) / 1000.0


def loaded(folder, recorder="", sensor=""):
    swing = 1e-3 * np.cos(20.0 * TIME) + np.random.default_rng(1).normal(0.0, 1e-6, TIME.size)
    np.savez(folder / "a.npz", time=TIME, hammer_displacement=swing)
    (folder / "experiment.toml").write_text(
        f"""schema = 1
{recorder}
[hammer]
mass = 0.5
[suspension]
kind = "linear"
[sensors.hammer_displacement]
unit = "m"
{sensor}
[sensors.impact_force]
unit = "N"
[[record]]
file = "a.npz"
kind = "free-decay"
gap = 1.0
"""
    )
    return load_experiment(folder)


def test_readings_pass_the_sensor_first_and_then_the_recorder(tmp_path):
    experiment = loaded(
        tmp_path,
        'recorder = { lowpass = { type = "butterworth", order = 4, corner = "1.1 kHz" } }',
        "highpass = { time_constant = 0.5 }",
    )
    found = [(one.channel, one.band, one.order, one.corner) for one in experiment.filters]
    assert found == [
        ("hammer_displacement", "highpass", 1, pytest.approx(1.0 / np.pi)),
        ("hammer_displacement", "lowpass", 4, 1100.0),
        ("impact_force", "lowpass", 4, 1100.0),
    ]
    assert [one.of_channel for one in nominal_model(experiment, None).recorder] == ["hammer_displacement"] * 2  # of what is recorded


def test_without_a_declaration_there_is_no_filter(tmp_path):
    assert nominal_model(loaded(tmp_path), None).recorder == ()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("{ order = 4 }", "is not one filter: expected { type = .butterworth., order = 4, corner = 1100.0 }"),
        ("{ corner = 100.0, time_constant = 0.1 }", "is not one filter"),
        ("{ order = 2, time_constant = 0.1 }", "is not one filter"),
        ("{ corner = 100.0 }", "type is missing in lowpass of .recorder.: expected one of butterworth"),
        ('{ type = "bessel", corner = 100.0 }', "unknown type 'bessel' in lowpass of .recorder."),
        ('{ type = "butterworth", order = 9, corner = 100.0 }', "order in lowpass of .recorder. is 9: expected a whole number from 1 to 8"),
        ('{ type = "butterworth", corner = -1.0 }', "corner in lowpass of .recorder. is -1.0: expected a finite number above 0"),
        ('{ type = "butterworth", corner = "1 kN" }', "is a unit of force"),
        ('{ type = "butterworth", cutoff = 1.0 }', "unknown key 'cutoff'"),
        ("1100.0", "lowpass of .recorder. is 1100.0: expected a table"),
    ],
)
def test_what_is_no_filter_is_refused(given, message, tmp_path):
    with pytest.raises(ExperimentError, match=message):
        loaded(tmp_path, f"recorder = {{ lowpass = {given} }}")
