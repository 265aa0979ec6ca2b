"""A rigid stop whose restitution falls with the speed, on flights written down in closed form."""

import numpy as np

from identification.diagnosis.diagnose import diagnose_experiment
from identification.experiment import load_experiment

SPEEDS = (0.05, 0.1, 0.2, 0.35, 0.5, 0.8)
NOISE = 2e-5
EXPERIMENT = """
schema = 1
[experiment]
name = "thrown"
[hammer]
mass = 0.15
[suspension]
kind = "free"
[contact]
law = "newton"
[sensors.relative_displacement]
unit = "m"
noise = 2.0e-5
"""


def thrown(folder, power: float):
    """Records of a body that flies into a stop at u = 0 and leaves it at 0.3 (v / 0.4)^-q times its speed."""
    rng, text, time = np.random.default_rng(5), EXPERIMENT, np.arange(0.0, 0.2, 0.002)
    for index, speed in enumerate(SPEEDS):
        rebound = 0.3 * (speed / 0.4) ** -power * speed
        u = np.where(time < 0.0813, speed * (time - 0.0813), -rebound * (time - 0.0813)) + NOISE * rng.standard_normal(len(time))
        np.savetxt(folder / f"{index}.csv", np.column_stack([time, u]), delimiter=",", header="time,relative_displacement", comments="")
        text += f'[[record]]\nfile = "{index}.csv"\nkind = "drop-test"\ngap = 0.0\n'
    (folder / "experiment.toml").write_text(text)
    return load_experiment(folder)


def test_a_restitution_that_falls_is_named_with_its_power(tmp_path):
    found = diagnose_experiment(thrown(tmp_path, 0.4))
    assert [one.effect.name for one in found.effects] == ["falling_restitution"]
    power = next(p for p in found.effects[0].parameters if p.name == "power")
    assert abs(power.value - 0.4) < 4.0 * power.stderr < 0.08
    assert found.augmented.held_out_nrmse < 0.2 * found.nominal.held_out_nrmse


def test_a_constant_restitution_leaves_nothing(tmp_path):
    assert diagnose_experiment(thrown(tmp_path, 0.0)).verdict == "adequate"
