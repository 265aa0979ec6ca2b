"""Restitution read off records whose own is known, whatever the fitted motion has."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lfilter

from identification.result.rebounds import rebounds
from tests.identification.report.made_rebounds import CONTACT, DT, FREE, LAW, NOISE, ON_A_SPRING, collision
from vibrojax.contact import Newton, restitution
from vibrojax.effects import CoulombFriction, DeepStop, TimeOffset

SPEEDS = (0.05, 0.2, 0.8)


@pytest.mark.parametrize("model", [ON_A_SPRING, FREE], ids=["spring", "free"])
@pytest.mark.parametrize("channel", ["relative_displacement", "hammer_displacement"])
@pytest.mark.parametrize("fitted", [0.9, 0.4])
def test_is_the_recorded_one_within_its_error_whatever_the_fitted_motion_does(model, channel, fitted):
    found = rebounds([collision(v, 0.7, fitted, model=model, seed=i, channel=channel) for i, v in enumerate(SPEEDS)], model)
    assert [one.file for one in found] == [f"at-{v:g}.csv" for v in SPEEDS]
    for one, speed in zip(found, SPEEDS, strict=True):
        assert one.approach_speed == pytest.approx(speed, rel=0.01)
        assert abs(one.restitution - 0.7) < 4 * one.stderr + 1e-4  # the damping of the free vibration is linearised
        assert one.stderr < 0.005
        by_law = (one.approach_speed, float(restitution(LAW, model.mass, jnp.asarray([one.approach_speed]))[0]))
        assert (one.fitted_speed, one.fitted) == pytest.approx(by_law if model is FREE else (1.02 * speed, fitted))


def test_the_error_is_that_of_the_scatter():
    read = rebounds([collision(0.1, 0.7, 0.8, seed=seed) for seed in range(60)], ON_A_SPRING)
    found = np.array([(one.restitution, one.stderr) for one in read])
    assert found[:, 0].std() == pytest.approx(np.median(found[:, 1]), rel=0.3)


def test_flight_that_is_too_short_or_unknown_gives_no_restitution():
    assert rebounds([collision(0.2, 0.7, 0.7, samples=18)], ON_A_SPRING) == []
    whole = collision(0.2, 0.7, 0.7)
    assert rebounds([dataclasses.replace(whole, measured={})], ON_A_SPRING) == []
    jumps = np.where(np.arange(120) < 57, 0, 1)  # another window begins three samples before the touch
    assert rebounds([dataclasses.replace(whole, window=jumps)], ON_A_SPRING) == []
    assert len(rebounds([whole], ON_A_SPRING)) == 1


def test_a_prescribed_or_grazing_motion_gives_no_restitution():
    whole = collision(0.2, 0.7, 0.7)
    assert rebounds([dataclasses.replace(whole, kind="prescribed")], ON_A_SPRING) == []
    slow = {name: 0.1 * shown for name, shown in whole.predicted.items()}
    assert rebounds([dataclasses.replace(whole, predicted=slow, relative_velocity=0.1 * whole.relative_velocity)], ON_A_SPRING) == []


def test_a_window_that_begins_in_a_contact_gives_the_restitution_of_a_free_hammer_alone():
    between = np.where(np.arange(120) < 64, 0, 1)
    in_flight = np.where(np.arange(120) < 57, 0, 1)
    assert rebounds([dataclasses.replace(collision(0.2, 0.7, 0.7), window=between)], ON_A_SPRING) == []
    for windows in (between, in_flight):
        (found,) = rebounds([dataclasses.replace(collision(0.2, 0.7, 0.7, model=FREE), window=windows)], FREE)
        assert found.restitution == pytest.approx(0.7, abs=4 * found.stderr) and found.by_law


@pytest.mark.parametrize("first", [0, 120 - CONTACT])
def test_a_contact_at_an_end_of_the_record_has_no_flight_beside_it(first):
    in_contact = np.zeros(120, bool)
    in_contact[first : first + CONTACT] = True
    assert rebounds([dataclasses.replace(collision(0.2, 0.7, 0.7), in_contact=in_contact)], ON_A_SPRING) == []


def test_an_effect_beside_the_stop_needs_the_fitted_motion():
    (found,) = rebounds([collision(0.5, 0.7, 0.6, model=FREE)], dataclasses.replace(FREE, effects=(CoulombFriction(0.1),)))
    assert (found.by_law, found.fitted) == (False, pytest.approx(0.6))


def test_samples_that_are_missing_are_left_out():
    gappy = collision(0.2, 0.7, 0.7)
    gappy.measured["relative_displacement"][[40, 41, 90]] = np.nan
    (found,) = rebounds([gappy], ON_A_SPRING)
    assert found.restitution == pytest.approx(0.7, abs=4 * found.stderr + 1e-4)


def test_a_free_hammer_meets_the_law_with_what_effects_make_of_it():
    deep = dataclasses.replace(FREE, effects=(DeepStop(stiffness=1e7, depth=1e-5, damping=300.0),))
    plain, backed = (rebounds([collision(0.5, 0.7, 0.7, model=FREE)], model)[0].fitted for model in (FREE, deep))
    assert backed < plain - 0.1


@pytest.mark.parametrize("model", [ON_A_SPRING, FREE], ids=["spring", "free"])
def test_a_rigid_stop_is_met_between_two_samples(model):
    rigid = dataclasses.replace(model, law=Newton(restitution=0.6))
    (found,) = rebounds([collision(0.2, 0.7, 0.6, model=model, contact=0)], rigid)
    assert abs(found.restitution - 0.7) < 4 * found.stderr + 1e-3
    assert found.fitted == pytest.approx(0.6, abs=1e-3)


@pytest.mark.parametrize("model", [ON_A_SPRING, FREE], ids=["spring", "free"])
@pytest.mark.parametrize("late", [-8, -3, -1, 0, 1, 3, 8])
def test_a_rigid_stop_is_met_when_the_record_says_so_and_not_when_the_fit_does(model, late):
    found = _rigid(model, late)
    slowed = 1.5e-3 if model is ON_A_SPRING else 0.0  # by spring and damping between the two instants, or two samples
    assert len(found) == 40
    assert np.sqrt(np.mean((found[:, 0] - 0.7) ** 2)) < 1.3 * np.median(found[:, 1]) + slowed
    assert found[:, 0].std() < 1.3 * np.median(found[:, 1]) < 1.3e-3


@pytest.mark.parametrize("samples", [24, 40])
def test_no_rebound_is_lost_beside_the_end_of_a_record(samples):
    found = _rigid(FREE, 0, samples=samples)
    assert len(found) == 40
    assert found[:, 0].std() < 1.3 * np.median(found[:, 1])


def test_a_bounce_beside_a_sampled_contact_is_part_of_it():
    """As where a stiff stop is met twice within a few samples."""
    whole = collision(0.2, 0.7, 0.7, model=FREE, contact=0)
    beside = np.zeros(120, bool)
    beside[63:65] = True
    (found,) = rebounds([dataclasses.replace(whole, in_contact=beside)], FREE)
    assert found.restitution == pytest.approx(0.7, abs=4 * found.stderr + 1e-3)


def _rigid(model, late: int, *, samples: int = 120) -> np.ndarray:
    """(40, 2): restitution and error of as many records, each a rebound, beside one that comes so many samples later."""
    rigid, read = dataclasses.replace(model, law=Newton(restitution=0.6)), []
    for seed in range(40):
        record = collision(0.2, 0.7, 0.6, model=model, contact=0, seed=seed, samples=samples)
        shifted = {"predicted": {name: _late(values, late) for name, values in record.predicted.items()}}
        record = dataclasses.replace(record, **shifted, relative_velocity=_late(record.relative_velocity, late))
        read += [(one.restitution, one.stderr) for one in rebounds([record], rigid)]
    return np.array(read)


def _late(values, samples):
    """The same later, or earlier, with flights that go on in straight lines."""
    places = np.arange(len(values)) - samples
    inside = np.interp(places, np.arange(len(values)), values)
    before, after = values[0] + places * (values[1] - values[0]), values[-1] + (places - len(values) + 1) * (values[-1] - values[-2])
    return np.where(places < 0, before, np.where(places >= len(values), after, inside))


def test_contacts_with_and_without_samples_in_them_are_found_in_one_record():
    soft, hard = collision(0.2, 0.7, 0.6, model=FREE), collision(0.3, 0.6, 0.6, model=FREE, contact=0)
    span = DT * len(soft.time)
    both = dataclasses.replace(
        soft,
        time=np.concatenate([soft.time, hard.time + span]),
        measured={name: np.concatenate([values, hard.measured[name]]) for name, values in soft.measured.items()},
        predicted={name: np.concatenate([values, hard.predicted[name]]) for name, values in soft.predicted.items()},
        **{name: np.concatenate([getattr(soft, name), getattr(hard, name)]) for name in ("relative_velocity", "in_contact")},
        window=np.repeat([0, 1], 120),
    )
    found = rebounds([both], dataclasses.replace(FREE, effects=(CoulombFriction(0.1),)))
    assert [one.restitution for one in found] == [pytest.approx(0.7, abs=1e-3), pytest.approx(0.6, abs=1e-3)]


def test_a_record_of_another_kind_that_holds_no_contact_changes_nothing():
    silent = dataclasses.replace(collision(0.2, 0.7, 0.7, model=FREE), kind="free-decay", in_contact=np.zeros(120, bool))
    silent = dataclasses.replace(silent, relative_velocity=np.full(120, 0.2))
    found = rebounds([collision(0.2, 0.7, 0.6, model=FREE), silent], FREE)
    assert [one.by_law for one in found] == [True]


def test_the_error_allows_for_an_autocorrelated_residual_in_flight():
    """By a random walk that fades, as a track that is not quite straight leaves it."""
    found = _wandering(CONTACT, ON_A_SPRING)
    assert found[:, 0].std() == pytest.approx(np.median(found[:, 1]), rel=0.4)


def test_an_autocorrelated_residual_is_seldom_taken_for_a_rebound_at_another_instant():
    found = _wandering(0, dataclasses.replace(FREE, law=Newton(restitution=0.8)))
    assert found[:, 0].std() < 2.2 * np.median(found[:, 1])


def _wandering(contact: int, model) -> np.ndarray:
    """(60, 2): restitution and error of records with a random walk in them."""
    read = []
    for seed in range(60):
        record, draws = collision(0.1, 0.7, 0.8, model=model, contact=contact), np.random.default_rng(seed)
        wander = lfilter([1.0], [1.0, -0.8], 5.0 * NOISE * draws.standard_normal(len(record.time)))
        (one,) = rebounds([dataclasses.replace(record, measured={n: v + wander for n, v in record.measured.items()})], model)
        read.append((one.restitution, one.stderr))
    return np.array(read)


def test_a_rider_that_shakes_after_a_rebound_is_read_when_it_has_calmed_down():
    """At 33 Hz and a tenth of a millimetre, as riders on an air track do for some 20 ms."""
    record = collision(0.3, 0.15, 0.14, model=FREE, contact=0, samples=400)
    since = np.maximum(record.time - record.time[200], 0.0)
    shaking = 1e-4 * np.exp(-((since / 0.012) ** 2)) * np.sin(2 * np.pi * 33.0 * since)
    shaken = {name: values + shaking for name, values in record.measured.items()}
    (found,) = rebounds([dataclasses.replace(record, measured=shaken)], dataclasses.replace(FREE, law=Newton(restitution=0.14)))
    assert found.restitution == pytest.approx(0.15, abs=1.5e-3)


def test_no_turn_of_the_flight_is_a_contact():
    t = DT * np.arange(400)
    omega = 2 * np.pi * float(ON_A_SPRING.values()["f_n"])
    turning = {"relative_displacement": 1e-3 * np.sin(omega * t)}
    nothing = dataclasses.replace(
        collision(0.2, 0.7, 0.7, samples=400),
        in_contact=np.zeros(400, bool),
        measured=turning,
        predicted=turning,
        relative_velocity=1e-3 * omega * np.cos(omega * t),
    )
    assert rebounds([nothing], ON_A_SPRING) == []


@pytest.mark.parametrize(("channel", "by_law"), [("relative_displacement", False), ("hammer_acceleration", True)])
def test_where_the_displacement_itself_is_read_wrongly_the_fitted_motion_is_the_measure(channel, by_law):
    faulty = dataclasses.replace(FREE, effects=(TimeOffset(delay=1e-3, of_channel=channel),))
    (found,) = rebounds([collision(0.5, 0.7, 0.6, model=FREE)], faulty)
    assert found.by_law == by_law
