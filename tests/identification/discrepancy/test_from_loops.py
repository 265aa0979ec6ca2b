"""Candidates that begin from the loops of force against indentation; loops of known laws along the example's motion."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.discrepancy.from_loops import from_loops
from identification.layout import NUISANCES
from tests.identification.discrepancy.made_search import round_of
from vibrojax.contact import HuntCrossley
from vibrojax.effects.deep_stop import Backed

FRONT = HuntCrossley(2e6, 1.5, 0.4)


@pytest.fixture
def with_loops(motion, allowed):
    """A look at the example as if its load cell had shown another law, which takes the deepest indentation, and noise."""

    def with_law(law_of, *, too_small: float = 0.0, load_cell: bool = True):
        one, experiment = round_of(motion, 0.5 * allowed.samples, {"deep_stop": 1.0, "coulomb_friction": 1.0}), motion.prepared.experiment
        pairs = list(zip(experiment.records, motion.prepared.motions, strict=True))
        law = law_of(max(float(m.u.max()) - r.gap for r, m in pairs if m.touching.any()))
        forces = [_force(law, m.u - r.gap, m.v) for r, m in pairs]
        draws, noise = np.random.default_rng(3), 0.01 * max(float(force.max()) for force in forces)
        shown = []
        for (record, seen), force in zip(pairs, forces, strict=True):
            u, v, base = (jnp.asarray(values) for values in (seen.u, seen.v, seen.base_acceleration))
            free = experiment.mass * np.asarray(motion.prepared.model.suspension.acceleration(u, v, -base))
            noisy = force + noise * draws.standard_normal(len(force))
            by_inertia = {"force": None, "inertia": noisy - free - experiment.mass * seen.base_acceleration}
            touching = (seen.u > record.gap) & seen.touching
            shown.append(dataclasses.replace(seen, touching=touching, **({"force": noisy} if load_cell else by_inertia)))
        records = tuple(dataclasses.replace(record, gap=record.gap - too_small) for record in experiment.records)
        prepared = dataclasses.replace(
            one.scored.fitted.prepared, motions=tuple(shown), experiment=dataclasses.replace(experiment, records=records)
        )
        return dataclasses.replace(one.scored, fitted=dataclasses.replace(one.scored.fitted, prepared=prepared))

    return with_law


def _force(law, indentation, rate) -> np.ndarray:
    force = law.force(jnp.maximum(indentation, 0.0), jnp.asarray(rate), jnp.ones_like(rate))
    return np.where(indentation > 0, np.asarray(force), 0.0)


@pytest.mark.parametrize(("too_small", "load_cell"), [(0.0, True), (1e-3, True), (0.0, False)])
def test_a_bend_in_the_loops_tells_depth_hardness_law_and_gap(with_loops, too_small, load_cell):
    """However far off the gap was set, and by the hammer's inertia where there is no load cell."""
    deepest = []

    def bent(depth: float) -> Backed:
        deepest.append(depth)
        return Backed(FRONT, 2e7, 0.6 * depth, 0.5)

    ((candidate, prepared),) = from_loops(with_loops(bent, too_small=too_small, load_cell=load_cell))
    found = prepared.layout.physical(prepared.start.shared)
    assert candidate.name == "deep_stop"
    assert candidate.members[0].depth == pytest.approx(0.6 * deepest[0], rel=0.05)
    assert found["deep_stop.depth"] == pytest.approx(float(candidate.members[0].depth))
    assert found["deep_stop.deep_stiffness"] == pytest.approx(2e7, rel=0.3)
    assert found["n"] == pytest.approx(1.5, abs=0.1)
    np.testing.assert_allclose(prepared.start.nuisances[:, NUISANCES.index("gap_error")], too_small, atol=1e-5)


def test_a_record_that_shows_no_contact_keeps_its_gap(with_loops):
    scored = with_loops(lambda deepest: Backed(FRONT, 2e7, 0.6 * deepest, 0.5))
    prepared, column = scored.fitted.prepared, NUISANCES.index("gap_error")
    prepared = dataclasses.replace(prepared, motions=(*prepared.motions[:-1], None))
    estimate = scored.fitted.outcome.estimate
    nuisances = estimate.nuisances.copy()
    nuisances[:, column] = 7e-4
    outcome = dataclasses.replace(scored.fitted.outcome, estimate=dataclasses.replace(estimate, nuisances=nuisances))
    ((_, begun),) = from_loops(dataclasses.replace(scored, fitted=dataclasses.replace(scored.fitted, prepared=prepared, outcome=outcome)))
    assert begun.start.nuisances[-1, column] == 7e-4
    np.testing.assert_allclose(begun.start.nuisances[:-1, column], 0.0, atol=1e-5)


def test_loops_that_noise_alone_bends_propose_nothing(with_loops):
    assert from_loops(with_loops(lambda deepest: FRONT)) == []


def test_a_law_that_is_held_proposes_nothing(with_loops):
    scored = with_loops(lambda deepest: Backed(FRONT, 2e7, 0.6 * deepest, 0.5))
    prepared = dataclasses.replace(scored.fitted.prepared, fixed={"k_i": 2e6, "n": 1.5, "lambda_i": 0.4})
    assert from_loops(dataclasses.replace(scored, fitted=dataclasses.replace(scored.fitted, prepared=prepared))) == []
