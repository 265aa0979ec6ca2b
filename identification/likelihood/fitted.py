"""Fit of a model under the full likelihood: mode of parameters, states and random force; variances by restricted maximum likelihood."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from identification.least_squares.block_arrow import covariance
from identification.least_squares.fit import free_unknowns, integrator_for
from identification.least_squares.levenberg_marquardt import Outcome
from identification.likelihood import robust
from identification.likelihood.evidence import criterion
from identification.likelihood.joint import JointMode, Point, point
from identification.likelihood.linearised import linearised
from identification.likelihood.random_force import ForceResponse, RandomForce, knots
from identification.likelihood.settling import settled
from identification.likelihood.variances import Posterior, Variances, estimated, log_determinant, measured_noise
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from vibrojax.model import Model

_FIRST_FORCE, _FIRST_MEMORY = 1e-2, 4.0
"""Start values: random force over the rms inertia in flight; correlation time over the knot spacing."""
_FIRST_DEGREES = 4.0
_THERE = 1.0
"""Expected decrease of the cost below which the fit has converged, nats."""
_STEADY = 0.05
"""Change of the log size of the force from one round to the next below which the variances have converged."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Fitted:
    """A model fitted under the full likelihood, with the posterior of its linearisation.

    Attributes:
        point: mode of all unknowns, with the variances.
        posterior: of the model linearised at the mode.
        to_go: expected decrease of the cost in another step, nats.
    """

    point: Point
    posterior: Posterior
    to_go: float

    @property
    def prepared(self) -> Prepared:
        """Windows and model."""
        return self.point.prepared

    @property
    def estimate(self) -> Estimate:
        """Parameters, nuisances, states and force."""
        return self.point.estimate

    @property
    def variances(self) -> Variances:
        """Variances of noise and random force."""
        return self.point.variances

    @property
    def converged(self) -> bool:
        """Whether another step would lower the cost by less than `_THERE`, which is not significant."""
        return self.to_go < _THERE

    @property
    def outcome(self) -> Outcome:
        """The fit as the outcome of a least-squares fit, with the normal equations of the full likelihood."""
        return Outcome(
            estimate=self.estimate,
            equations=self.posterior.equations,
            cost=self.point.cost,
            converged=self.converged,
            iterations=0,
            decrement=0.0,
        )

    @property
    def model(self) -> Model:
        """The model with the estimated parameters."""
        return self.prepared.model.replace(self.prepared.layout.physical(self.estimate.shared))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects in the model."""
        return tuple(effect.name for effect in self.prepared.model.effects)

    @property
    def title(self) -> str:
        """Names of the effects, as text that follows "beside"."""
        return " and ".join(self.names) if self.names else "the nominal model"

    @property
    def unknowns(self) -> int:
        """Number of estimated parameters: without window states, and with one variance for each parameter that varies between records."""
        active, layout = free_unknowns(self.prepared), self.prepared.layout
        own = np.delete(active.nuisances, np.arange(layout.nuisance_count)[layout.varying], axis=1)
        return int(active.shared.sum() + own.sum()) + len(layout.variations)

    @property
    def samples(self) -> int:
        """Number of samples times channels with weight."""
        return int(self.point.inner.samples.sum())

    @property
    def criterion(self) -> float:
        """Bayesian information criterion; window states and random force are integrated out."""
        return criterion(self.log_likelihood, self.unknowns, self.samples)

    @property
    def log_likelihood(self) -> float:
        """Log-likelihood of parameters and variances; window states, force and variations between records are integrated out (Laplace)."""
        inner, by, variances, layout = self.point.inner, self.posterior.marginal, self.variances, self.prepared.layout
        finite = self.point.at.finite
        deviation = np.where(finite, self.posterior.deviation(), self.point.lost)
        samples = np.where(finite, inner.samples, self.point.possible)
        density = robust.log_density(deviation, samples, variances.degrees) - 0.5 * by.log_determinant - inner.log_scale
        count = layout.size - layout.states
        states = log_determinant(self.posterior.equations.hessian[finite][:, count:, count:])
        scales = sum(np.log(layout.own_states[index].scale) for index in layout.free_own) * len(finite)
        varying = self.variation_places()
        records = log_determinant(self.posterior.reduced.hessian[np.ix_(varying, varying)]) if len(varying) else 0.0
        return float(density.sum() - 0.5 * states.sum() - scales - 0.5 * records - self.point.prior)

    def variation_places(self) -> Int[np.ndarray, " variations"]:
        """Indices of the variations between records among all unknowns but the states."""
        layout, records = self.prepared.layout, len(self.estimate.nuisances)
        own = np.arange(layout.nuisance_count)[layout.varying]
        return (layout.shared + layout.nuisance_count * np.arange(records)[:, None] + own).ravel()

    @property
    def chi2_reduced(self) -> float:
        """Reduced chi-square without random force, with the window states at their optimum; 1 where the residual is noise."""
        return self.weighted_chi2(np.ones(len(self.prepared.record)))

    def weighted_chi2(self, weight: Float[np.ndarray, " windows"]) -> float:
        """Reduced chi-square as `chi2_reduced`, with a weight of each window, of any scale; NaN where no window has weight."""
        inner, layout = self.point.inner.fit, self.prepared.layout
        own = slice(1 + layout.size - layout.states, None)
        finite = self.point.at.finite
        blocks, right = inner[finite][:, own, own], inner[finite][:, own, 0]
        size = np.sqrt(np.maximum(np.diagonal(blocks, axis1=1, axis2=2), 1e-300))
        inverse = np.linalg.pinv(blocks / (size[:, :, None] * size[:, None, :]), hermitian=True, rcond=1e-10)
        scaled = right / size
        taken = np.einsum("ls,lst,lt->l", scaled, inverse, scaled)
        if not weight[finite].any():
            return float("nan")
        weight = weight[finite] / weight[finite].mean()
        degrees = weight @ (self.point.inner.samples[finite] - layout.states) - self.unknowns
        return float(weight @ (inner[finite, 0, 0] - taken) / max(degrees, 1.0))

    @property
    def continued(self) -> Prepared:
        """The windows, with this estimate as start of a further fit."""
        return dataclasses.replace(self.prepared, start=self.estimate)

    def lightened(self) -> "Fitted":
        """Without the windows' responses to the random force: large arrays that only a further fit needs."""
        return dataclasses.replace(self, point=dataclasses.replace(self.point, answer=ForceResponse.whole(np.zeros((0, 0, 0, 0)))))


