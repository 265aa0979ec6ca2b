"""Gravity along an incline and a known constant force, from the experiment file to the report."""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from identification.commands.run import run_simulate
from identification.experiment import ExperimentError, load_experiment
from vibrojax.cli.fit import app
from vibrojax.contact import HuntCrossley
from vibrojax.errors import InputError
from vibrojax.model import STANDARD_GRAVITY, Model
from vibrojax.model_file import write_model
from vibrojax.suspension import Free

MASS, STIFFNESS, DAMPING = 0.3, 2.0e5, 0.3
SLOPE = np.radians(4.0)
FORCE = MASS * STANDARD_GRAVITY * np.sin(SLOPE) + 0.05

EXPERIMENT = """\
schema = 1
[hammer]
mass = 0.3
[rig]
incline = "4 deg"
constant_force = "50 mN"
[suspension]
kind = "free"
[sensors.relative_displacement]
unit = "m"
noise = 1.0e-6
[[record]]
file = "bounce.csv"
kind = "drop-test"
gap = 0.0
"""


def bouncing(time):
    """An independent integration of a cart that runs down an incline into a stop, and bounces."""

    def rates(t, y):
        depth = max(y[0], 0.0)
        return [y[1], (FORCE - max(STIFFNESS * depth**1.5 * (1.0 + DAMPING * y[1]), 0.0)) / MASS]

    found = solve_ivp(rates, (time[0], time[-1]), [-0.03, 0.0], method="RK45", rtol=1e-9, atol=1e-12, max_step=1e-4, t_eval=time)
    return found.y[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder, time = tmp_path_factory.mktemp("incline"), np.arange(0.0, 1.5, 5e-4)
    (folder / "experiment.toml").write_text(EXPERIMENT)
    moved = bouncing(time) + np.random.default_rng(3).normal(0.0, 1e-6, time.size)
    table = np.column_stack([time, moved])
    np.savetxt(folder / "bounce.csv", table, delimiter=",", header="time,relative_displacement", comments="", fmt="%.12g")
    return folder


def test_a_cart_that_bounces_down_an_incline_is_explained_by_its_declared_slope(folder, tmp_path):
    done = CliRunner().invoke(app, [str(folder), "--out", str(tmp_path / "fit")])
    assert done.exit_code == 0, done.output
    words = "known load: incline of 4° and constant force of 0.05 N: 0.2552 N towards the stop at all times"
    assert words in " ".join(done.output.split())
    fit = json.loads((tmp_path / "fit" / "fit.json").read_text())
    assert 0.9 < fit["chi2_reduced"] < 1.1
    for name, truth in {"k_i": STIFFNESS, "n": 1.5, "lambda_i": DAMPING}.items():
        assert abs(fit["parameters"][name]["value"] - truth) < 4.0 * fit["parameters"][name]["stderr"]
    assert fit["load"] == {"incline": pytest.approx(SLOPE), "constant_force": pytest.approx(0.05)}
    assert json.loads((tmp_path / "fit" / "model.json").read_text())["load"] == fit["load"]
    page = (tmp_path / "fit" / "report.html").read_text()
    assert "Free hammer: m ü = −m ÿ + m g sin α + F<sub>0</sub> − F<sub>i</sub>" in page
    assert "Known load: incline of 4°" in page


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"4 deg"', "4", r'incline in \[rig\] is 4: expected a number with its unit; write incline = "5 deg"'),
        ('"4 deg"', '"4"', r"incline in \[rig\] is '4': expected a number with its unit"),
        ('"4 deg"', '"4 mm"', r"unit 'mm' in incline of \[rig\] is a unit of displacement: expected one of angle, that is rad, deg"),
        ('"4 deg"', '"100 deg"', r"incline in \[rig\] is '100 deg': expected at most 90 deg"),
        ('"50 mN"', '"50 kg"', r"unit 'kg' in constant_force of \[rig\] is not a known unit: expected one of force"),
        ('"50 mN"', "true", r"constant_force in \[rig\] is True: expected a finite number in N"),
        ("constant_force", "constantforce", r"unknown key 'constantforce' in \[rig\]: did you mean 'constant_force'"),
        ('kind = "free"', 'kind = "pivot"\nlength = 1.0', r"incline in \[rig\] is given for a pivot, whose angle counts from"),
    ],
)
def test_what_no_load_can_be(folder, tmp_path, old, new, message):
    assert old in EXPERIMENT
    (tmp_path / "experiment.toml").write_text(EXPERIMENT.replace(old, new))
    (tmp_path / "bounce.csv").write_bytes((folder / "bounce.csv").read_bytes())
    with pytest.raises(ExperimentError, match=message):
        load_experiment(tmp_path)


def test_a_bare_number_is_a_force_in_newtons_and_signs_count(folder, tmp_path):
    (tmp_path / "experiment.toml").write_text(EXPERIMENT.replace('"50 mN"', "-0.2").replace('"4 deg"', '"-0.5 °"'))
    (tmp_path / "bounce.csv").write_bytes((folder / "bounce.csv").read_bytes())
    load = load_experiment(tmp_path).load
    assert (load.incline, load.constant_force) == (pytest.approx(np.radians(-0.5)), -0.2)


def test_a_model_without_the_declared_load_is_not_simulated(folder, tmp_path):
    write_model(Model(mass=MASS, suspension=Free(), law=HuntCrossley(STIFFNESS, 1.5, DAMPING)), tmp_path / "model.json")
    with pytest.raises(InputError, match=r"incline of 0.0698132 rad and a constant force of 0.05 N, and the model has 0 rad and 0 N"):
        run_simulate(tmp_path / "model.json", folder, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["model.json"]
