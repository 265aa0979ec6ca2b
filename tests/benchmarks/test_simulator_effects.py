import dataclasses

import numpy as np
import pytest
from scipy import optimize

from benchmarks.simulator import EFFECTS, LISTED, UNLISTED, Hidden, Order, RecordPlan, draw_case, simulate
from benchmarks.simulator.example import RIG
from benchmarks.simulator.experiment import SAMPLING_STEP, motion, true_signals
from benchmarks.simulator.hidden import together
from benchmarks.simulator.kernel import base_motion, vector

CONTRACT = {
    *("coulomb_friction", "quadratic_drag", "cubic_stiffness", "constant_force", "hysteresis", "stop_compliance", "contact_adhesion"),
    *("back_stop", "base_harmonics", "cart_recoil", "frequency_drift", "gap_drift", "gap_step", "second_mode", "force_lag"),
    *("force_clipping", "mains_hum", "missing_stop", "gain_error", "time_offset", "deep_stop", "asymmetric_damping"),
    *("force_saturation", "quintic_stiffness", "power_law_damping", "sensor_high_pass", "recorder_low_pass", "nonlinear_reading"),
    *("reading_tone", "clock_drift", "zero_drift"),
}
FREE = RecordPlan(file="free.csv", kind="free-decay", gap=1.0, true_gap=1.0, samples=2001, release=-3e-3)
DROP = dataclasses.replace(FREE, file="drop.csv", kind="drop-test", gap=0.0, true_gap=0.0)
DRIVEN = RecordPlan(
    file="cart1.csv", kind="cart-excitation", gap=5e-4, true_gap=5e-4, samples=1601, excitation_frequency=7.5, base_phase=0.3, transient=400
)


def short(name, samples=1201):
    return draw_case(np.random.default_rng([17, 4]), Order(kind="stiff", effects=((name, 1.0),), samples=(801, samples)))


def test_every_effect_of_the_contract_is_listed_and_no_other():
    assert set(LISTED) == CONTRACT
    assert len(UNLISTED) >= 6
    assert all(name.startswith("x_") for name in UNLISTED)


@pytest.mark.parametrize("name", EFFECTS)
def test_half_the_steps_give_the_same_motion(name):
    case = short(name)
    for plan in (case.plans[0], case.plans[2], case.sealed[0]):
        plan = dataclasses.replace(plan, transient=min(plan.transient, 100))
        coarse, fine = (motion(case.rig, plan, case.hidden, refinement=refinement) for refinement in (1, 2))
        # a hundredth of the noise, after at most 0.3 s and a few impacts
        np.testing.assert_allclose(coarse["hammer_displacement"], fine["hammer_displacement"], rtol=0, atol=1e-7)
        np.testing.assert_allclose(coarse["impact_force"], fine["impact_force"], rtol=0, atol=1e-2)
        np.testing.assert_allclose(coarse["hammer_acceleration"], fine["hammer_acceleration"], rtol=0, atol=2e-2)


@pytest.mark.parametrize("name", sorted(set(EFFECTS) - {"missing_stop"}))
def test_every_effect_is_seen_in_a_reading(name):
    case = short(name, samples=3001)
    farthest = 0.0
    for plan in case.plans:
        plan = dataclasses.replace(plan, transient=0)
        with_it, without = (simulate(case.rig, plan, case.sensors, np.random.default_rng(0), hidden) for hidden in (case.hidden, Hidden()))
        farthest = max(farthest, *(float(np.abs(with_it[s.channel] - without[s.channel]).max() / s.noise) for s in case.sensors))
    assert farthest > 5.0


def test_dry_friction_takes_the_same_from_every_half_cycle():
    rig = dataclasses.replace(RIG, zeta=0.0)
    x = true_signals(rig, FREE, Hidden(motion={"friction_force": 0.02, "friction_speed": 1e-5}))["hammer_displacement"]
    turns = np.abs(x[1:-1][(x[1:-1] - x[:-2]) * (x[2:] - x[1:-1]) <= 0.0])
    np.testing.assert_allclose(-np.diff(turns), 2 * 0.02 / rig.k, rtol=0.02)


