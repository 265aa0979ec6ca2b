"""Standard errors of a fitted model."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.errors import errors, numbers
from identification.least_squares.fit import bounds
from tests.identification.conftest import TRUTH


def test_the_truth_is_within_the_errors(recovered):
    for one in numbers(recovered):
        assert one.stderr is not None and abs(one.value - TRUTH[one.name]) < 4.0 * one.stderr


def test_they_are_those_of_generalised_least_squares(motion):
    """Twice the noise and half the samples that count, by their weights: errors grow by its square root and by the noise."""
    at = motion.shown()
    plain = errors(motion.fitted(at)).stderr[: motion.prepared.layout.shared]
    doubled = dataclasses.replace(at, residual=0.5 * at.residual, jacobian=0.5 * at.jacobian, weight=0.5 * at.weight)
    assert errors(motion.fitted(doubled)).stderr[: len(plain)] == pytest.approx(2.0 * plain, rel=0.01)


def test_a_random_force_makes_them_wider(motion, recovered):
    stronger = dataclasses.replace(recovered.variances.force, std=0.1)
    quiet, restless = (errors(motion.fitted(motion.shown(), force=force)).stderr for force in (None, stronger))
    shared = motion.prepared.layout.shared
    assert np.all(restless[:shared] > quiet[:shared])


def test_what_is_held_or_at_the_edge_of_its_range_has_none(recovered):
    prepared, index = recovered.prepared, recovered.prepared.layout.index
    held = dataclasses.replace(prepared, fixed={"n": 1.5})
    edge = recovered.estimate.shared.copy()
    edge[index("zeta")] = bounds(prepared)[0][index("zeta")]
    estimate = dataclasses.replace(recovered.estimate, shared=edge)
    fitted = dataclasses.replace(recovered, point=dataclasses.replace(recovered.point, prepared=held, estimate=estimate))
    assert [one.name for one in numbers(fitted) if one.stderr is None] == ["n", "zeta"]
