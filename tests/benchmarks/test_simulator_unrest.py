import dataclasses
import json
import sys

import numpy as np
import pytest
from scipy.signal import welch

from benchmarks.simulator import UNREST, Order, RecordPlan, draw_case, simulate, standard_sensors, write_case
from benchmarks.simulator import __main__ as command
from benchmarks.simulator.example import RIG
from benchmarks.simulator.experiment import force_samples, motion, parameter_vector, true_signals
from benchmarks.simulator.kernel import COARSE, random_force
from benchmarks.simulator.random_force import RandomForce
from benchmarks.simulator.sensors import SAMPLING_STEP, coloured
from benchmarks.simulator.unrest import COLOUR, CORNER, SCATTER, SHARE

SMALL = (801, 1201)
FORCE = RandomForce(rms=0.05, corner=20.0, seed=3)
DRIVEN = RecordPlan(
    file="cart1.csv", kind="cart-excitation", gap=5e-4, true_gap=5e-4, samples=1201, excitation_frequency=7.5, base_phase=0.3, transient=400
)


def drawn(*unrest, seed=4, **order):
    return draw_case(np.random.default_rng(seed), Order(kind="stiff", samples=SMALL, unrest=unrest, **order))


def stationary(draws):
    """Rows of draws, of standard deviation 1 each to within four standard errors."""
    return np.abs(draws.std(axis=1) - 1.0).max() < 4.0 / np.sqrt(2.0 * draws.shape[1])


@pytest.mark.parametrize("corner", [3.0, 60.0])
def test_random_force_has_its_size_and_half_its_power_at_the_corner(corner):
    step = 1e-3
    values = RandomForce(rms=0.3, corner=corner, seed=8).values(2_000_000, step)
    assert values.std() == pytest.approx(0.3, rel=0.02)
    lag = round(1.0 / (2.0 * np.pi * corner) / step)
    assert np.mean(values[lag:] * values[:-lag]) / 0.09 == pytest.approx(np.exp(-2.0 * np.pi * corner * lag * step), abs=0.03)
    frequency, power = welch(values, 1.0 / step, nperseg=16384)
    flat = power[(frequency > 0.0) & (frequency < 0.2 * corner)].mean() / (5.0 * np.arctan(0.2))
    near = np.abs(frequency - corner) < 0.05 * corner
    assert power[near].mean() / flat == pytest.approx(0.5, rel=0.15)


def test_random_force_begins_in_the_stationary_state():
    assert stationary(np.array([RandomForce(rms=1.0, corner=5.0, seed=seed).values(3, 1e-3) for seed in range(4000)]).T)


def test_the_kernel_interpolates_the_force_and_keeps_its_last_value():
    plan = dataclasses.replace(DRIVEN, random_force=FORCE)
    p, (start, step, *values) = parameter_vector(RIG, plan), force_samples(plan)
    assert (start, step) == (-400 * SAMPLING_STEP, SAMPLING_STEP / COARSE)
    assert random_force(start + 6.25 * step, p) == pytest.approx(0.75 * values[6] + 0.25 * values[7])
    assert random_force(start - 1.0, p) == values[0]
    assert random_force(start + 1e3, p) == values[-1]
    assert start + step * (len(values) - 1) >= motion(RIG, plan)["time"][-1] + SAMPLING_STEP * 0.999


def test_hammer_under_a_random_force_obeys_newton():
    plan = dataclasses.replace(DRIVEN, true_gap=1.0, random_force=FORCE)
    signals = true_signals(RIG, plan)
    u, v = (signals[f"hammer_{name}"] - signals[f"cart_{name}"] for name in ("displacement", "velocity"))
    force = FORCE.values(COARSE * 2000, SAMPLING_STEP / COARSE)[COARSE * 400 :: COARSE][: plan.samples]
    np.testing.assert_allclose(RIG.m * signals["hammer_acceleration"], force - RIG.c * v - RIG.k * u, atol=1e-9)


def test_half_the_steps_give_the_same_motion_under_a_random_force():
    plan = dataclasses.replace(DRIVEN, random_force=FORCE)
    coarse, fine = (motion(RIG, plan, refinement=refinement) for refinement in (1, 2))
    np.testing.assert_allclose(coarse["hammer_displacement"], fine["hammer_displacement"], rtol=0, atol=1e-8)


@pytest.mark.parametrize("colour", COLOUR)
def test_coloured_noise_has_its_size_and_two_equal_poles(colour):
    noise = coloured(np.random.default_rng(2).normal(0.0, 3.0, 400_000), colour)
    assert noise.std() == pytest.approx(3.0, rel=0.02)
    a = np.exp(-2.0 * np.pi * colour * SAMPLING_STEP)
    left = noise[2:] - 2.0 * a * noise[1:-1] + a**2 * noise[:-2]
    for lag in (1, 2, 5):
        assert np.mean(left[lag:] * left[:-lag]) / left.var() == pytest.approx(0.0, abs=0.01)
    begun = np.array([coloured(np.random.default_rng(seed).normal(size=5), colour) for seed in range(4000)]).T
    assert stationary(begun)
    for lag in (1, 2):
        expected = np.mean(noise[lag:] * noise[:-lag]) / 9.0
        assert np.mean(begun[lag:] * begun[:-lag], axis=1) == pytest.approx(np.full(5 - lag, expected), abs=0.06)


def test_a_reading_is_as_noisy_as_declared():
    sensor = dataclasses.replace(standard_sensors()[0], colour_hz=400.0)
    read = sensor.read(np.zeros(200_000), np.random.default_rng(0))
    assert read.std() == pytest.approx(sensor.noise, rel=0.02)
    assert np.mean(read[1:] * read[:-1]) / read.var() > 0.5