def test_drag_takes_its_work_from_the_energy():
    rig = dataclasses.replace(RIG, zeta=0.0)
    signals = true_signals(rig, FREE, Hidden(motion={"drag": 5.0}))
    x, v = signals["hammer_displacement"], signals["hammer_velocity"]
    energy = 0.5 * rig.m * v**2 + 0.5 * rig.k * x**2
    assert energy[0] - energy[-1] == pytest.approx(np.trapezoid(5.0 * np.abs(v) ** 3, dx=SAMPLING_STEP), rel=1e-5)


def test_asymmetric_damping_takes_energy_in_one_direction_and_gives_it_in_the_other():
    rig = dataclasses.replace(RIG, zeta=0.0)
    signals = true_signals(rig, FREE, Hidden(motion={"damping_difference": 2.0}))
    x, v = signals["hammer_displacement"], signals["hammer_velocity"]
    energy = 0.5 * rig.m * v**2 + 0.5 * rig.k * x**2
    np.testing.assert_allclose(energy[0] - energy, np.cumsum(np.abs(v) * v) * SAMPLING_STEP, atol=2e-3 * energy[0])
    assert np.ptp(energy) > 0.05 * energy[0]


def test_a_saturating_force_holds_its_greatest_force_beyond_the_threshold():
    """In an equilibrium that a constant force moves: k u + F_s min(u / u_s, 1) = F_0."""
    rig = dataclasses.replace(RIG, zeta=0.5)
    for push, place in ((0.5, 0.5 / (rig.k + 0.4 / 1e-3)), (5.0, (5.0 - 0.4) / rig.k)):
        hidden = Hidden(motion={"saturation_force": 0.4, "saturation_threshold": 1e-3, "constant_force": push})
        x = true_signals(rig, dataclasses.replace(FREE, samples=8001), hidden)["hammer_displacement"]
        assert (place < 1e-3) == (push < 1.0)
        assert x[-1] == pytest.approx(place, rel=1e-4)


def test_a_quintic_spring_shifts_the_equilibrium_under_a_constant_force():
    """k u + k_5 u^5 = F_0."""
    rig = dataclasses.replace(RIG, zeta=0.5)
    push, place = 0.5 * rig.k * 2e-3, optimize.brentq(lambda u: rig.k * (u + 0.4 * u**5 / 2e-3**4 - 1e-3), 0.0, 2e-3)
    hidden = Hidden(motion={"quintic": 0.4 * rig.k / 2e-3**4, "constant_force": push})
    x = true_signals(rig, dataclasses.replace(FREE, samples=8001), hidden)["hammer_displacement"]
    assert x[-1] == pytest.approx(place, rel=1e-4)
    assert place < 0.99e-3


@pytest.mark.parametrize(("exponent", "loss"), [(0.5, 0.1), (1.5, 1.0), (3.0, 80.0)])
def test_a_power_law_takes_its_work_from_the_energy(exponent, loss):
    rig = dataclasses.replace(RIG, zeta=0.0)
    hidden = Hidden(motion={"power_loss": loss, "power_exponent": exponent, "power_speed": 1e-6})
    signals = true_signals(rig, FREE, hidden)
    x, v = signals["hammer_displacement"], signals["hammer_velocity"]
    energy = 0.5 * rig.m * v**2 + 0.5 * rig.k * x**2
    assert energy[0] - energy[-1] == pytest.approx(np.trapezoid(loss * np.abs(v) ** (exponent + 1), dx=SAMPLING_STEP), rel=1e-3)
    assert energy[-1] < 0.95 * energy[0]


def test_the_recorder_filters_every_channel_alike_and_has_settled_before():
    case = short("recorder_low_pass")
    assert {fault.channel for fault in case.hidden.faults} == {sensor.channel for sensor in case.sensors}
    assert len({fault.time_constant for fault in case.hidden.faults}) == 1
    time, level = SAMPLING_STEP * np.arange(50), np.full(50, -3e-3)
    np.testing.assert_allclose(case.hidden.faults[0].distort("", time, level), level, rtol=1e-12)


