"""What a simulation takes from the record where the experiment file does not state it."""

import dataclasses

import numpy as np
import pytest

from identification.estimation.simulate import simulate_record
from identification.experiment import ExperimentError
from identification.guesses.declared_model import nominal_model
from vibrojax.contact import Newton


def test_a_phase_that_is_not_stated_is_read_off_the_cart(small):
    record, model = small.records[1], nominal_model(small, None)
    whole = simulate_record(model, record)["cart_displacement"]
    half = simulate_record(model, dataclasses.replace(record, base_amplitude=float(np.ptp(whole)) / 2))["cart_displacement"]
    assert np.ptp(whole) > 0
    np.testing.assert_allclose(half, whole, atol=0.02 * np.ptp(whole))


def test_stated_amplitude_and_phase_are_taken(small):
    record = dataclasses.replace(small.records[1], base_amplitude=1e-3, base_phase=0.5)
    cart = simulate_record(nominal_model(small, None), record)["cart_displacement"]
    assert cart[0] == pytest.approx(1e-3 * np.sin(0.5))


def test_a_load_cell_that_reads_nothing_is_no_obstacle(small):
    """Noise that cannot be estimated from a channel that stands still is not asked for."""
    record = small.records[0]
    silent = {name: np.zeros_like(values) if name == "impact_force" else values for name, values in record.channels.items()}
    noise = {name: value for name, value in record.noise.items() if name != "impact_force"}
    bare = dataclasses.replace(record, channels=silent, noise=noise, initial_displacement=None, initial_velocity=None)
    assert np.isfinite(simulate_record(nominal_model(small, None), bare)["hammer_displacement"]).all()


def test_a_record_does_not_begin_behind_a_rigid_stop(small):
    record = dataclasses.replace(small.records[0], gap=1e-3, initial_displacement=3e-3, initial_velocity=0.0)
    rigid = dataclasses.replace(nominal_model(small, None), law=Newton(0.8))
    with pytest.raises(ExperimentError, match="begins 0.002 m behind a rigid stop: expected initial_displacement <= gap"):
        simulate_record(rigid, record)
