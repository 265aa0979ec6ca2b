"""Fits whose residuals are made to order, and one step of a search around them."""

import dataclasses

import numpy as np

from identification.diagnosis.score.probe_scales import probe_scales
from identification.diagnosis.score.score import Candidate, projector
from identification.diagnosis.score.scored import Scored, significant
from identification.diagnosis.score.signature import Course
from identification.diagnosis.search.alternatives import Alternative
from identification.likelihood import joint
from identification.likelihood.fitted import Fitted
from identification.likelihood.joint import Point
from identification.likelihood.linearised import Linearised
from identification.likelihood.noise import Autoregression, white
from identification.likelihood.random_force import RandomForce, force_response
from identification.likelihood.variances import posterior
from identification.windows.prepare import Prepared
from tests.effects.start import at_start
from vibrojax.effects import EFFECTS, AbstractEffect

NO_FORCE = 1e-9
"""N: too small to explain anything."""
_MANY = 1e9
"""Degrees of freedom of a t distribution that is Gaussian."""


def fitted(
    like: Point, at: Linearised, *, force: RandomForce | None = None, noise: dict[str, Autoregression] | None = None, degrees: float = _MANY
) -> Fitted:
    """The fit at a point, as if its windows were `at`: residuals that are white noise as declared, and no random force, unless given."""
    mass, before = float(like.prepared.model.mass), like.variances
    variances = dataclasses.replace(
        before,
        noise=noise or {name: white() for name in at.channels},
        force=force or RandomForce(std=NO_FORCE, memory=before.force.memory),
        weight=np.ones(len(at.record)),
        degrees=degrees,
    )
    answer = force_response(at, mass, variances.places, variances.noise)
    here = joint._weighed(like.prepared, like.estimate, at, answer, variances, None)
    return Fitted(point=here, posterior=posterior(here.linear, here.inner, variances), to_go=0.0)


def fitted_to_nothing(like: Point, prepared: Prepared) -> Fitted:
    """A model with other windows or effects at its start, as if it explained every sample exactly."""
    windows, knots = len(prepared.record), like.estimate.force.shape[1]
    start = dataclasses.replace(prepared.start, force=np.zeros((windows, knots)))
    variances = dataclasses.replace(like.variances, weight=np.ones(windows))
    here = joint.point(prepared, start, variances)
    return fitted(here, dataclasses.replace(here.at, residual=np.zeros_like(here.at.residual)))


def with_prepared(fit: Fitted, prepared: Prepared) -> Fitted:
    """The same with other windows, motions or settings; nothing is worked out anew."""
    return dataclasses.replace(fit, point=dataclasses.replace(fit.point, prepared=prepared))


def candidate(effect: AbstractEffect | str, gain: float = 100.0) -> Candidate:
    """An effect as it is, or one of that name, with this expected gain."""
    member = at_start(EFFECTS[effect]) if isinstance(effect, str) else effect
    return Candidate(members=(member,), factors=np.ones(1), gain=gain, degrees=1)


def scored(fit: Fitted, along: tuple[Course, ...], *found: Candidate) -> Scored:
    """These candidates beside a model."""
    scales = probe_scales(fit.prepared, fit.point.at, fit.estimate)
    return Scored(fitted=fit, scales=scales, by=projector(fit), courses=along, found=list(found), significant=significant(found))


def alternative(fit: Fitted, one: Candidate, gain: float) -> Alternative:
    """A candidate, fitted in full, with so much gain."""
    return Alternative(candidate=one, fitted=fit, gain=gain)
