"""Fits with Diffrax on the smoothed contact law."""

import dataclasses

import numpy as np
import pytest

from benchmarks.smoothed_fit.rig import compliant_laws, simulated
from benchmarks.smoothed_fit.trial import trial
from identification.estimation.estimate import fit_experiment
from identification.experiment import Experiment
from identification.least_squares.fit import evaluator, integrator_for
from identification.windows.prepare import prepare
from vibrojax.errors import InputError

WIDTH = 1e-6


@pytest.mark.parametrize(
    "law", [pytest.param(law, marks=[pytest.mark.thorough] * (law not in ("hunt-crossley", "kelvin-voigt"))) for law in compliant_laws()]
)
def test_every_compliant_law_has_the_same_normal_equations_as_with_the_exact_contact(law):
    """At the start values of a fit."""
    experiment = simulated(law, samples=300, seed=0)
    exact, smooth = (prepare(experiment, smoothing=width) for width in (None, WIDTH))
    one, other = (evaluator(each, integrator_for(each, refinement=2.0))(each.start) for each in (exact, smooth))
    assert np.isfinite(one.cost).all()
    np.testing.assert_allclose(other.cost, one.cost, rtol=2e-3)
    size = np.sqrt(np.einsum("lii->li", one.hessian))
    scale = np.where(size > 0, size, 1.0)
    np.testing.assert_allclose(
        other.hessian / scale[:, :, None] / scale[:, None, :], one.hessian / scale[:, :, None] / scale[:, None, :], atol=2e-2
    )


@pytest.mark.thorough
def test_estimates_tend_to_those_of_the_exact_contact_with_the_width():
    """With the order n + 2 of the motion itself."""
    found = trial("hunt-crossley", np.array([1e-4, 3e-4]), samples=1200, seed=1)
    assert found.slope("estimate") == pytest.approx(3.5, abs=0.4)
    assert found.largest["estimate"][0] > 10.0 * found.floor["estimate"]


def test_a_rigid_stop_is_refused(small):
    with pytest.raises(
        InputError, match="the stop of law 'newton' is rigid, so it has no force to smooth: expected the landing integrator"
    ):
        fit_experiment(without_load_cell(small), law="newton", smoothing=WIDTH)


@pytest.mark.parametrize("width", [0.0, -1e-6, float("nan"), float("inf")])
def test_a_width_that_is_no_length_is_refused(small, width):
    with pytest.raises(InputError, match="the width of the smoothed contact is .* m: expected a length above 0"):
        fit_experiment(small, smoothing=width)


def test_effects_are_refused(small):
    with pytest.raises(InputError, match="the smoothed integrator integrates no effects"):
        fit_experiment(small, smoothing=WIDTH, effects=["coulomb_friction"])


def without_load_cell(experiment: Experiment) -> Experiment:
    """The same records without the force channel."""
    records = tuple(
        dataclasses.replace(record, channels={name: values for name, values in record.channels.items() if name != "impact_force"})
        for record in experiment.records
    )
    return dataclasses.replace(experiment, records=records)
