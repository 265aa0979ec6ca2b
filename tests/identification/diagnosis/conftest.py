"""Half a second of the embedded example with its true parameters, and everything along its motion that scores begin with."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.scales import probe_scales
from identification.diagnosis.scores import Scores
from identification.trajectory.course import by_sample, courses
from identification.trajectory.fit import Fitted, equations
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.start import problem_of
from identification.trajectory.variances import Variances
from tests.identification.conftest import TRUTH


@pytest.fixture(scope="session")
def scores(small) -> Scores:
    """The nominal model at the first estimate of the motion; nothing is scored yet."""
    problem = problem_of(small)
    shared = [np.log(TRUTH[name]) if logarithmic else TRUTH[name] for name, logarithmic in problem.unknowns.shared]
    at = dataclasses.replace(problem.start, shared=np.array(shared))
    force = RandomForce(std=1e-2 * problem.scales.force, memory=0.01)
    variances = Variances(force=force, readings=tuple(ReadingError() for _ in problem.chains.channels))
    linear, local, solution = equations(problem, at, variances)
    fitted = Fitted(problem=problem, at=at, variances=variances, linear=linear, local=local, solution=solution, rounds=0, converged=True)
    along, sampled = courses(fitted)
    return Scores(fitted=fitted, scales=probe_scales(fitted, along), courses=along, by=by_sample(fitted, sampled), listed=(), free=())
