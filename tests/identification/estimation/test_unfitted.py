"""Windows that a fit did not take: which they are, and how a model predicts them."""

import dataclasses
from unittest.mock import Mock

import numpy as np
import pytest

from identification.estimation.unfitted import unfitted
from identification.least_squares.settling import settled_without_force
from identification.likelihood.fitted import Fitted
from identification.windows.prepare import left_out, prepare
from identification.windows.windows import WindowLength


@pytest.fixture(scope="module")
def two(example):
    """A drop test and a driven cart, whole."""
    return dataclasses.replace(example, records=example.records[:2])


@pytest.fixture(scope="module")
def part(two, truth):
    """Half of the windows of two records, under the parameters that these were simulated with."""
    prepared = prepare(two, most_samples=0.5 * sum(len(record.time) for record in two.records))
    values = prepared.layout.physical(prepared.start.shared) | {name: truth[name] for name in ("k_i", "n", "lambda_i", "zeta", "f_n")}
    return dataclasses.replace(prepared, start=dataclasses.replace(prepared.start, shared=prepared.layout.internal(values)))


def parts_of(prepared):
    return {(int(r), int(first)): int(n) for g in prepared.groups for r, first, n in zip(g.record, g.first, g.lengths, strict=True)}


def checked(part, **changes):
    """The check of a model with some parameters multiplied, whose states fit its own windows."""
    values = part.layout.physical(part.start.shared)
    shared = part.layout.internal(values | {name: factor * values[name] for name, factor in changes.items()})
    estimate, cost = settled_without_force(part, dataclasses.replace(part.start, shared=shared))
    return unfitted(part, Mock(Fitted, estimate=estimate, prepared=part), cost)


def test_windows_left_out_and_fitted_are_the_whole_records(part, two):
    fitted, rest = parts_of(part), parts_of(left_out(part))
    assert rest and not set(fitted) & set(rest)
    for index, record in enumerate(two.records):
        parts = sorted((first, n) for (r, first), n in (fitted | rest).items() if r == index)
        assert [first for first, _ in parts[1:]] == [first + n for first, n in parts[:-1]]
        assert sum(n for _, n in parts) == len(record.time)


def test_nothing_is_left_out_where_all_is_fitted(two):
    assert left_out(prepare(two)) is None


def test_at_most_as_many_samples_are_checked_as_were_wanted_for_the_fit(two):
    few = prepare(two, most_samples=0.3 * sum(len(record.time) for record in two.records))
    fitted, rest = parts_of(few), parts_of(left_out(few))
    assert sum(rest.values()) < 1.3 * few.most_samples
    assert len(rest) < len(parts_of(prepare(two))) - len(fitted)


def test_the_right_model_predicts_the_rest_as_well_as_its_own_windows(part):
    found = checked(part)
    assert found.windows == len(parts_of(left_out(part))) and found.samples > 500
    assert found.chi2_reduced == pytest.approx(1.0, abs=0.15)
    assert found.of_fitted == pytest.approx(1.0, abs=0.15)


def test_a_wrong_model_predicts_the_rest_badly(part):
    assert checked(part, k_i=1.5).chi2_reduced > 1.5


def test_windows_that_cannot_be_integrated_are_no_check(part):
    assert checked(part, f_n=np.nan) is None


def test_shorter_windows_are_not_compared(part, two):
    short = prepare(two, window=WindowLength(impacts=0.5))
    cost = np.ones(len(short.record))
    assert len(short.record) > len(part.record)
    assert unfitted(part, Mock(Fitted, estimate=short.start, prepared=short), cost) is None
