"""Initial states of long windows, found from their beginnings on."""

import dataclasses

import numpy as np
import pytest

from identification.least_squares.fit import evaluator, fit, integrator_for
from identification.least_squares.levenberg_marquardt import settle
from identification.least_squares.settling import settled_gradually
from identification.windows.prepare import prepare
from identification.windows.windows import WindowLength
from tests.identification.conftest import cropped


@pytest.fixture(scope="module")
def long_windows(example):
    """The example's driven records in windows of several impacts, each where the fit has it."""
    prepared = prepare(cropped(example, 3000, (1, 2, 3)), window=WindowLength(longest=3000, impacts=6.0))
    return dataclasses.replace(prepared, start=fit(prepared).estimate)


def test_a_state_beside_the_true_one_finds_back_where_a_plain_step_does_not(long_windows):
    evaluate = evaluator(long_windows, integrator_for(long_windows))
    true = evaluate(long_windows.start).cost
    beside = dataclasses.replace(long_windows.start, states=long_windows.start.states * [1.1, 0.9])
    _, plainly = settle(evaluate, beside)
    _, gradually = settled_gradually(dataclasses.replace(long_windows, start=beside), integrator_for(long_windows))
    assert np.sum(gradually < 1.1 * true) == len(true)
    assert np.sum(plainly < 1.1 * true) < len(true)
