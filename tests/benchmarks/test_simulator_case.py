import dataclasses
import json

import numpy as np
import pytest

from benchmarks.simulator import Hidden, Order, RecordPlan, draw_case, simulate, standard_sensors, write_case
from benchmarks.simulator.__main__ import concealed
from benchmarks.simulator.example import RIG
from benchmarks.simulator.experiment import motion, true_signals
from benchmarks.simulator.faults import Clip, Delay, Gain, Hum, LowPass, ZeroDrift
from identification.experiment import load_experiment

SMALL = (801, 1201)
DRIVEN = RecordPlan(
    file="cart1.csv", kind="cart-excitation", gap=5e-4, true_gap=5e-4, samples=1201, excitation_frequency=7.5, base_phase=0.3, transient=400
)
QUIET = tuple(dataclasses.replace(sensor, noise=0.0, full_scale=2e4) for sensor in standard_sensors())


def readings(*faults):
    return simulate(RIG, DRIVEN, standard_sensors(), np.random.default_rng(0), Hidden(faults=faults))


def test_gain_error_scales_one_channel():
    plain, wrong = readings(), readings(Gain(channel="impact_force", factor=1.1))
    assert wrong["impact_force"].max() == pytest.approx(1.1 * plain["impact_force"].max(), rel=0.01)
    np.testing.assert_array_equal(wrong["hammer_displacement"], plain["hammer_displacement"])


@pytest.mark.parametrize("delay", [1.3e-3, -1.3e-3])
def test_delayed_channel_shows_what_was_before(delay):
    wrong = readings(Delay(channel="cart_displacement", delay=delay))["cart_displacement"]
    t = 0.25e-3 * np.arange(DRIVEN.samples)
    y = RIG.base_amplitude * np.sin(2 * np.pi * 7.5 * (t - delay) + 0.3)
    assert np.std(wrong - y) < 1.2e-5


def test_a_late_channel_shows_an_impact_as_it_was_between_samples():
    late = simulate(RIG, DRIVEN, QUIET, np.random.default_rng(0), Hidden(faults=(Delay(channel="impact_force", delay=0.125e-3),)))
    finely = dataclasses.replace(DRIVEN, transient=2 * DRIVEN.transient, samples=2 * DRIVEN.samples)
    true = motion(RIG, finely, dt=0.125e-3)["impact_force"][finely.transient - 1 :: 2][: DRIVEN.samples]
    assert true.max() > 10.0
    np.testing.assert_allclose(late["impact_force"], true, rtol=0, atol=0.5)


def test_low_pass_has_its_time_constant():
    fault = LowPass(channel="impact_force", time_constant=2e-3)
    answer = fault.distort("", 0.25e-3 * np.arange(4001), (np.arange(4001) > 0).astype(float))
    assert answer[8] == pytest.approx(1 - np.exp(-1.0))
    assert answer[-1] == pytest.approx(1.0)


def test_clipped_channel_stays_on_one_level():
    plain, wrong = readings(), readings(Clip(channel="impact_force", level=15.0))
    above = plain["impact_force"] > 16.0
    assert above.sum() > 5
    assert len(set(wrong["impact_force"][above])) == 1
    assert wrong["impact_force"].max() == pytest.approx(15.0, abs=0.07)


def test_hum_and_creeping_zero_are_added():
    hum = Hum(channel="hammer_displacement", amplitude=1e-4, frequency=50.0, phases={"cart1.csv": 0.5})
    zero = ZeroDrift(channel="hammer_displacement", size=2e-4, time_constant=0.05)
    plain, wrong = readings(), readings(hum, zero)
    t = plain["time"]
    added = 1e-4 * np.sin(100 * np.pi * t + 0.5) + 2e-4 * (1 - np.exp(-t / 0.05))
    np.testing.assert_allclose(wrong["hammer_displacement"] - plain["hammer_displacement"], added, atol=4e-6)


def test_case_is_written_with_its_truth_beside_it(tmp_path):
    order = Order(
        kind="soft", effects=(("gap_step", 0.8), ("cubic_stiffness", 0.5)), noise=3.0, channels="no accelerometer", driven=2, samples=SMALL
    )
    rng = np.random.default_rng(8)
    case = draw_case(rng, order)
    sealed = write_case(tmp_path / "case", case, rng)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case", "case.sealed"]
    assert sorted(path.name for path in (tmp_path / "case").iterdir()) == ["cart1.csv", "cart2.csv", "drop.csv", "experiment.toml"]
    experiment = load_experiment(tmp_path / "case")
    assert experiment.law is None
    assert {"hammer_displacement", "cart_displacement", "impact_force"} == set(experiment.records[0].channels)
    assert experiment.records[0].noise["hammer_displacement"] == pytest.approx(3e-5, rel=0.01)
    truth = json.loads((sealed / "truth.json").read_text(encoding="utf-8"))
    assert [(e["name"], e["strength"]) for e in truth["effects"]] == [("gap_step", 0.8), ("cubic_stiffness", 0.5)]
    assert truth["where"]["record"] in {"cart1.csv", "cart2.csv"}
    assert truth["nominal"]["k_i"] == case.rig.k_i


def test_sealed_records_begin_at_rest_and_are_free_of_noise(tmp_path):
    rng = np.random.default_rng(9)
    case = draw_case(rng, Order(kind="stiff", effects=(("base_harmonics", 1.0), ("gain_error", 1.0)), samples=SMALL))
    sealed = load_experiment(write_case(tmp_path / "case", case, rng))
    frequencies = {plan.excitation_frequency for plan in case.plans + case.sealed}
    assert len(frequencies) == 6
    for record, plan in zip(sealed.records, case.sealed, strict=True):
        assert record.gap == plan.true_gap
        truth = true_signals(case.rig, plan, Hidden(motion=case.hidden.motion))
        for channel, values in record.channels.items():
            np.testing.assert_allclose(values, truth[channel], rtol=1e-7, atol=1e-12)
        u = truth["hammer_displacement"] - truth["cart_displacement"]
        assert record.channels["hammer_displacement"][0] == 0.0
        assert record.initial_displacement == pytest.approx(u[0])
        assert record.initial_velocity == pytest.approx((truth["hammer_velocity"] - truth["cart_velocity"])[0])


def test_missing_stop_is_declared(tmp_path):
    rng = np.random.default_rng(1)
    case = draw_case(rng, Order(kind="stiff", effects=(("missing_stop", 1.0),), samples=SMALL))
    write_case(tmp_path / "case", case, rng)
    experiment = load_experiment(tmp_path / "case")
    assert experiment.law == "none"
    assert experiment.records[1].channels["impact_force"].max() > 5.0


def test_an_effect_that_no_channel_shows_is_refused():
    with pytest.raises(ValueError, match="cannot be seen without impact_force"):
        draw_case(np.random.default_rng(0), Order(kind="soft", effects=(("force_lag", 1.0),), channels="displacements", samples=SMALL))


def test_the_same_seed_gives_the_same_case():
    order = Order(kind="stiff", effects=(("mains_hum", 1.0),), samples=SMALL)
    assert draw_case(np.random.default_rng(6), order) == draw_case(np.random.default_rng(6), order)


def test_margin_after_the_record_serves_early_channels():
    assert motion(RIG, DRIVEN)["time"][-1] > 0.25e-3 * DRIVEN.samples + 2e-3


def test_command_line_reads_effects():
    assert concealed("gap_step=0.5") == ("gap_step", 0.5)
    assert concealed("x_magnet") == ("x_magnet", 1.0)
    with pytest.raises(Exception, match="unknown effect"):
        concealed("gap_stp")
