"""Filters of sensors and recorder: their response, their memory, and a record that is read in parts."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import butter, freqs_zpk, lfilter, lsim

from benchmarks.simulator.faults import HighPass
from tests.effects import rig
from tests.effects.scales import SCALES
from tests.effects.sensor import continued, record, shown, unheard
from vibrojax.channels import EVERY_CHANNEL, channels, recorded
from vibrojax.contact import HuntCrossley
from vibrojax.effects import EFFECTS, ForceLag, Motion, RecorderLowPass, SensorHighPass
from vibrojax.effects.filters import RecorderFilter
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.model_file import read_model, write_model
from vibrojax.suspension import Linear

# Force lag


def test_is_the_recursive_filter_of_first_order():
    reading, force, ts = shown(ForceLag(1.5e-3))
    a = np.exp(-(ts[1] - ts[0]) / 1.5e-3)
    np.testing.assert_allclose(reading, lfilter([1 - a], [1, -a], force), atol=1e-12 * force.max())
    assert unheard(ForceLag(1.5e-3))


def test_keeps_the_impulse_and_comes_late_by_the_time_constant_less_half_a_sample():
    reading, force, ts = shown(ForceLag(1.5e-3))
    one = slice(0, int(np.flatnonzero(force)[0]) + 100)
    reading, force, ts = reading[one], force[one], ts[one]
    dt = ts[1] - ts[0]
    np.testing.assert_allclose(reading.sum(), force.sum(), rtol=1e-6)
    late = (reading @ ts) / reading.sum() - (force @ ts) / force.sum()
    np.testing.assert_allclose(late, dt / np.expm1(dt / 1.5e-3), rtol=1e-4)
    np.testing.assert_allclose(late, 1.5e-3 - dt / 2, rtol=0.02)


def test_a_lag_of_zero_is_the_ideal_channel():
    reading, force, _ = shown(ForceLag(0.0))
    np.testing.assert_array_equal(reading, force)


def test_force_lag_a_stretch_can_begin_anywhere():
    in_one, in_two, moved = continued(ForceLag(8e-3), 341)
    assert moved > 1e-6
    np.testing.assert_allclose(in_two, in_one, atol=1e-12, rtol=0)


def test_begins_where_the_records_show_a_delay_but_never_comes_early():
    late, early, plain = (
        [one.lag for (one,) in ForceLag.probe.candidates(dataclasses.replace(SCALES, lags={"impact_force": delay}))]
        for delay in (1.7e-3, -1.7e-3, 0.0)
    )
    assert late == [*plain, 1.7e-3]
    assert early == plain


# Sensor high pass


DISCHARGE = SensorHighPass(0.05, "impact_force")


@pytest.mark.parametrize("channel", ["impact_force", "hammer_acceleration"])
def test_is_the_recursive_high_pass_of_first_order(channel):
    reading, value, ts = shown(SensorHighPass(0.05, channel))
    a = np.exp(-(ts[1] - ts[0]) / 0.05)
    expected = lfilter([a, -a], [1, -a], value, zi=[(1 - a) * value[0]])[0]
    np.testing.assert_allclose(reading, expected, atol=1e-12 * np.abs(value).max())
    assert unheard(SensorHighPass(0.05, channel))


def test_agrees_with_the_independent_simulator():
    """Which begins before the record: the memory at the first sample says so."""
    reading, force, ts = shown(DISCHARGE)
    np.testing.assert_allclose(
        reading, HighPass(channel="impact_force", time_constant=0.05).distort("", ts, force), atol=1e-12 * force.max()
    )
    assert force[0] == 0.0


def test_reads_below_zero_after_an_impact_by_the_impulse_over_the_time_constant():
    reading, force, ts = shown(SensorHighPass(10.0, "impact_force"))
    after = np.flatnonzero(np.diff((force > 0).astype(int)) == -1)[0] + 1
    np.testing.assert_allclose(reading[after], -np.trapezoid(force[: after + 1], ts[: after + 1]) / 10.0, rtol=1e-2)
    assert reading[after] < 0 == force[after]


def test_memory_obeys_its_recursion():
    reading, force, ts = shown(DISCHARGE)
    d, a = reading - force, np.exp(-np.diff(ts) / 0.05)
    np.testing.assert_allclose(d[1:], a * d[:-1] + (a - 1) * force[1:], atol=1e-12 * force.max())


@pytest.mark.parametrize("cut", [1, 90, 400])
def test_sensor_high_pass_a_stretch_can_begin_anywhere(cut):
    in_one, in_two, moved = continued(DISCHARGE, cut)
    assert moved > 1e-6
    np.testing.assert_allclose(in_two, in_one, atol=1e-12, rtol=0)


def test_off_it_never_discharges_and_twice_as_strong_it_does_so_in_half_the_time():
    reading, force, _ = shown(DISCHARGE.scaled(0.0))
    np.testing.assert_allclose(reading, force, atol=1e-12 * force.max())
    assert float(DISCHARGE.scaled(2.0).time_constant) == pytest.approx(0.025)
    assert jnp.isfinite(DISCHARGE.scaled(jnp.asarray(0.0)).time_constant)


def test_candidates_are_force_cells_and_accelerometers_from_contacts_to_records():
    scales = dataclasses.replace(SCALES, channels=("hammer_displacement", "impact_force", "hammer_acceleration"))
    found = [one for (one,) in SensorHighPass.probe.candidates(scales)]
    assert {one.of_channel for one in found} == {"impact_force", "hammer_acceleration"}
    constants = [one.time_constant for one in found if one.of_channel == "impact_force"]
    assert (constants[0], constants[-1]) == (pytest.approx(3 * scales.contact_time), pytest.approx(9.0))
    assert max(np.diff(np.log(constants))) <= np.log(3.0)


# Recorder low pass


FILTER = RecorderLowPass(1.5e-3)


def read(effect, names=EVERY_CHANNEL):
    ideal, trajectory = record()
    motion = rig.system().motion(trajectory.ts, trajectory.u, trajectory.v, trajectory.own, trajectory.in_contact)
    given = {name: ideal[name] for name in names}
    return effect.read(given, motion, jnp.zeros((len(trajectory.ts), len(effect.own_states)))), given, np.asarray(trajectory.ts)


def test_every_channel_goes_through_the_same_filter_and_starts_settled():
    ideal, trajectory = record()
    own = jnp.zeros((len(trajectory.ts), len(FILTER.own_states)))
    readings = channels(rig.system(FILTER), dataclasses.replace(trajectory, own=own))
    assert set(readings) == set(ideal) == set(EVERY_CHANNEL)
    a = np.exp(-5e-4 / 1.5e-3)
    for name, value in ideal.items():
        expected = lfilter([1 - a], [1, -a], value, zi=[a * value[0]])[0]
        np.testing.assert_allclose(readings[name], expected, atol=1e-12 * np.abs(value).max(), rtol=0, err_msg=name)


def test_channels_that_are_not_recorded_stay_away():
    readings, given, _ = read(FILTER, ("cart_acceleration",))
    whole, _, _ = read(FILTER)
    assert set(readings) == {"cart_acceleration"}
    np.testing.assert_array_equal(readings["cart_acceleration"], whole["cart_acceleration"])
    assert read(FILTER, ())[0] == {}


def test_all_channels_come_equally_late():
    """A sine of the cart by atan(Omega tau), less half a sample."""
    readings, given, ts = read(FILTER)
    late = np.arctan(rig.OMEGA * 1.5e-3) / rig.OMEGA - 2.5e-4
    y = readings["cart_displacement"][60:]
    np.testing.assert_allclose(y, np.cos(rig.OMEGA * late) * rig.sine(ts[60:] - late)[0], atol=2e-3 * rig.A0)


@pytest.mark.parametrize("cut", [1, 90, 400])
def test_recorder_low_pass_a_stretch_can_begin_anywhere(cut):
    in_one, in_two, moved = continued(FILTER, cut)
    assert moved > 1e-6
    np.testing.assert_allclose(in_two, in_one, atol=1e-12, rtol=0)


def test_a_time_constant_of_zero_is_an_ideal_recorder():
    readings, given, _ = read(RecorderLowPass(0.0))
    for name in EVERY_CHANNEL:
        np.testing.assert_array_equal(readings[name], given[name])


def test_a_recorder_low_pass_is_undone_whichever_memories_are_known():
    followed = RecorderLowPass(1.5e-3, channels=("impact_force", "hammer_acceleration"))
    readings, given, ts = read(followed)
    assert [state.name for state in followed.own_states] == list(followed.channels)
    undone, whole = followed.undone(readings, jnp.asarray(ts)), read(FILTER)[0]
    for name in EVERY_CHANNEL:
        np.testing.assert_array_equal(readings[name], whole[name])
        np.testing.assert_allclose(undone[name], given[name], atol=1e-10 * np.abs(given[name]).max(), rtol=0, err_msg=name)


def test_a_memory_belongs_to_its_channel():
    followed = RecorderLowPass(1.5e-3, channels=("hammer_acceleration", "impact_force"))
    given = {name: jnp.zeros(3) for name in ("impact_force", "hammer_acceleration", "cart_displacement")}
    nothing = jnp.zeros(3)
    motion = Motion(1e-3 * jnp.arange(3.0), nothing, nothing, nothing, nothing, nothing > 0)
    shown = followed.read(given, motion, jnp.array([[2.0, 7.0]]))
    assert {name: float(values[0]) for name, values in shown.items()} == {
        "impact_force": 7.0,
        "hammer_acceleration": 2.0,
        "cart_displacement": 0.0,
    }


def test_a_fit_follows_the_channels_that_are_recorded():
    assert {one.channels for (one,) in RecorderLowPass.probe.candidates(SCALES)} == {tuple(SCALES.channels)}


def test_candidates_are_cut_offs_between_the_suspension_and_half_the_sampling_rate():
    cut_offs = [1 / (2 * np.pi * one.time_constant) for (one,) in RecorderLowPass.probe.candidates(SCALES)]
    assert (cut_offs[0], cut_offs[-1]) == (pytest.approx(0.7 * SCALES.f_n), pytest.approx(0.4 / SCALES.sampling))
    assert max(np.diff(np.log(cut_offs))) <= np.log(2.0)


# Recorder filter. A known filter of the recorder: the response of the analogue filter, through an impact too, in parts and on file.


RATE = 3125.0
CASES = [("lowpass", 4, 1100.0), ("lowpass", 3, 300.0), ("lowpass", 1, 200.0), ("highpass", 2, 20.0), ("highpass", 1, 5.0)]


def tone(ts, frequency=60.0):
    omega = 2.0 * np.pi * frequency
    return {"impact_force": jnp.sin(omega * ts)}, {"impact_force": omega * jnp.cos(omega * ts)}


@pytest.mark.parametrize(("band", "order", "corner"), CASES)
def test_a_tone_passes_with_the_response_of_the_analogue_filter(band, order, corner):
    ts, omega = jnp.arange(3000.0) / RATE, 2.0 * np.pi * 60.0
    filter_ = RecorderFilter("impact_force", band, order, corner)
    shown, rates, _ = filter_.passed(*tone(ts), ts, jnp.zeros((3000, order)))
    zeros, poles, gain = butter(order, 2.0 * np.pi * corner, btype=band[:-4], analog=True, output="zpk")
    (response,) = freqs_zpk(zeros, poles, gain, worN=[omega])[1]
    late, turning = slice(2500, None), response * np.exp(1j * omega * np.asarray(ts))
    np.testing.assert_allclose(shown["impact_force"][late], turning.imag[late], atol=2e-5)
    np.testing.assert_allclose(rates["impact_force"][late], omega * turning.real[late], atol=0.02)


@pytest.mark.parametrize(("band", "order", "corner"), CASES)
def test_a_record_in_parts_is_read_as_the_whole(band, order, corner):
    ts = jnp.arange(40.0) / RATE
    filter_ = RecorderFilter("impact_force", band, order, corner)
    begin = jnp.broadcast_to(jnp.arange(1.0, order + 1.0), (40, order))
    shown, _, memory = filter_.passed(*tone(ts), ts, begin)
    np.testing.assert_allclose(memory[0], begin[0])
    rest, _, _ = filter_.passed(*tone(ts[17:]), ts[17:], memory[17:])
    np.testing.assert_allclose(rest["impact_force"], shown["impact_force"][17:], rtol=1e-12, atol=1e-12)


def test_a_channel_that_is_not_there_stays_away():
    ts = jnp.arange(10.0) / RATE
    filter_ = RecorderFilter("cart_acceleration", "lowpass", 2, 100.0)
    shown, _, memory = filter_.passed(*tone(ts), ts, jnp.ones((10, 2)))
    assert set(shown) == {"impact_force"}
    np.testing.assert_allclose(memory, 1.0)


RIG = Model(mass=0.62, suspension=Linear(0.009, 4.1), law=HuntCrossley(1.1e7, 1.62, 0.48))
NAMES = ("hammer_displacement", "hammer_acceleration", "impact_force")


def along(model, ts):
    """Trajectory into the stop at 0.15 m/s from 4 mm before it."""
    system = model.system(gap=0.0, base=at_rest(), applied=Unforced())
    return system, Landing()(system, ts, jnp.array([-0.004, 0.15]))


def test_an_impact_is_read_as_by_a_filter_on_a_hundred_times_as_many_samples():
    filters = tuple(RecorderFilter(name, "lowpass", 4, 1100.0) for name in NAMES)
    coarse, fine = jnp.arange(128.0) / RATE, jnp.arange(12701.0) / (100.0 * RATE)
    found = channels(*along(dataclasses.replace(RIG, recorder=filters), coarse))
    ideal = channels(*along(RIG, fine))
    analogue = butter(4, 2.0 * np.pi * 1100.0, analog=True)
    assert float(jnp.max(ideal["impact_force"])) > 30.0
    for name, error in zip(NAMES, (2e-8, 0.2, 0.12), strict=True):
        settled = np.asarray(ideal[name] - ideal[name][0])
        expected = lsim(analogue, settled, np.asarray(fine))[1][::100] + float(ideal[name][0])
        begin = 20  # the memory of what was before the record has died down
        np.testing.assert_allclose(found[name][begin:], expected[begin:], atol=error)


def test_the_model_keeps_it_on_file_and_a_rig_has_none(tmp_path):
    model = dataclasses.replace(RIG, recorder=(RecorderFilter("impact_force", "highpass", 1, 0.2),))
    write_model(model, tmp_path / "model.json")
    assert read_model(tmp_path / "model.json") == model
    assert model.rig.recorder == () and model.replace({"n": 1.5}).recorder == model.recorder
    assert "recorder_filter" not in EFFECTS
    system, trajectory = along(model, jnp.arange(20.0) / RATE)
    assert recorded(system, trajectory)[1].shape == (20, 1)
