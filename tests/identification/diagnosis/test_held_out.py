"""Errors on windows that were left out of the fit."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis import held_out
from identification.likelihood import linearised
from identification.windows.prepare import windows_of
from tests.identification.diagnosis import made_fit


def test_every_window_counts_once_however_many_are_integrated_side_by_side(motion, monkeypatch):
    """Five windows, left out two, one, one and one at a time; a motion that is off by 0.1 %."""
    prepared = windows_of(motion.prepared, np.arange(5))
    fitted = made_fit.fitted_to_nothing(motion.point, prepared)
    shifted = dataclasses.replace(fitted.estimate, shared=1.001 * fitted.estimate.shared)
    fitted = dataclasses.replace(fitted, point=dataclasses.replace(fitted.point, estimate=shifted))
    errors = []
    for side_by_side in (4, 1):
        monkeypatch.setattr(linearised, "CHUNK", side_by_side)
        errors.append(held_out.held_out(fitted))
    assert errors[0] == pytest.approx(errors[1], rel=1e-9)


def test_error_is_that_of_the_samples_that_count(motion):
    """A residual of three times the noise in every channel and of eight in the first; of each record over its own scatter."""
    at, parts = motion.at, []
    residual = np.full_like(at.residual, 3.0)
    residual[..., 0] = 8.0
    for record in motion.prepared.experiment.records:
        for column, channel in enumerate(at.channels):
            if channel in record.channels and (signal := np.nanvar(record.channels[channel]) / record.noise[channel] ** 2) > 9.0:
                parts.append(((8.0 if column == 0 else 3.0) ** 2 - 1.0) / signal)
    fitted = made_fit.fitted(motion.point, at)
    assert held_out._nrmse(fitted, residual) == pytest.approx(np.sqrt(np.mean(parts)))


def test_a_window_that_cannot_be_integrated_is_predicted_as_badly_as_any(motion):
    residual = np.zeros_like(motion.at.residual)
    residual[0] = np.inf
    parts = held_out._nrmse(made_fit.fitted(motion.point, motion.at), residual)
    assert 0.5 < parts <= 2.0


def test_channels_are_matched_by_name(motion, monkeypatch):
    """As where windows of one kind lack a channel that those of another have."""
    fitted = made_fit.fitted_to_nothing(motion.point, windows_of(motion.prepared, np.arange(5)))
    shifted = dataclasses.replace(fitted.estimate, shared=1.001 * fitted.estimate.shared)
    fitted = dataclasses.replace(fitted, point=dataclasses.replace(fitted.point, estimate=shifted))
    expected, along = held_out.held_out(fitted), held_out._along

    def turned(*arguments):
        at = along(*arguments)
        arrays = {name: getattr(at, name)[..., ::-1] for name in ("weight", "residual", "jacobian")}
        return dataclasses.replace(at, channels=at.channels[::-1], **arrays)

    monkeypatch.setattr(held_out, "_along", turned)
    assert held_out.held_out(fitted) == pytest.approx(expected, rel=1e-9)


def test_a_wrong_model_predicts_worse(recovered):
    """A spring that is held a twentieth too hard in frequency, which the initial states of windows cannot make up for."""
    layout, values = recovered.prepared.layout, recovered.prepared.layout.physical(recovered.estimate.shared)
    harder = dataclasses.replace(recovered.estimate, shared=layout.internal(values | {"f_n": 1.05 * values["f_n"]}))
    held = dataclasses.replace(recovered.prepared, fixed={"f_n": 1.05 * values["f_n"]})
    wrong = dataclasses.replace(recovered, point=dataclasses.replace(recovered.point, prepared=held, estimate=harder))
    assert held_out.held_out(wrong) > 2.0 * held_out.held_out(recovered) > 0.0


def test_of_a_single_window_nothing_can_be_left_out(motion):
    assert np.isnan(held_out.held_out(made_fit.fitted_to_nothing(motion.point, windows_of(motion.prepared, np.arange(1)))))
