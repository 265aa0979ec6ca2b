"""Effects added on request."""

import dataclasses

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.estimation.simulate import simulate_record
from identification.result.result import OK
from tests.identification.conftest import TRUTH
from vibrojax.contact import HuntCrossley
from vibrojax.effects import CoulombFriction
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.suspension import Linear

FORCE = 0.02
"""N"""


@pytest.fixture(scope="module")
def rubbing(small):
    """The drop test on a suspension that rubs."""
    rng = np.random.default_rng(6)
    model = Model(
        mass=small.mass,
        suspension=Linear(TRUTH["zeta"], TRUTH["f_n"]),
        law=HuntCrossley(TRUTH["k_i"], TRUTH["n"], TRUTH["lambda_i"]),
        effects=(CoulombFriction(FORCE),),
    )
    record = dataclasses.replace(small.records[0], gap=0.0, initial_displacement=-3e-3, initial_velocity=0.0)
    motion = simulate_record(model, record)
    channels = {name: motion[name] + record.noise[name] * rng.standard_normal(len(record.time)) for name in record.channels}
    return dataclasses.replace(small, records=(dataclasses.replace(record, channels=channels),))


def test_friction_is_fitted_beside_everything_else(rubbing):
    found = fit_experiment(rubbing, effects=["coulomb_friction"])
    one = next(p for p in found.parameters if p.spec.name == "coulomb_friction.friction_force")
    assert found.converged and one.status == OK
    assert abs(one.value - FORCE) < 3.0 * one.stderr < 0.2 * FORCE
    assert found.added is not None and found.added.gain > 50.0 and found.added.bic < 0.0 and found.added.chance < 1e-6
    assert found.unrest is None and found.chi2_reduced == pytest.approx(1.0, abs=0.06)
    assert [effect.name for effect in found.model.effects] == ["coulomb_friction"]


def test_an_effect_without_anything_to_act_on_is_refused(shaken_records):
    with pytest.raises(InputError, match="force_clipping has nothing to act on in these records, which hold hammer_displacement"):
        fit_experiment(shaken_records, effects=["force_clipping"])
