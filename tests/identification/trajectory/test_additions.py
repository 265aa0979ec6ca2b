"""Columns beside a chain."""

import dataclasses

import numpy as np
import pytest

from identification.experiment import Record, Suspension
from identification.trajectory.additions import reestimated, scorer
from identification.trajectory.fit import fit
from identification.trajectory.start import problem_of
from tests.identification.trajectory.conftest import NOISE, RATE, shaken
from vibrojax.effects.free_form import hats


def rolling(speed: float, seed: int) -> Record:
    """A body without a spring, m/s."""
    time = np.arange(1600) / RATE
    read = speed * time + NOISE * np.random.default_rng(seed).standard_normal(len(time))
    channels, noise = {"hammer_displacement": read}, {"hammer_displacement": NOISE}
    return Record(file=f"{seed}.csv", kind="free-decay", gap=100.0, time=time, channels=channels, noise=noise)


def test_what_the_records_cannot_tell_from_the_motion_gains_nothing():
    """Errors of a reading over its value: a constant and a factor are the motion of a body that nothing draws anywhere as well."""
    records = (rolling(0.3, 0), rolling(-0.15, 1))
    found = fit(problem_of(dataclasses.replace(shaken(1), suspension=Suspension(kind="free"), records=records)), both=False)
    chains = found.problem.chains
    u = chains.measured[..., 0]
    columns = np.stack(hats(u.ravel(), np.linspace(u.min(), u.max(), 8), vanishing_below=False), axis=-1).reshape(*u.shape, 1, 8)
    end = np.zeros((len(chains.left), 2, 8))
    reduced = (one := scorer(found.problem, found.at, found.linear, found.variances)).reduced(one.score(columns, end))
    score = reduced.scored(range(8), np.ones((2, 8), bool))
    assert score is not None
    assert score.directions.shape == (8, 6)
    told = columns @ score.directions, end @ score.directions
    with_all, with_none = (reestimated(found, *(x[..., :n] for x in told)) for n in (6, 0))
    assert score.gain < 24.0
    assert with_none.deviance - with_all.deviance == pytest.approx(score.gain, abs=0.5)