def test_unrest_changes_nothing_else():
    still, all_of_it = drawn(), drawn(*UNREST)
    assert (all_of_it.rig, all_of_it.sealed, all_of_it.parts) == (still.rig, still.sealed, still.parts)
    assert [plan.gap for plan in all_of_it.plans] == [plan.gap for plan in still.plans]
    assert still.unrest.numbers() == {"unrest": None, "corner": None, "colour": None, "scatter": None}
    for case in (still, drawn("colour")):
        assert not any(plan.random_force or plan.own_rig for plan in case.plans)
    assert not any(plan.random_force or plan.own_rig for plan in all_of_it.sealed)
    assert all_of_it == drawn(*UNREST)
    for kind in UNREST:
        alone = {name: value for name, value in drawn(kind).unrest.numbers().items() if value is not None}
        assert alone.items() <= all_of_it.unrest.numbers().items()


def test_each_record_has_a_random_force_of_its_own():
    case = drawn("force")
    assert len({plan.random_force.seed for plan in case.plans}) == len(case.plans) == 4
    assert {plan.random_force.rms for plan in case.plans} == {case.unrest.share * case.rig.k * case.rig.base_amplitude}
    assert {plan.random_force.corner for plan in case.plans} == {case.unrest.corner}


def test_every_channel_is_coloured():
    case = drawn("colour", channels="no load cell", noise=2.0)
    assert {sensor.colour_hz for sensor in case.sensors} == {case.unrest.colour}
    assert [sensor.noise for sensor in case.sensors] == [2.0 * sensor.noise for sensor in standard_sensors(force=False)]


def test_records_scatter_about_the_rig():
    cases = [(drawn("scatter", seed=seed), drawn(seed=seed)) for seed in range(60)]
    shares = []
    for case, still in cases:
        for plan, before in zip(case.plans, still.plans, strict=True):
            own, rig = plan.own_rig, case.rig
            assert (own.m, own.n, own.lambda_i, own.base_amplitude) == (rig.m, rig.n, rig.lambda_i, rig.base_amplitude)
            changes = [getattr(own, name) / getattr(rig, name) - 1.0 for name in ("k_i", "f_n", "zeta")]
            changes += [(plan.true_gap - before.true_gap) / plan.gap] if plan.gap else []
            shares += [change / case.unrest.scatter for change in changes]
            assert plan.gap or plan.true_gap == before.true_gap
    assert np.mean(shares) == pytest.approx(0.0, abs=0.15)
    assert np.std(shares) == pytest.approx(1.0, abs=0.1)


def test_a_record_is_that_of_its_own_rig():
    plan = dataclasses.replace(DRIVEN, own_rig=dataclasses.replace(RIG, f_n=1.003 * RIG.f_n))
    scattered, own = (true_signals(rig, each) for rig, each in ((RIG, plan), (plan.own_rig, DRIVEN)))
    for name in own:
        np.testing.assert_array_equal(scattered[name], own[name])


def test_sizes_lie_between_their_limits():
    found = [drawn(*UNREST, seed=seed).unrest.numbers() for seed in range(60)]
    for name, (low, high) in {"unrest": SHARE, "corner": CORNER, "colour": COLOUR, "scatter": SCATTER}.items():
        values = np.array([each[name] for each in found])
        assert low <= values.min() < np.sqrt(low * high) < values.max() <= high
        assert np.mean(values < np.sqrt(low * high)) == pytest.approx(0.5, abs=0.25)


def test_unknown_unrest_is_refused():
    with pytest.raises(ValueError, match=r"unknown unrest \['noise'\]: expected some of force, colour, scatter"):
        drawn("noise")


def test_the_truth_says_what_was_drawn_and_sealed_records_are_those_of_the_quiet_rig(tmp_path):
    written = {}
    for name, unrest in (("still", ()), ("all", UNREST)):
        rng = np.random.default_rng(9)
        written[name] = write_case(tmp_path / name, draw_case(rng, Order(kind="soft", samples=SMALL, unrest=unrest)), rng)
    truth, before = (json.loads((written[name] / "truth.json").read_text(encoding="utf-8")) for name in ("all", "still"))
    assert all(truth[name] > 0.0 and before[name] is None for name in ("unrest", "corner", "colour", "scatter"))
    assert (truth["parameters"], truth["nominal"]) == (before["parameters"], before["nominal"])
    assert {"k_i", "f_n", "zeta"} <= set(truth["records"]["cart1.csv"]) - set(before["records"]["cart1.csv"])
    for file in ("cart4.csv", "cart5.csv"):
        assert (written["all"] / file).read_bytes() == (written["still"] / file).read_bytes()
    assert (tmp_path / "all" / "experiment.toml").read_text() == (tmp_path / "still" / "experiment.toml").read_text().replace(
        "still", "all"
    )
    assert (tmp_path / "all" / "drop.csv").read_bytes() != (tmp_path / "still" / "drop.csv").read_bytes()


def test_the_same_seed_gives_the_same_record():
    plan = drawn("force").plans[1]
    first, second = (simulate(RIG, plan, standard_sensors(), np.random.default_rng(1)) for _ in range(2))
    np.testing.assert_array_equal(first["hammer_displacement"], second["hammer_displacement"])


def test_the_command_hands_on_what_is_asked(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(command, "write_case", lambda folder, case, rng: asked.append(case.order))
    monkeypatch.setattr(command, "draw_case", lambda rng, order: drawn(*order.unrest))
    monkeypatch.setattr(sys, "argv", ["simulator", "--unrest", "force", "scatter", "--out", str(tmp_path / "x")])
    command.main()
    assert asked[0].unrest == ("force", "scatter")
