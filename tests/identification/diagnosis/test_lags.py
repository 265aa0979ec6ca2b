"""The delay of a channel against the others, estimated from the records alone; their motion is in closed form."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.lags import _test_function, lags, misalignment
from identification.experiment import Record

DT, MASS = 5e-4, 0.5
DURATION = 3e-3
TOUCHES = np.array([0.113, 0.302, 0.517, 0.744, 0.951])
BLOWS = np.array([40.0, 31.0, 52.0, 22.0, 38.0])
NOISE = {"hammer_displacement": 1e-5, "hammer_acceleration": 0.05, "impact_force": 0.15}


def record(*, at: np.ndarray | None = None, omits: tuple[str, ...] = (), noise: float = 1.0, seed: int = 4, **late: float) -> Record:
    """A hammer on a soft spring whose stop gives it blows of half a sine, with some channels late by so many seconds."""
    t, draws = DT * np.arange(2400) if at is None else at, np.random.default_rng(seed)
    samples = len(t)
    ideal = {"hammer_displacement": _displacement, "hammer_acceleration": _acceleration, "impact_force": _force}
    shown = {name: channel(t - late.get(name, 0.0)) for name, channel in ideal.items() if name not in omits}
    channels = {name: values + noise * NOISE[name] * draws.standard_normal(samples) for name, values in shown.items()}
    return Record(file="made.csv", kind="drop-test", gap=0.0, time=t, channels=channels, noise=NOISE)


def _force(t):
    since = t[:, None] - TOUCHES
    return np.where((since > 0) & (since < DURATION), BLOWS * np.sin(np.pi * since / DURATION), 0.0).sum(axis=1)


def _slow(t):
    return 4e-3 * np.sin(2 * np.pi * 5.0 * t), -4e-3 * (2 * np.pi * 5.0) ** 2 * np.sin(2 * np.pi * 5.0 * t)


def _acceleration(t):
    return -_force(t) / MASS + _slow(t)[1]


def _displacement(t):
    """Twice the integral of the blows, which go on as straight lines after them, and the slow motion."""
    since, omega = np.maximum(t[:, None] - TOUCHES, 0.0), np.pi / DURATION
    within = np.minimum(since, DURATION)
    blow = within / omega - np.sin(omega * within) / omega**2 + 2.0 / omega * (since - within)
    return -(BLOWS / MASS * blow).sum(axis=1) + _slow(t)[0]


def test_the_motion_is_the_integral_of_the_acceleration():
    t = np.linspace(0.1, 0.12, 20001)
    np.testing.assert_allclose(np.gradient(np.gradient(_displacement(t), t), t)[9:-9], _acceleration(t)[9:-9], atol=0.2)


@pytest.mark.parametrize("channel", NOISE)
@pytest.mark.parametrize("delay", [2e-3, -4e-3])
def test_the_late_channel_of_three_is_identified_with_its_sign(channel, delay):
    found = lags([record(**{channel: delay})])
    assert found == {channel: pytest.approx(delay, abs=DT)}


def test_of_two_channels_either_may_be_the_one():
    found = lags([record(omits=("impact_force",), hammer_acceleration=-2e-3)])
    assert found == {"hammer_acceleration": pytest.approx(-2e-3, abs=DT), "hammer_displacement": pytest.approx(2e-3, abs=DT)}


@pytest.mark.parametrize("noise", [0.0, 1.0, 4.0])
@pytest.mark.parametrize("omits", [(), ("hammer_acceleration",), ("impact_force",), ("hammer_displacement", "impact_force")])
def test_channels_that_agree_are_not_late(noise, omits):
    assert lags([record(noise=noise, omits=omits)]) == {}


@pytest.mark.parametrize("omits", [(), *((name,) for name in NOISE)], ids=["all three", *(f"no {name}" for name in NOISE)])
@pytest.mark.parametrize("delay", [6e-4, 2e-3])
@pytest.mark.parametrize("rate", [5e3, 1e4, 2e4, 5e4])
def test_a_delay_is_estimated_without_bias_however_fast_the_sampling(rate, delay, omits):
    """Third differences over few samples are all noise then, in which a largest correlation is anywhere; those over many show most."""
    t = np.arange(0.0, 1.2, 1.0 / rate)
    for seed in range(3):
        assert lags([record(at=t, omits=omits, seed=seed)]) == {}
        late = lags([record(at=t, omits=omits, seed=seed, hammer_displacement=-delay, hammer_acceleration=-delay)])
        assert [late[name] for name in late if name == "impact_force"] == [pytest.approx(delay, abs=5e-5)] * ("impact_force" not in omits)


def test_a_kinked_line_is_no_jerk():
    """The test functions are blind to whatever a jerk does not hold, however few their samples are."""
    for half in (4, 8, 64):
        for order in (1, 3):
            function = _test_function(half, order)
            places = np.arange(len(function)) - (len(function) - 1) / 2
            assert len(function) == 2 * half + 4
            np.testing.assert_allclose([function @ (places / half) ** power for power in range(order)], 0.0, atol=1e-12)
            assert abs(function @ places**order) > 1.0


def test_a_delay_within_two_samples_is_left_to_the_score_test():
    assert lags([record(hammer_acceleration=2 * DT)]) == {}


def test_one_odd_record_among_three_is_not_the_rule():
    assert lags([record(), record(), record(hammer_acceleration=3e-3)]) == {}


def test_records_that_do_not_agree_give_no_delay():
    assert lags([record(), record(impact_force=3e-3)]) == {}
    assert lags([record(impact_force=2e-3), record(impact_force=6e-3)]) == {}


def test_records_in_which_nothing_happens_have_no_say():
    """No impact within them: the load cell is silent."""
    quiet = [record(at=DT * np.arange(200)), record(at=0.12 + DT * np.arange(340))]
    assert lags([*quiet, record(impact_force=3e-3)]) == {"impact_force": pytest.approx(3e-3, abs=DT)}


def test_channels_that_all_differ_give_no_delay():
    assert lags([record(hammer_acceleration=3e-3, impact_force=-3e-3)]) == {}


def test_records_need_not_have_the_same_channels():
    found = lags(
        [record(omits=("impact_force",), hammer_displacement=3e-3), record(omits=("hammer_acceleration",), hammer_displacement=3e-3)]
    )
    assert found["hammer_displacement"] == pytest.approx(3e-3, abs=DT)


def test_a_delay_beyond_the_longest_is_none():
    assert lags([record(hammer_acceleration=0.03)]) == {}


def test_a_hammer_that_is_led_shows_none():
    assert lags([dataclasses.replace(record(hammer_acceleration=3e-3), kind="prescribed")]) == {}


@pytest.mark.parametrize("lost", [slice(None, None, 4), slice(1200, 1500)], ids=["every fourth", "a pause"])
def test_samples_that_are_not_there_do_not_change_the_delay(lost):
    t = np.delete(DT * np.arange(2400), lost)
    assert lags([record(at=t, hammer_acceleration=6e-3)]) == {"hammer_acceleration": pytest.approx(6e-3, abs=DT)}


def test_noise_alone_and_a_record_of_a_few_samples_show_nothing():
    silent = record(noise=0.0)
    draws = np.random.default_rng(1)
    for name, values in silent.channels.items():
        values[:] = NOISE[name] * draws.standard_normal(len(values))
    assert lags([silent]) == {}
    assert lags([record(at=DT * np.arange(12), hammer_acceleration=3e-3)]) == {}


def test_samples_that_are_missing_are_bridged():
    late = record(hammer_acceleration=3e-3)
    late.channels["hammer_displacement"][700:720] = np.nan
    assert lags([late]) == {"hammer_acceleration": pytest.approx(3e-3, abs=DT)}


def test_a_channel_has_most_in_common_with_the_others_as_late_as_it_is():
    """Its clock loses 4 ms in a second: no one delay brings it back."""
    ppm = 4000.0
    t = DT * np.arange(2400)
    one = record()
    channel = "hammer_displacement"
    late = dataclasses.replace(one, channels=one.channels | {channel: np.interp(t * (1.0 - 1e-6 * ppm), t, one.channels[channel])})
    misfit = misalignment([late], channel)
    by_drift = {factor: misfit(lambda at, factor=factor: factor * 1e-6 * ppm * at) for factor in np.linspace(-0.5, 2.0, 26)}
    by_delay = [misfit(lambda at, delay=delay: delay + 0.0 * at) for delay in np.linspace(-5e-3, 5e-3, 41)]
    assert min(by_drift, key=by_drift.get) == pytest.approx(1.0, abs=0.11)
    assert min(by_drift.values()) < 2.0 * min(by_delay)
