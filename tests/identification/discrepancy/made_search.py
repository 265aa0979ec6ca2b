"""Fits and rounds of a search whose costs are made to order."""

import dataclasses

import numpy as np

from identification.block_arrow import Equations
from identification.discrepancy.facts import facts
from identification.discrepancy.look import Scored, blank
from identification.discrepancy.refit import Fitted
from identification.discrepancy.score import Candidate
from identification.discrepancy.search import Round
from identification.discrepancy.short_list import Rival
from identification.layout import Estimate
from identification.levenberg_marquardt import Outcome
from identification.prepare import Prepared
from vibrojax.effects import EFFECTS, CoulombFriction


def settled(prepared: Prepared, estimate: Estimate, cost: np.ndarray) -> Fitted:
    """Windows with these costs, and nothing that pulls at the estimate."""
    windows, size = len(prepared.record), prepared.layout.size
    equations = Equations(
        hessian=np.zeros((windows, size, size)),
        gradient=np.zeros((windows, size)),
        cost=cost,
        record=prepared.record,
        onward=estimate.states,
        onward_jacobian=np.zeros((*estimate.states.shape, size)),
    )
    outcome = Outcome(estimate=estimate, equations=equations, cost=0.0, converged=True, iterations=1, decrement=0.0)
    return Fitted(prepared=prepared, outcome=outcome)


def fitted(motion, cost: np.ndarray) -> Fitted:
    """The example's windows with these costs."""
    return settled(motion.prepared, motion.estimate, cost)


def round_of(motion, noise: np.ndarray, costs: dict[str, float]) -> Round:
    """One step of the search in which these effects were fitted, with these costs."""
    candidates = {name: Candidate(members=(blank(EFFECTS[name]),), factors=np.ones(1), gain=100.0, degrees=1) for name in costs}
    before = fitted(motion, noise)
    known = facts(motion.prepared, motion.at, motion.estimate)
    scored = Scored(
        fitted=before, known=known, at=motion.at, courses=motion.courses, found=list(candidates.values()), significant=candidates
    )
    rivals = tuple(Rival(candidate=candidates[name], fitted=before, cost=cost) for name, cost in costs.items())
    return Round(scored=scored, cost=1e4, rivals=rivals)


def model(motion, allowed, level: float, *effects) -> Fitted:
    """Fitted, with costs of so many times the noise."""
    found = fitted(motion, level * 0.5 * allowed.samples.astype(float))
    nominal = dataclasses.replace(motion.prepared.model, effects=effects or (CoulombFriction(friction_force=0.1),))
    return dataclasses.replace(found, prepared=dataclasses.replace(found.prepared, model=nominal))


def stage(motion, allowed, before: float, after: float, *effects) -> Round:
    """A round that lowers the costs from so many times the noise to so many."""
    noise = 0.5 * allowed.samples.astype(float)
    one = round_of(motion, noise, {"coulomb_friction": 1.0})
    rival = dataclasses.replace(one.rivals[0], fitted=model(motion, allowed, after, *effects))
    scored = dataclasses.replace(one.scored, fitted=fitted(motion, before * noise))
    return dataclasses.replace(one, cost=float(before * noise.sum()), scored=scored, rivals=(rival,))
