"""Density of the shared parameters, with nuisances, window states and random force integrated out, as one compiled function."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from identification.least_squares.fit import CHUNK, as_arrays, bounds, integrator_for
from identification.least_squares.residual import weighted_residual
from identification.likelihood.fitted import Fitted
from identification.likelihood.linearised import disturbed
from identification.likelihood.sampling.window_terms import WindowTerms, window_terms
from identification.windows.layout import GAP_ERROR, GAP_PRIOR_STD, NUISANCES, Layout
from vibrojax.integrate import AbstractBatchIntegrator
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model

_ROUNDING = 1e-12
"""Relative curvature of a direction that the records do not show."""


class Density(eqx.Module):
    """Log density of the sampled parameters z, in units of their standard errors from the mode, up to a constant.

    ln p(z) = -sum over windows (t loss at the least deviation + 1/2 ln |H_ss|) - 1/2 sum over records ln |H_nn| - priors: the likelihood of
    the fit at its variances, with the states s of every window and the nuisances n of every record integrated out (Laplace), and the
    random force integrated out along the motion. Parameters have a flat prior in the coordinates of the fit, within their bounds, times
    the normal ones that the operator gives.

    At every z the records are integrated anew. Nuisances, states and random force follow z to first order from the mode; one Gauss-Newton
    step from there takes them to their optimum. The gradient leaves out the determinants and the change of the random force. A sampler
    stays exact with such a gradient: trajectories are reversible with any force that depends on the position alone.

    Source: L. Tierney, J. B. Kadane, JASA 81 (1986) 82-86 (marginal densities by Laplace's method).
    """

    model: Model
    layout: Layout = eqx.field(static=True)
    integrator: AbstractBatchIntegrator
    groups: tuple[WindowTerms, ...]
    mode: Float[Array, " parameters"]
    """Internal coordinates."""
    scale: Float[Array, "parameters sampled"]
    """Root of their covariance: shared = mode + scale z."""
    limits: tuple[Float[Array, " parameters"], Float[Array, " parameters"]]
    nuisances: Float[Array, "records nuisances"]
    active: Float[Array, "records nuisances"]
    """1 for a nuisance that is estimated, else 0."""
    follow: Float[Array, "records nuisances parameters"]
    """First-order change of the nuisances' optimum with the parameters."""
    degrees: Float[Array, ""]
    """Of freedom of the windows' t distribution."""

    def __call__(self, z: Float[Array, " sampled"]) -> Float[Array, ""]:
        """ln p(z), whose derivative in reverse mode is the gradient of the class."""
        value, gradient = lax.stop_gradient(self.value_and_gradient(lax.stop_gradient(z)))
        return value + gradient @ (z - lax.stop_gradient(z))

    def value_and_gradient(self, z: Float[Array, " sampled"]) -> tuple[Float[Array, ""], Float[Array, " sampled"]]:
        """ln p(z) and its gradient; -inf outside the bounds and where a window cannot be integrated."""
        profile, volume, gradient = self.terms(z)
        return profile + volume, gradient

    def terms(self, z: Float[Array, " sampled"]) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, " sampled"]]:
        """ln p(z) as its value at the optimum of nuisances and states and the logarithm of their volume; and the gradient of the first."""
        shared = self.mode + self.scale @ z
        nuisances = self.nuisances + jnp.einsum("rnp,p->rn", self.follow, shared - self.mode)
        records, parameters = self.nuisances.shape[0], self.layout.shared
        count = parameters + self.nuisances.shape[1]
        value, volume, gradient, hessian = jnp.zeros(()), jnp.zeros(()), jnp.zeros((records, count)), jnp.zeros((records, count, count))
        for group in self.groups:
            found = lax.map(lambda part: self._windows(part, shared, nuisances), group)
            record = group.windows.record.ravel()
            value, volume = value + found[0].sum(), volume + found[1].sum()
            gradient = gradient.at[record].add(found[2].reshape(-1, count))
            hessian = hessian.at[record].add(found[3].reshape(-1, count, count))
        own, slope, curvature = self._nuisance_priors(nuisances)
        gradient = gradient.at[:, parameters:].add(slope)
        hessian = hessian.at[:, parameters:, parameters:].add(curvature)
        gain, room, down = self._without_nuisances(gradient, hessian, parameters)
        prior, steep = self._priors(shared)
        low, high = self.limits
        profile, volume = value - own + gain - prior, volume + room
        possible = jnp.all((shared >= low) & (shared <= high)) & jnp.isfinite(profile) & jnp.isfinite(volume)
        along = -self.scale.T @ (down + steep)
        return jnp.where(possible, profile, -jnp.inf), jnp.where(possible, volume, 0.0), jnp.where(jnp.isfinite(along), along, 0.0)

    def _windows(self, part: WindowTerms, shared, nuisances):
        """Log density of some windows and log volume of their states; gradient and Hessian of minus the first, states eliminated."""
        record, layout, states = part.windows.record, self.layout, self.layout.states
        lanes = record.shape[0]
        x = jnp.concatenate([jnp.broadcast_to(shared, (lanes, layout.shared)), nuisances[record]], axis=1)
        count = x.shape[1]
        moved = x - part.mode[:, :count]
        begin = part.mode[:, count:] + jnp.einsum("lsi,li->ls", part.follow, moved)
        local = jnp.concatenate([x, begin], axis=1)
        force = part.force_at(local)
        windows = eqx.tree_at(lambda one: one.disturbance.values, part.windows, force)

        def motion(vector):
            residual, trajectory = weighted_residual(self.model, layout, self.integrator, windows, vector)
            return residual, trajectory.result

        def along(direction):
            return jax.jvp(motion, (local,), (jnp.broadcast_to(direction, local.shape),), has_aux=True)

        residual, jacobian, result = jax.vmap(along, out_axes=(None, 1, None))(jnp.eye(layout.size))
        gram = part.gram(jnp.concatenate([residual[:, None], jacobian], axis=1), force)
        scales = np.array([np.inf] * (states - len(layout.free_own)) + [layout.own_states[i].scale for i in layout.free_own])
        precision = jnp.asarray(scales**-2.0)[None]
        weight = (self.degrees + part.samples) / (self.degrees + gram[:, 0, 0])
        hessian, gradient = weight[:, None, None] * gram[:, 1:, 1:], weight[:, None] * gram[:, 1:, 0]
        block = hessian[:, count:, count:] + jnp.diag(precision[0])[None]
        inverse, logarithm = _inverse(block)
        step = -jnp.einsum("lst,lt->ls", inverse, gradient[:, count:] + precision * begin)
        end = begin + step
        own = gram[:, 1 + count :, 1 + count :]
        deviation = (
            gram[:, 0, 0] + 2.0 * jnp.einsum("ls,ls->l", gram[:, 1 + count :, 0], step) + jnp.einsum("ls,lst,lt->l", step, own, step)
        )
        loss = 0.5 * (self.degrees + part.samples) * jnp.log1p(jnp.maximum(deviation, 0.0) / self.degrees)
        density = -loss - 0.5 * jnp.sum(precision * end**2, axis=1)
        density = jnp.where(result == SUCCESS, density, -jnp.inf)
        coupling = hessian[:, :count, count:]
        slope = gradient[:, :count] + jnp.einsum("lis,ls->li", coupling, step)
        rest = hessian[:, :count, :count] - jnp.einsum("lis,lst,ljt->lij", coupling, inverse, coupling)
        counted = part.counted
        found = (density, -0.5 * logarithm, slope, rest)
        return tuple(jnp.where(counted.reshape(-1, *[1] * (one.ndim - 1)), one, 0.0) for one in found)

    def _nuisance_priors(self, nuisances):
        """Negative log prior of the nuisances, its gradient and its Hessian."""
        precision = np.zeros(self.nuisances.shape[1])
        precision[GAP_ERROR] = GAP_PRIOR_STD**-2.0
        precision[len(NUISANCES) : self.layout.without_effects] = 1.0
        each = jnp.asarray(precision)[None]
        return 0.5 * jnp.sum(each * nuisances**2), each * nuisances, jnp.diag(each[0])[None]

    def _without_nuisances(self, gradient, hessian, parameters: int):
        """What the nuisances' optimum adds to the log density, their log volume, and the gradient of minus the density."""
        free = self.active
        slope = gradient[:, parameters:] * free
        block = hessian[:, parameters:, parameters:] * free[:, :, None] * free[:, None, :] + jax.vmap(jnp.diag)(1.0 - free)
        inverse, logarithm = _inverse(block)
        step = -jnp.einsum("rij,rj->ri", inverse, slope)
        gain, volume = -0.5 * jnp.sum(step * slope), -0.5 * jnp.sum(logarithm)
        return gain, volume, gradient[:, :parameters].sum(axis=0) + jnp.einsum("rpi,ri->p", hessian[:, :parameters, parameters:], step)

    def _priors(self, shared):
        """Negative log prior of the shared parameters that have a normal one, and its gradient."""
        total, slope = jnp.zeros(()), jnp.zeros_like(shared)
        for name, mean, std in self.layout.priors:
            index = self.layout.index(name)
            p = self.layout.parameters[index]
            value = jnp.exp(shared[index]) if p.logarithmic else shared[index] * p.scale
            off = (value - mean) / std
            total, slope = total + 0.5 * off**2, slope.at[index].add(off * (value if p.logarithmic else p.scale) / std)
        return total, slope


