"""Candidates that begin from the loops of force against indentation; loops of known laws along the example's motion."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.search.from_loops import from_loops
from identification.windows.layout import NUISANCES
from tests.identification.diagnosis import made_fit
from tests.identification.diagnosis.made_loops import FRONT, with_loops
from vibrojax.effects.deep_stop import Backed


@pytest.mark.parametrize(("too_small", "load_cell"), [(0.0, True), (1e-3, True), (0.0, False)])
def test_a_kink_in_the_loops_gives_depth_stiffness_law_and_gap(motion, too_small, load_cell):
    """However far off the gap was set, and by the hammer's inertia where there is no load cell."""
    deepest = []

    def bent(depth: float) -> Backed:
        deepest.append(depth)
        return Backed(FRONT, 2e7, 0.6 * depth, 0.5)

    ((candidate, prepared),) = from_loops(with_loops(motion, bent, too_small=too_small, load_cell=load_cell))
    found = prepared.layout.physical(prepared.start.shared)
    assert candidate.name == "deep_stop"
    assert candidate.members[0].depth == pytest.approx(0.6 * deepest[0], rel=0.05)
    assert found["deep_stop.depth"] == pytest.approx(float(candidate.members[0].depth))
    assert found["deep_stop.deep_stiffness"] == pytest.approx(2e7, rel=0.3)
    assert found["n"] == pytest.approx(1.5, abs=0.1)
    np.testing.assert_allclose(prepared.start.nuisances[:, NUISANCES.index("gap_error")], too_small, atol=1e-5)


def test_a_record_that_shows_no_contact_keeps_its_gap(motion):
    scored = with_loops(motion, lambda deepest: Backed(FRONT, 2e7, 0.6 * deepest, 0.5))
    prepared, column = scored.fitted.prepared, NUISANCES.index("gap_error")
    prepared = dataclasses.replace(prepared, motions=(*prepared.motions[:-1], None))
    estimate = scored.fitted.estimate
    nuisances = estimate.nuisances.copy()
    nuisances[:, column] = 7e-4
    point = dataclasses.replace(scored.fitted.point, prepared=prepared, estimate=dataclasses.replace(estimate, nuisances=nuisances))
    ((_, begun),) = from_loops(dataclasses.replace(scored, fitted=dataclasses.replace(scored.fitted, point=point)))
    assert begun.start.nuisances[-1, column] == 7e-4
    np.testing.assert_allclose(begun.start.nuisances[:-1, column], 0.0, atol=1e-5)


def test_loops_with_noise_alone_propose_nothing(motion):
    assert from_loops(with_loops(motion, lambda deepest: FRONT)) == []


def test_a_law_that_is_held_proposes_nothing(motion):
    scored = with_loops(motion, lambda deepest: Backed(FRONT, 2e7, 0.6 * deepest, 0.5))
    prepared = dataclasses.replace(scored.fitted.prepared, fixed={"k_i": 2e6, "n": 1.5, "lambda_i": 0.4})
    assert from_loops(dataclasses.replace(scored, fitted=made_fit.with_prepared(scored.fitted, prepared))) == []
