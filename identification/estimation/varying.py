"""Parameters that vary between records about a common mean: random effects, their standard deviation by restricted maximum likelihood."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from identification.estimation.parameters import LARGEST_STDERR, deviance, record_estimates
from identification.trajectory.fit import Fitted, Progress, fit, settled
from identification.trajectory.motion import Estimate
from identification.trajectory.remodel import with_variation
from identification.trajectory.segments import VARIATION
from identification.trajectory.start import Problem

LOGS = (-7.0, 3.0)
"""Range of a standard deviation about the scatter of the records' own estimates, logarithms."""


def with_variations(
    fitted: Fitted, names: Sequence[str], *, seed: int = 0, progress: Progress = lambda line: None
) -> tuple[Fitted, dict[str, float]]:
    """The fit with a value of these parameters for each record, and the standard deviations, in the coordinate of the chain; 0 for none.

    A deviation is normal about 0. Its standard deviation is that of greatest restricted likelihood, one parameter after the other, and the
    chain settles under it, until none changes. Where the likelihood is greatest for none, the parameter is the same in all records.
    """
    scatter = _scatter(fitted, names)
    std = {name: size for name, size in scatter.items() if size > 0.0}
    if not std:
        return fitted, dict.fromkeys(names, 0.0)
    progress(f"fitting {', '.join(std)} with a value for each record")
    problem = with_variation(fitted.problem, std)
    found, before = fit(problem, seed=seed, at=_carried(fitted, problem), begin=fitted.variances, both=False, progress=progress), dict(std)
    for _ in range(4):
        for name in [name for name, size in std.items() if size > 0.0]:
            std[name] = _likeliest(found, name, scatter, std)
        if all(abs(np.log(max(std[n], 1e-300) / max(before[n], 1e-300))) < 0.05 for n in std):  # none changes
            break
        before = dict(std)
        found = _settled(found, std)
    varies = any(size > 0.0 for size in std.values())
    return (_settled(found, std) if varies else fitted), dict.fromkeys(names, 0.0) | std


def _settled(fitted: Fitted, std: dict[str, float]) -> Fitted:
    """The chain under these standard deviations."""
    problem = with_variation(fitted.problem, std)
    return settled(problem, _carried(fitted, problem), fitted.variances)


def _carried(fitted: Fitted, problem: Problem) -> Estimate:
    """The estimate in a problem with other deviations; new ones begin at none."""
    own = problem.start.own.copy()
    for place, name in enumerate(fitted.problem.unknowns.own):
        own[:, problem.unknowns.own.index(name)] = fitted.at.own[:, place]
    return dataclasses.replace(fitted.at, own=np.where(problem.border.own, own, 0.0))


def _scatter(fitted: Fitted, names: Sequence[str]) -> dict[str, float]:
    """Standard deviation of the records' own estimates by parameter; 0 where fewer than two records identify it, or it is held."""
    shift, sigma = record_estimates(fitted)
    found = {}
    for name in names:
        index = fitted.problem.unknowns.index(name)
        known = sigma[:, index] < LARGEST_STDERR
        found[name] = float(np.std(shift[known, index])) * fitted.problem.border.shared_scale[index] if known.sum() > 1 else 0.0
    return found


def _likeliest(fitted: Fitted, name: str, scatter: dict[str, float], std: dict[str, float]) -> float:
    """Standard deviation of greatest restricted likelihood, the others held; 0 where that is the lower end.

    The prior alone changes: with the chain's scale of a deviation kept, its normalisation 2 log std is added for each record.
    """
    problem, border, least = fitted.problem, fitted.problem.border, 1e-3  # over the scatter, which stands for none

    def cost(log_std: float) -> float:
        precision, spread = border.own_precision.copy(), 0.0
        for one, given in (std | {name: scatter[name] * float(np.exp(log_std))}).items():
            size = max(given, least * scatter[one])
            precision[:, problem.unknowns.own.index(f"{VARIATION}{one}")] = size**-2.0
            spread += 2.0 * len(precision) * float(np.log(size))
        there = dataclasses.replace(problem, border=dataclasses.replace(border, own_precision=precision))
        return deviance(dataclasses.replace(fitted, problem=there), fitted.variances.force) + spread

    found = minimize_scalar(cost, bounds=LOGS, method="bounded", options={"xatol": 0.01})
    return scatter[name] * float(np.exp(found.x)) if found.fun < cost(float(np.log(least))) - 1e-6 else 0.0
