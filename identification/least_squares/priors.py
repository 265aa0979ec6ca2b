"""Gaussian priors in the normal equations: of parameters, of each record's zeros and variations, of effects' initial states."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int

from identification.least_squares.block_arrow import Equations
from identification.windows.layout import NUISANCES, Estimate, Layout


def with_prior(equations: Equations, layout: Layout, estimate: Estimate) -> Equations:
    """Normal equations of the likelihood with all priors.

    The nuisances with a (unit) prior are the zeros and the variations of every record. A record's prior is divided among its windows, a
    parameter's among all.
    """
    return _with_all(equations, layout, estimate, np.ones(len(equations.cost), bool), 1.0)


def without_parameter_priors(equations: Equations, layout: Layout, estimate: Estimate) -> Equations:
    """Normal equations less the priors of parameters, from those with all priors."""
    return _with_parameters(equations, layout, estimate, np.ones(len(equations.cost), bool), -1.0)


def without_windows(equations: Equations, layout: Layout, estimate: Estimate, left_out: Int[np.ndarray, " left_out"]) -> Equations:
    """Normal equations of all windows but some, given by their indices, with the priors of parameters and records whole."""
    kept = ~np.isin(np.arange(len(equations.cost)), left_out)
    plain = _with_all(equations, layout, estimate, np.ones(len(equations.cost), bool), -1.0)
    part = dataclasses.replace(
        plain, hessian=plain.hessian * kept[:, None, None], gradient=plain.gradient * kept[:, None], cost=np.where(kept, plain.cost, 0.0)
    )
    return _with_all(part, layout, estimate, kept, 1.0)


def _with_all(equations: Equations, layout: Layout, estimate: Estimate, among: Bool[np.ndarray, " windows"], sign: float) -> Equations:
    """Normal equations with all priors added (`sign` 1) or removed (-1), divided `among` some windows."""
    own = among / np.maximum(np.bincount(equations.record, among), 1)[equations.record]
    for column, index in enumerate(layout.free_own, start=-len(layout.free_own)):
        scale = layout.own_states[index].scale
        equations = _with(equations, column, estimate.states[:, column] / scale, 1.0 / scale, sign * among)
    for place in range(len(NUISANCES), layout.without_effects):
        equations = _with(equations, layout.shared + place, estimate.nuisances[equations.record, place], 1.0, sign * own)
    return _with_parameters(equations, layout, estimate, among, sign)


def _with_parameters(
    equations: Equations, layout: Layout, estimate: Estimate, among: Bool[np.ndarray, " windows"], sign: float
) -> Equations:
    """Normal equations with the priors of parameters added or removed, as in `_with_all`."""
    for name, mean, std in layout.priors:
        column = layout.index(name)
        value = layout.parameters[column].to_physical(estimate.shared[column])
        off = np.full(len(among), (value - mean) / std)
        equations = _with(equations, column, off, layout.parameters[column].slope(value) / std, sign * among / max(int(among.sum()), 1))
    return equations


def _with(
    equations: Equations, column: int, off: Float[np.ndarray, " windows"], slope: float, share: Float[np.ndarray, " windows"]
) -> Equations:
    """Normal equations with a share of one prior in each window: on `off`, in standard deviations, with `slope` by one unknown."""
    hessian, gradient = equations.hessian.copy(), equations.gradient.copy()
    hessian[:, column, column] += share * slope**2
    gradient[:, column] += share * slope * off
    return dataclasses.replace(equations, hessian=hessian, gradient=gradient, cost=equations.cost + 0.5 * share * off**2)
