"""What an experiment declares before any fit."""

import dataclasses

import jax
import numpy as np
import pytest

from identification.experiment import ExperimentError, ParameterOption
from identification.trajectory.start import problem_of
from vibrojax.errors import InputError


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize(("name", "start"), [("n", 5.0), ("zeta", 0.0), ("lambda_i", -1.0)])
def test_a_start_outside_the_range_is_refused(small, name, start, fixed):
    options = {name: ParameterOption(start=start, fixed=fixed)}
    with pytest.raises(ExperimentError, match=rf"start of {name} in \[parameters\] is .*: expected .* to .*; correct it"):
        problem_of(dataclasses.replace(small, parameters=options))


def test_a_load_cell_with_the_wrong_sign_of_motion_gives_a_finite_start(small):
    def flipped(record):
        turned = {"hammer_displacement": -1e3, "hammer_acceleration": -1.0}
        return dataclasses.replace(record, channels={name: turned.get(name, 1.0) * each for name, each in record.channels.items()})

    problem = problem_of(dataclasses.replace(small, records=tuple(flipped(record) for record in small.records)))
    assert np.isfinite(problem.start.shared).all()


def test_single_precision_is_refused_with_what_to_do(small):
    with jax.enable_x64(False), pytest.raises(InputError, match="single precision: expected float64; call .*jax_enable_x64"):
        problem_of(small)
