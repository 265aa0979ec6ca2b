"""Records that begin before the hammer is let go."""

import dataclasses

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.experiment import Record
from identification.guesses.fitted_part import from_release
from identification.trajectory.start import problem_of

TIME = np.arange(4000) / 2000.0
OMEGA = 2 * np.pi * 3.0


def swing(held: float, *, noise: float = 1e-5, kind: str = "free-decay", channel: str = "hammer_displacement") -> Record:
    """Held 5 mm aside until `held`, s, then let go; displacement, or acceleration."""
    since = np.maximum(TIME - held, 0.0)
    u = 5e-3 * np.cos(OMEGA * since)
    clean = u if channel == "hammer_displacement" else np.where(TIME < held, 0.0, -(OMEGA**2) * u)
    values = clean + noise * np.random.default_rng(2).standard_normal(len(TIME))
    return Record(file="a.csv", kind=kind, gap=1.0, time=TIME, channels={channel: values}, noise={channel: noise})


@pytest.mark.parametrize("held", [0.1, 0.5])
@pytest.mark.parametrize("kind", ["drop-test", "free-decay"])
def test_a_hold_is_left_out(held, kind):
    released = from_release(swing(held, kind=kind))
    assert released.time[0] == pytest.approx(held, abs=3e-3)
    assert len(released.channels["hammer_displacement"]) == len(released.time)
    assert released.notices[-1].startswith("The first ")


def test_a_hold_shows_in_the_acceleration_too():
    released = from_release(swing(0.3, noise=0.02, channel="hammer_acceleration"))
    assert released.time[0] == pytest.approx(0.3, abs=3e-3)


def test_a_record_that_begins_with_its_motion_stays_whole(example):
    assert from_release(swing(0.0)).time[0] == 0.0
    drop = example.records[0]
    assert from_release(drop) is drop


@pytest.mark.parametrize("kind", ["cart-excitation", "forced"])
def test_a_driven_hammer_is_not_held(kind):
    record = swing(0.5, kind=kind)
    assert from_release(record) is record


def test_a_hammer_that_never_moves_stays_whole():
    still = swing(10.0)
    assert from_release(still) is still


@pytest.mark.thorough
def test_a_hold_does_not_change_what_is_fitted(small):
    """The example's drop test with 0.2 s of holding before it: one parameter moves by less than its standard error, at most."""
    drop = small.records[0]
    rng, step = np.random.default_rng(4), float(np.median(np.diff(drop.time)))
    count = 800
    before = {"hammer_displacement": -3e-3, "impact_force": 0.0, "hammer_acceleration": 0.0}
    channels = {
        name: np.concatenate([before.get(name, 0.0) + drop.noise[name] * rng.standard_normal(count), values])
        for name, values in drop.channels.items()
    }
    held = dataclasses.replace(drop, time=step * np.arange(count + len(drop.time)), channels=channels)
    plain, late = (dataclasses.replace(small, records=(first, small.records[1])) for first in (drop, held))
    assert problem_of(late).experiment.records[0].time[0] == pytest.approx(count * step, abs=2e-3)
    before_it, after_it = fit_experiment(plain), fit_experiment(late)
    assert after_it.chi2_reduced == pytest.approx(before_it.chi2_reduced, abs=0.02)
    for one, other in zip(before_it.parameters, after_it.parameters, strict=True):
        assert abs(one.value - other.value) < one.stderr
    assert any("before the hammer is let go" in notice for notice in after_it.records[0].notices)