def test_bouc_wen_with_one_way_of_motion_saturates():
    still = dataclasses.replace(RIG, f_n=1e-6, zeta=0.0)
    hidden = Hidden(motion={"hysteresis_force": 0.3, "hysteresis_a": 1e4, "hysteresis_b": 5e3, "hysteresis_g": 5e3, "constant_force": 1.0})
    acceleration = true_signals(still, dataclasses.replace(FREE, samples=801, release=0.0), hidden)["hammer_acceleration"]
    assert acceleration[0] == pytest.approx(1.0 / RIG.m)
    assert acceleration[-1] == pytest.approx((1.0 - 0.3) / RIG.m, rel=1e-6)


def test_sprung_stop_feels_the_impulse_that_the_hammer_loses():
    case = short("stop_compliance")
    signals = true_signals(case.rig, DROP, case.hidden)
    x, v = signals["hammer_displacement"], signals["hammer_velocity"]
    impulse = np.trapezoid(signals["impact_force"], dx=SAMPLING_STEP)
    suspension = np.trapezoid(case.rig.k * x + case.rig.c * v, dx=SAMPLING_STEP)
    assert impulse == pytest.approx(-case.rig.m * v[-1] - suspension, rel=2e-3)
    assert signals["impact_force"].min() < -0.01  # it rings on


def test_adhesion_pulls_only_while_the_hammer_leaves():
    signals = true_signals(RIG, DROP, Hidden(motion={"adhesion_force": 0.5, "adhesion_reach": 4e-4}))
    x, v, force = (signals[name] for name in ("hammer_displacement", "hammer_velocity", "impact_force"))
    outside = (x < 0.0) & (x > -4e-4)
    leaving, coming = outside & (v < -1e-6), outside & (v > 1e-6)
    assert leaving.sum() > 10 and coming.sum() > 10
    np.testing.assert_allclose(force[leaving], -0.5 * (1.0 + x[leaving] / 4e-4), atol=1e-12)
    np.testing.assert_array_equal(force[coming], 0.0)


def test_back_stop_turns_the_hammer_round_and_the_load_cell_does_not_feel_it():
    signals = true_signals(RIG, dataclasses.replace(FREE, release=3e-3), Hidden(motion={"back_gap": 2e-3}))
    assert -2.3e-3 < signals["hammer_displacement"].min() < -2e-3
    assert signals["impact_force"].max() == 0.0


def test_cart_and_hammer_exchange_momentum_through_the_stop():
    hidden = Hidden(motion={"cart_mass": 2.0, "cart_stiffness": 1e-3, "cart_damping": 0.0})
    signals = true_signals(dataclasses.replace(RIG, zeta=0.0), DROP, hidden)
    impulse = np.trapezoid(signals["impact_force"], dx=SAMPLING_STEP)
    assert 2.0 * signals["cart_velocity"][-1] == pytest.approx(impulse, rel=1e-3)
    moved = np.gradient(signals["cart_displacement"], SAMPLING_STEP)
    np.testing.assert_allclose(moved[1:-1], signals["cart_velocity"][1:-1], atol=2e-4)


def test_second_mode_conserves_energy_without_damping():
    mode = {"mode_mass": 0.03, "mode_stiffness": 0.03 * (2 * np.pi * 30.0) ** 2}
    rig = dataclasses.replace(RIG, zeta=0.0)
    signals = true_signals(rig, dataclasses.replace(FREE, samples=4001), Hidden(motion=mode))
    x, a = signals["hammer_displacement"], signals["hammer_acceleration"]
    assert np.abs(rig.m * a + rig.k * x).max() > 0.1  # it pulls
    pair = rig.m + mode["mode_mass"]
    slow = np.sqrt(rig.k / pair)  # the mode follows: nearly one mass
    assert np.abs(x[-1] - FREE.release * np.cos(slow * signals["time"][-1])) < 0.05 * abs(FREE.release)


