"""Records beside the motion of the model alone."""

import dataclasses

import numpy as np
import pytest

from identification.estimation.prediction import PERIODS, record_fits
from identification.estimation.simulate import simulate_record
from identification.trajectory.fit import fit
from identification.trajectory.start import problem_of
from tests.identification.trajectory.conftest import NOISE, shaken


@pytest.fixture(scope="module")
def fitted(small):
    return fit(problem_of(small))


def test_a_stretch_is_what_a_simulation_from_its_first_state_gives(fitted, small):
    """The program's own simulator, which goes from touch to touch over the whole record."""
    for index, (record, found) in enumerate(zip(small.records, record_fits(fitted), strict=True)):
        state = fitted.at.states[fitted.problem.chains.knots[index].start]
        numbers = {one.name: one.value for one in found.nuisances}
        stated = dataclasses.replace(
            record,
            gap=found.gap,
            initial_displacement=float(state[0]),
            initial_velocity=float(state[1]),
            base_amplitude=numbers.get("base_amplitude"),
            base_phase=numbers.get("base_phase"),
            channels={},
        )
        expected = simulate_record(fitted.problem.model_at(fitted.at), stated)
        first = found.window == found.window[0]
        for name in record.channels:
            np.testing.assert_allclose(found.predicted[name][first], expected[name][first], atol=0.05 * record.noise[name])


def test_stretches_with_impacts_are_some_periods_long(fitted, small):
    for record, found in zip(small.records, record_fits(fitted), strict=True):
        slow = min(5.2, record.excitation_frequency or 5.2)
        longest = max(np.sum(found.window == number) for number in np.unique(found.window)) * np.median(np.diff(record.time))
        whole = record.time[-1] - record.time[0]
        assert longest == pytest.approx(min(PERIODS / slow, whole), rel=0.5)
        assert found.samples == len(record.time)


@pytest.mark.parametrize("changed", [1.0, 1.3])
def test_brief_stretches_with_impacts_are_a_quarter_of_a_period_long_whatever_the_model(fitted, small, changed):
    values = fitted.problem.values(fitted.at)
    shared = fitted.problem.coordinates(values | {"f_n": changed * values["f_n"]})
    other = dataclasses.replace(fitted, at=dataclasses.replace(fitted.at, shared=shared))
    for index, (record, found) in enumerate(zip(small.records, record_fits(other, brief=True), strict=True)):
        begins = np.flatnonzero(np.diff(found.window, prepend=-1))
        lengths = np.diff(begins)[:-1] * np.median(np.diff(record.time)) * (record.excitation_frequency or 5.2)
        np.testing.assert_allclose(lengths, 0.25, atol=0.05)
        states = fitted.at.states[fitted.problem.chains.knots[index]][begins // fitted.problem.chains.samples]
        np.testing.assert_allclose(found.relative_displacement[begins], states[:, 0], atol=1e-9)


def test_a_vibration_without_impacts_is_one_stretch_without_the_force_that_shook_it():
    """The free decay from the fitted first state, in closed form."""
    fitted = fit(problem_of(shaken(1)))
    (found,) = record_fits(fitted)
    assert found.windows == 1
    state, values = fitted.at.states[0], fitted.problem.values(fitted.at)
    zeta, omega = values["zeta"], 2.0 * np.pi * values["f_n"]
    damped, t = omega * np.sqrt(1.0 - zeta**2), found.time - found.time[0]
    sine = (state[1] + zeta * omega * state[0]) / damped
    expected = np.exp(-zeta * omega * t) * (state[0] * np.cos(damped * t) + sine * np.sin(damped * t))
    np.testing.assert_allclose(found.relative_displacement, expected, atol=1e-3 * NOISE)
    assert found.chi2_reduced["hammer_displacement"] > 4.0
