"""A known filter of the recorder: the response of the analogue filter, through an impact too, in parts and on file."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import butter, freqs_zpk, lsim

from vibrojax.channels import channels, recorded
from vibrojax.contact import HuntCrossley
from vibrojax.effects import EFFECTS
from vibrojax.effects.filters import RecorderFilter
from vibrojax.excitation import Unforced, at_rest
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.model_file import read_model, write_model
from vibrojax.suspension import Linear

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