def test_cart_moves_as_its_harmonics_and_its_drifting_frequency_say():
    p = vector(base_amplitude=2e-3, omega_exc=40.0, second_harmonic=0.05, second_phase=0.4, third_harmonic=0.02, frequency_rate=0.01)
    t, h = 1.3, 1e-5
    angle = 40.0 * (t + 0.005 * t**2)
    y = 2e-3 * (np.sin(angle) + 0.05 * np.sin(2 * angle + 0.4) + 0.02 * np.sin(3 * angle))
    assert base_motion(t, p)[0] == pytest.approx(y)
    before, after = base_motion(t - h, p), base_motion(t + h, p)
    assert base_motion(t, p)[1] == pytest.approx((after[0] - before[0]) / (2 * h), rel=1e-6)
    constant = vector(base_amplitude=2e-3, omega_exc=40.0, second_harmonic=0.05, second_phase=0.4)
    before, after = base_motion(t - h, constant), base_motion(t + h, constant)
    assert base_motion(t, constant)[2] == pytest.approx((after[1] - before[1]) / (2 * h), rel=1e-6)


def test_gap_step_acts_in_one_record_from_its_time_on():
    case = short("gap_step")
    ((file, numbers),) = case.hidden.records.items()
    for plan in case.plans:
        with_it, without = (true_signals(case.rig, plan, hidden)["hammer_displacement"] for hidden in (case.hidden, Hidden()))
        different = np.nonzero(with_it != without)[0]
        assert (len(different) > 0) == (plan.file == file)
        if len(different):
            assert different[0] * SAMPLING_STEP >= numbers["jump_time"]


def test_wear_counts_from_the_first_sample_of_the_record():
    hidden = Hidden(motion={"wear_impulse": 0.1})
    worn, new = (true_signals(RIG, dataclasses.replace(DROP, samples=3001), each)["impact_force"] for each in (hidden, Hidden()))
    assert 0.5 < worn[:250].max() / new[:250].max() < 0.95
    assert worn[2000:].max() < 0.3 * new[2000:].max()


@pytest.mark.parametrize(
    ("first", "second"), [("stop_compliance", "contact_adhesion"), ("cart_recoil", "hysteresis"), ("gain_error", "force_lag")]
)
def test_two_effects_act_together(first, second):
    order = Order(kind="soft", effects=((first, 1.0), (second, 0.7)), samples=(801, 1201))
    case = draw_case(np.random.default_rng(3), order)
    assert len(case.parts) == 2
    hidden = case.hidden
    assert hidden.motion == dict(case.parts[0].motion) | dict(case.parts[1].motion)
    assert len(hidden.faults) == sum(len(part.faults) for part in case.parts)


def test_one_effect_twice_is_refused():
    with pytest.raises(ValueError, match="two effects set"):
        together([Hidden(motion={"drag": 1.0}), Hidden(motion={"drag": 2.0})])
    with pytest.raises(ValueError, match="two effects set"):
        together([Hidden(records={"a": {"gap_jump": 1.0}}), Hidden(records={"a": {"gap_jump": 2.0}})])


def test_unknown_parameters_are_refused():
    with pytest.raises(ValueError, match="unknown parameters"):
        true_signals(RIG, DRIVEN, Hidden(motion={"drga": 1.0}))


def test_a_hammer_that_runs_away_is_refused():
    with pytest.raises(ArithmeticError, match=r"runs away in free\.csv"):
        true_signals(RIG, FREE, Hidden(motion={"cubic": -1e9}))


def test_effects_without_memory_cost_no_state():
    plain = motion(RIG, DRIVEN)
    with_memory = motion(RIG, DRIVEN, Hidden(motion={"hysteresis_force": 1e-300, "hysteresis_a": 1.0}))
    for name in plain:
        np.testing.assert_allclose(plain[name], with_memory[name], rtol=1e-6, atol=1e-9)
