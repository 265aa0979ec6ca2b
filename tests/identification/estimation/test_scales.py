"""Nothing in a fit belongs to rigs of one size: the same records on another scale of time and length give the same answer."""

import dataclasses

import pytest

from identification.estimation.estimate import fit_experiment
from identification.experiment import Experiment, Record
from vibrojax.channels import UNITS

FASTER, SMALLER = 30.0, 0.1
"""A rig of 156 Hz whose impacts last 0.2 to 0.4 ms."""


def rescaled(record: Record) -> Record:
    """The same oscillation, faster and smaller; the mass stays, so that forces go as accelerations."""
    force = SMALLER * FASTER**2
    factors = {"m": SMALLER, "m/s^2": force, "N": force}
    frequency = record.excitation_frequency
    return dataclasses.replace(
        record,
        time=record.time / FASTER,
        gap=SMALLER * record.gap,
        excitation_frequency=None if frequency is None else FASTER * frequency,
        channels={name: factors[UNITS[name]] * values for name, values in record.channels.items()},
        noise={name: factors[UNITS[name]] * noise for name, noise in record.noise.items()},
    )


@pytest.fixture(scope="module")
def fast(small) -> Experiment:
    """The records of `small` from another rig."""
    return dataclasses.replace(small, records=tuple(rescaled(record) for record in small.records))


def test_a_rig_that_is_faster_and_smaller_is_fitted_as_well(small, fast):
    slow, found = fit_experiment(small), fit_experiment(fast)
    n = float(slow.model.values()["n"])
    factors = {
        "k_i": SMALLER * FASTER**2 / SMALLER**n,
        "n": 1.0,
        "lambda_i": 1.0 / (SMALLER * FASTER),
        "zeta": 1.0,
        "f_n": FASTER,
    }
    assert found.converged
    assert found.chi2_reduced == pytest.approx(slow.chi2_reduced, rel=1e-4)
    for name, factor in factors.items():
        assert float(found.model.values()[name]) == pytest.approx(factor * float(slow.model.values()[name]), rel=1e-3), name
    slow_errors, errors = ({p.spec.name: p.stderr for p in result.parameters} for result in (slow, found))
    for name in factors.keys() - {"k_i"}:  # whose relative error goes with the unit of length, by the exponent
        assert errors[name] == pytest.approx(factors[name] * slow_errors[name], rel=0.01), name
