"""Candidates that begin from the loops of force against indentation; loops of known laws along the example's motion."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.discrepancy.from_loops import from_loops
from tests.identification.discrepancy.made_search import round_of
from vibrojax.contact import HuntCrossley
from vibrojax.effects.deep_stop import Backed

FRONT = HuntCrossley(2e6, 1.5, 0.4)


@pytest.fixture
def with_loops(motion, allowed):
    """A look at the example as if its load cell had shown another law, which takes what the deepest indentation is."""

    def with_law(law_of):
        one, records = (
            round_of(motion, 0.5 * allowed.samples, {"deep_stop": 1.0, "coulomb_friction": 1.0}),
            motion.prepared.experiment.records,
        )
        pairs = list(zip(records, motion.prepared.motions, strict=True))
        law = law_of(max(float(m.u.max()) - r.gap for r, m in pairs if m.touching.any()))
        shown = tuple(dataclasses.replace(m, force=_force(law, m.u - r.gap, m.v)) for r, m in pairs)
        prepared = dataclasses.replace(one.scored.fitted.prepared, motions=shown)
        return dataclasses.replace(one.scored, fitted=dataclasses.replace(one.scored.fitted, prepared=prepared))

    return with_law


def _force(law, indentation, rate) -> np.ndarray:
    force = law.force(jnp.maximum(indentation, 0.0), jnp.asarray(rate), jnp.ones_like(rate))
    return np.where(indentation > 0, np.asarray(force), 0.0)


def test_a_bend_in_the_loops_tells_depth_and_hardness_and_the_law_in_front(with_loops):
    seen = []

    def bent(deepest: float) -> Backed:
        seen.append(deepest)
        return Backed(FRONT, 4e8, 0.6 * deepest, 0.5)

    ((candidate, prepared),) = from_loops(with_loops(bent))
    found = prepared.layout.physical(prepared.start.shared)
    assert candidate.name == "deep_stop"
    assert candidate.members[0].depth == pytest.approx(0.6 * seen[0], rel=0.02)
    assert found["deep_stop.depth"] == pytest.approx(float(candidate.members[0].depth))
    assert found["deep_stop.deep_stiffness"] == pytest.approx(4e8, rel=0.1)
    assert found["deep_stop.deep_damping"] == pytest.approx(0.5, rel=0.1)
    assert found["n"] == pytest.approx(1.5, abs=0.02)
    assert found["k_i"] == pytest.approx(2e6, rel=0.2)


def test_loops_without_a_bend_propose_nothing(with_loops):
    assert from_loops(with_loops(lambda deepest: FRONT)) == []