def density(of: Fitted, sampled: Bool[np.ndarray, " parameters"], covariance: Float[np.ndarray, "parameters parameters"]) -> Density:
    """The density about the mode of a fit.

    Args:
        of: the fit.
        sampled: parameters that are sampled; the others keep their values.
        covariance: of the parameters, internal coordinates.
    """
    prepared, estimate, layout = of.prepared, of.estimate, of.prepared.layout
    reduced, parameters = of.posterior.reduced, layout.shared
    records, width = estimate.nuisances.shape
    active = reduced.active[parameters:].reshape(records, width)
    follow = np.zeros((records, width, parameters))
    for record in range(records):
        own = parameters + width * record + np.flatnonzero(active[record])
        follow[record, active[record]] = (
            -np.linalg.pinv(reduced.hessian[np.ix_(own, own)], rcond=_ROUNDING) @ reduced.hessian[own, :parameters]
        )
    scale = np.zeros((parameters, int(sampled.sum())))
    scale[sampled] = np.linalg.cholesky(covariance[np.ix_(sampled, sampled)])
    low, high = bounds(prepared)
    return Density(
        model=as_arrays(prepared.model),
        layout=layout,
        integrator=integrator_for(prepared),
        groups=window_terms(of, disturbed(prepared.groups, estimate, of.variances.places), CHUNK),
        mode=jnp.asarray(estimate.shared),
        scale=jnp.asarray(scale),
        limits=(jnp.asarray(np.where(sampled, low, -np.inf)), jnp.asarray(np.where(sampled, high, np.inf))),
        nuisances=jnp.asarray(estimate.nuisances),
        active=jnp.asarray(active, float),
        follow=jnp.asarray(follow),
        degrees=jnp.asarray(float(of.variances.degrees)),
    )


def _inverse(blocks: Float[Array, "stack n n"]) -> tuple[Float[Array, "stack n n"], Float[Array, " stack"]]:
    """Inverse and log-determinant of positive semi-definite blocks; directions that nothing shows keep a rounding of their diagonal."""
    size = jnp.sqrt(jnp.maximum(jnp.einsum("sii->si", blocks), 0.0))
    size = jnp.where(size > 0, size, 1.0)
    scaled = blocks / (size[:, :, None] * size[:, None, :]) + _ROUNDING * jnp.eye(blocks.shape[-1])[None]
    inverse = jnp.linalg.inv(scaled) / (size[:, :, None] * size[:, None, :])
    return inverse, jnp.linalg.slogdet(scaled)[1] + 2.0 * jnp.log(size).sum(axis=1)
