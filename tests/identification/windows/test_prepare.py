"""First guesses and the operator's own values."""

import dataclasses

import jax
import numpy as np
import pytest

from identification.estimation.records import record_fits
from identification.experiment import ExperimentError, ParameterOption
from identification.experiment.experiment import Preparation
from identification.least_squares.fit import integrator_for
from identification.result.result import NO_WINDOW
from identification.windows.prepare import prepare
from identification.windows.windows import WindowLength
from vibrojax.errors import InputError


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize(("name", "start"), [("n", 5.0), ("zeta", 0.0), ("lambda_i", -1.0)])
def test_a_start_outside_the_range_is_refused(small, name, start, fixed):
    options = {name: ParameterOption(start=start, fixed=fixed)}
    with pytest.raises(ExperimentError, match=rf"start of {name} in \[parameters\] is .*: expected .* to .*; correct it"):
        prepare(dataclasses.replace(small, parameters=options))


def test_a_load_cell_with_the_wrong_sign_of_motion_gives_a_finite_start(small):
    def flipped(record):
        turned = {"hammer_displacement": -1e3, "hammer_acceleration": -1.0}
        return dataclasses.replace(record, channels={name: turned.get(name, 1.0) * each for name, each in record.channels.items()})

    prepared = prepare(dataclasses.replace(small, records=tuple(flipped(record) for record in small.records)))
    assert np.isfinite(prepared.start.shared).all()


def test_two_stamps_close_together_do_not_shorten_every_step(small):
    record = small.records[1]
    time = record.time.copy()
    time[500] = time[499] + 1e-7
    measured = dataclasses.replace(record, base="measured")
    both = (measured, dataclasses.replace(measured, time=time))
    even, uneven = (integrator_for(prepare(dataclasses.replace(small, records=(each,)))) for each in both)
    assert float(uneven.flight_step) == pytest.approx(float(even.flight_step))
    assert uneven.most_steps == even.most_steps


def test_single_precision_is_refused_with_what_to_do(small):
    with jax.enable_x64(False), pytest.raises(InputError, match="single precision: expected float64; call .*jax_enable_x64"):
        prepare(small)


def test_more_samples_than_are_fitted_leave_windows_spread_over_each_record(small):
    window = WindowLength(impacts=1.0, longest=100)
    whole, cropped = prepare(small, window=window), dataclasses.replace(small.records[1], preparation=Preparation(crop=(0.0, 1.0)))
    most = 0.4 * len(small.records[0].time) + len(cropped.time)
    thin = prepare(dataclasses.replace(small, records=(small.records[0], cropped)), window=window, most_samples=most)
    first, of_first = (np.sort(np.concatenate([g.first[g.record == 0] for g in one.groups])) for one in (whole, thin))
    assert len(of_first) == max(2, round(0.4 * len(first)))
    assert set(of_first) < set(first)
    assert (of_first[0], of_first[-1]) == (first[0], first[-1])
    assert (thin.record == 1).sum() == (whole.record == 1).sum(), "what was cropped is taken whole"
    fitted = record_fits(thin, integrator_for(thin), thin.start, np.full(thin.start.nuisances.shape, np.nan))
    assert fitted[1].notices == cropped.notices
    fitted = fitted[0]
    assert f"{fitted.samples} of {len(fitted.time)} samples are taken" in fitted.notices[-1]
    assert fitted.windows == len(of_first)
    assert np.isnan(fitted.predicted["hammer_displacement"][fitted.window == NO_WINDOW]).all()
    inside = fitted.window != NO_WINDOW
    measured, predicted = fitted.measured["hammer_displacement"][inside], fitted.predicted["hammer_displacement"][inside]
    assert fitted.nrmse["hammer_displacement"] == pytest.approx(np.sqrt(np.mean((measured - predicted) ** 2)) / measured.std())


@pytest.mark.thorough
def test_of_many_records_with_too_many_samples_some_of_each_kind_are_fitted(small):
    drop, cart = small.records[0], small.records[1]
    many = [dataclasses.replace((drop, cart)[number % 2], file=f"record{number:03d}.csv") for number in range(300)]
    without = {name: values for name, values in drop.channels.items() if name != "impact_force"}
    many[6] = dataclasses.replace(drop, file="odd.csv", channels=without)
    many[9] = dataclasses.replace(cart, file="cropped.csv", preparation=Preparation(crop=(0.0, 1.0)))
    experiment, samples = dataclasses.replace(small, records=tuple(many)), sum(len(record.time) for record in many)
    most = 100.0 * 2 * WindowLength().longest  # two windows of each of 100
    some = prepare(experiment, most_samples=most).experiment.records
    assert 100 <= len(some) <= 102
    assert {"odd.csv", "cropped.csv"} < {record.file for record in some}
    assert sum(record.kind == drop.kind for record in some) in (50, 51)
    assert len(prepare(experiment, most_samples=float(samples)).experiment.records) == 300
