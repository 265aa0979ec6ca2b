import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
from scipy.special import lambertw

from benchmarks.simulator import KINDS, RecordPlan, draw_plan, draw_rig, standard_sensors, write_experiment
from benchmarks.simulator.example import FOLDER, PLANS, RIG, write_example
from benchmarks.simulator.experiment import SAMPLING_STEP, parameter_vector, simulate, true_signals
from benchmarks.simulator.kernel import base_motion, contact_force, sampled, vector
from benchmarks.simulator.sensors import Sensor
from identification.experiment import load_experiment

DROP = RecordPlan(file="drop.csv", kind="drop-test", gap=0.0, true_gap=2e-4, samples=4001, release=-3e-3)
SMALL = (801, 1601)


def hunt_crossley_restitution(lambda_i, speed):
    a = lambda_i * speed
    return float(1 + lambertw(-(1 + a) * np.exp(-1 - a)).real) / a


@pytest.mark.parametrize("speed", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
def test_restitution_of_one_impact(speed, n):
    p = vector(m=0.4, k_i=3e6, n=n, lambda_i=0.6)
    flight = 1e-3
    states, _, _ = sampled(0.0, SAMPLING_STEP, 400, np.array([-speed * flight, speed]), p)
    assert -states[-1, 1] / speed == pytest.approx(hunt_crossley_restitution(0.6, speed), rel=1e-7)


def test_without_numba_the_remedy_is_stated():
    code = "import sys; sys.modules['numba'] = None; import benchmarks.simulator"
    ended = subprocess.run([sys.executable, "-c", code], cwd=FOLDER.parents[1], capture_output=True, text=True)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].endswith("the simulator needs numba, which vibrojax itself does not: pip install numba")


def test_flight_is_a_damped_vibration():
    plan = dataclasses.replace(DROP, true_gap=1.0)
    time, x = (true_signals(RIG, plan)[name] for name in ("time", "hammer_displacement"))
    omega_n = 2 * np.pi * RIG.f_n
    omega_d = omega_n * np.sqrt(1 - RIG.zeta**2)
    exact = np.exp(-RIG.zeta * omega_n * time) * (np.cos(omega_d * time) + RIG.zeta * omega_n / omega_d * np.sin(omega_d * time))
    np.testing.assert_allclose(x, plan.release * exact, atol=1e-13)


def test_what_the_spring_and_the_hammer_lose_goes_into_dampers():
    signals = true_signals(dataclasses.replace(RIG, zeta=0.0, lambda_i=0.0), DROP)
    x, v, force = signals["hammer_displacement"], signals["hammer_velocity"], signals["impact_force"]
    stored = RIG.k_i * np.maximum(x - DROP.true_gap, 0.0) ** (RIG.n + 1) / (RIG.n + 1)
    energy = 0.5 * RIG.m * v**2 + 0.5 * RIG.k * x**2 + stored
    assert force.max() > 10.0
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)


def test_hammer_obeys_newton_at_every_sample():
    rng = np.random.default_rng(3)
    rig = draw_rig(rng, "stiff")
    plan = draw_plan(rng, "stiff", rig.f_n, samples=SMALL)[1]
    signals, p = true_signals(rig, plan), parameter_vector(rig, plan)
    base = np.array([base_motion(t, p) for t in signals["time"]])
    u, v = signals["hammer_displacement"] - base[:, 0], signals["hammer_velocity"] - base[:, 1]
    push = [contact_force(delta, rate, p) for delta, rate in zip(u - plan.true_gap, v, strict=True)]
    np.testing.assert_allclose(signals["impact_force"], push)
    np.testing.assert_allclose(rig.m * signals["hammer_acceleration"], -rig.c * v - rig.k * u - push, rtol=1e-9, atol=1e-9)


def test_a_hammer_that_sticks_is_at_rest():
    p = vector(m=0.5, c=2.0, k=770.0, k_i=2e6, n=1.45, lambda_i=0.8, adhesion_force=2.0, adhesion_reach=5e-4)
    states, slopes, felt = sampled(0.0, SAMPLING_STEP, 2400, np.array([-3e-3, 0.0]), p)
    assert felt.max() > 10.0
    assert felt.min() < -1.9
    np.testing.assert_allclose(slopes[1600:], 0.0, atol=1e-4)
    np.testing.assert_allclose(felt[1600:], -770.0 * states[1600:, 0], atol=1e-3)


def test_sensor_adds_noise_and_steps_and_saturates():
    sensor = Sensor(channel="impact_force", noise=0.5, full_scale=100.0, unit="N")
    read = sensor.read(np.full(20_000, 3.0), np.random.default_rng(0))
    assert read.std() == pytest.approx(0.5, rel=0.03)
    np.testing.assert_allclose(np.round(read / (100 / 2**15)), read / (100 / 2**15), atol=1e-9)
    assert sensor.read(np.full(3, 1e3), np.random.default_rng(0)).max() < 100.0


@pytest.mark.parametrize("kind", KINDS)
def test_folder_can_be_loaded_and_the_truth_stays_outside(tmp_path, kind):
    rng = np.random.default_rng(5)
    rig = draw_rig(rng, kind)
    plans = draw_plan(rng, kind, rig.f_n, samples=SMALL)
    write_experiment(tmp_path / "rig", rig, plans, standard_sensors(force=False), rng, truth=tmp_path / "truth.json")
    experiment = load_experiment(tmp_path / "rig")
    assert sorted(path.name for path in (tmp_path / "rig").iterdir()) == [
        "cart1.csv",
        "cart2.csv",
        "cart3.csv",
        "drop.csv",
        "experiment.toml",
    ]
    assert [len(record.time) for record in experiment.records] == [801, 1601, 1601, 1601]
    assert set(experiment.records[0].channels) == {"hammer_displacement", "cart_displacement", "hammer_acceleration"}
    assert experiment.mass == rig.m
    truth = json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))
    assert truth["parameters"] == {"k_i": rig.k_i, "n": rig.n, "lambda_i": rig.lambda_i, "zeta": rig.zeta, "f_n": rig.f_n}


def test_the_same_seed_gives_the_same_record():
    def record():
        return simulate(RIG, DROP, standard_sensors(), np.random.default_rng(1))

    first, second = record(), record()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])


def test_embedded_example_is_what_its_command_writes(tmp_path):
    write_example(tmp_path)
    for plan in PLANS:
        written, embedded = (np.loadtxt(folder / plan.file, delimiter=",", skiprows=1) for folder in (tmp_path, FOLDER))
        np.testing.assert_allclose(written, embedded, rtol=0, atol=2e-3)
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 1.5e6
    experiment = load_experiment(FOLDER)
    assert [record.notices for record in experiment.records] == [()] * 4
    assert experiment.mass == RIG.m
    for record, plan in zip(experiment.records, PLANS, strict=True):
        assert (record.file, record.kind, record.gap) == (plan.file, plan.kind, plan.gap)
        assert (record.excitation_frequency or 0.0) == plan.excitation_frequency