def inertia(at: Point) -> float:
    """Root mean square of m x'' in flight, N: scale of the forces in the rig, with or without a spring."""
    flight = at.at.inside & ~at.at.in_contact & at.at.finite[:, None]
    values = at.at.acceleration[flight]
    return float(at.prepared.model.mass) * float(np.sqrt(np.mean(values**2))) if values.size else 1.0


def fastest_hz(prepared: Prepared, estimate: Estimate) -> float:
    """Highest of natural and excitation frequencies, Hz."""
    natural = prepared.layout.physical(estimate.shared).get("f_n", 0.0)
    return max([float(group.frequency_hz.max()) for group in prepared.groups] + [natural])


def declared_channels(prepared: Prepared) -> frozenset[str]:
    """Channels whose noise the experiment declares."""
    return frozenset(name for name, sensor in prepared.experiment.sensors.items() if sensor.noise is not None)


def first_point(prepared: Prepared, estimate: Estimate) -> Point:
    """Start of a fit under the full likelihood: zero random force with a small prior variance, noise estimated from the flights."""
    groups, fastest = prepared.groups, fastest_hz(prepared, estimate)
    places = knots(np.concatenate([group.ts for group in groups]), np.concatenate([group.lengths for group in groups]), fastest)
    estimate = dataclasses.replace(estimate, force=np.zeros((len(prepared.record), len(places))))
    at = linearised(prepared, integrator_for(prepared), estimate, places)
    flight = at.inside & ~at.in_contact & at.finite[:, None]
    accelerations = at.acceleration[flight]
    size = float(prepared.model.mass) * float(np.sqrt(np.mean(accelerations**2))) if accelerations.size else 1.0
    variances = Variances(
        noise=measured_noise(at, places[1], fastest, declared_channels(prepared)),
        force=RandomForce(std=_FIRST_FORCE * max(size, 1e-300), memory=_FIRST_MEMORY * places[1]),
        places=places,
        weight=np.ones(len(at.record)),
        degrees=_FIRST_DEGREES,
    )
    return point(prepared, estimate, variances, at=at)


def fitted(start: Point, *, rounds: int = 5, measure_noise: bool = True, iterations: int = 12, settle: bool = True) -> Fitted:
    """Alternate between the mode and the variances until both converge; restart windows that have converged to a wrong motion.

    Args:
        start: point with first variances.
        rounds: largest number of alternations.
        measure_noise: whether each round re-estimates the sensor noise.
        iterations: largest number of steps of the mode in each round.
        settle: whether diverged windows are restarted, in the first round and the last.
    """
    here, find = start, JointMode(most_iterations=iterations)
    for turn in range(rounds):
        here = find(here)
        here = settled(here) if settle and turn == 0 else here
        before = here.variances
        noise = before.noise
        if measure_noise:
            fastest = fastest_hz(here.prepared, here.estimate)
            noise = measured_noise(here.at, before.places[1], fastest, declared_channels(here.prepared))
        here = here.under(dataclasses.replace(before, noise=noise))
        variances, found = estimated(here.linear, here.inner, here.variances, coarse=turn == 0)
        here = here.moved(found.step, found.force, variances)
        if turn and abs(np.log(variances.force.std / before.force.std)) < _STEADY:
            break
    here = find(settled(here) if settle else here)
    to_go = find.to_go(here)
    variances, found = estimated(here.linear, here.inner, here.variances, rounds=1, coarse=False)
    return Fitted(point=here.under(variances), posterior=found, to_go=to_go)


def covariance_of(of: Fitted) -> Float[np.ndarray, "unknowns unknowns"]:
    """Covariance of parameters and nuisances; zero for those that are not estimated."""
    reduced = of.posterior.reduced
    full, part = np.zeros_like(reduced.hessian), reduced.active
    full[np.ix_(part, part)] = covariance(reduced.hessian[np.ix_(part, part)])
    return full
