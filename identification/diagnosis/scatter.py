"""Parameters that differ between records: an alternative to every effect, since a rig that does not repeat itself may look like one.

Source: R. DerSimonian, N. Laird, Controlled Clinical Trials 7 (1986) 177-188 (random effects); W. G. Cochran, Biometrics 10 (1954) 101-129
(homogeneity).
"""

import dataclasses

import numpy as np
from scipy.optimize import minimize

from identification.diagnosis.augment import only_by_force, refitted
from identification.diagnosis.decide import LEVEL
from identification.estimation.parameters import LARGEST_STDERR, between_records, record_estimates, variations
from identification.estimation.varying import LOGS, with_variations
from identification.result.evidence import chance
from identification.trajectory.additions import Reestimated, reestimated
from identification.trajectory.fit import Fitted, Progress
from identification.trajectory.remodel import with_variation
from identification.trajectory.variances import is_largest
from vibrojax.errors import NoConvergenceError

_COLUMNS = 48
"""Values that are weighed together at first order, at most."""


def contradicted(fitted: Fitted) -> tuple[str, ...]:
    """Nominal parameters that may differ between records: all that these identify, where they contradict each other in one of them.

    The most contradicted first; none once one has a value in each record, nor beside a random force as large as it may be, where physics is
    missing that acts on each record in its own way. A record hardly tells k_i from n by itself, so that the test of one alone says little.
    """
    if is_largest(fitted.problem, fitted.variances.force):
        return ()
    tested = sorted((one for one in between_records(fitted) if "." not in one.name), key=lambda one: one.chance)
    contradict = any(one.chance < LEVEL / len(tested) for one in tested) and not variations(fitted.problem)
    return tuple(one.name for one in tested) if contradict else ()


def gain_of_values(fitted: Fitted, names: tuple[str, ...]) -> tuple[float, int]:
    """Gain of twice the log likelihood by a value in each record, and how many standard deviations that adds.

    Values are normal about a common mean. At first order, all variances estimated anew; of those parameters that gain most by the
    information criterion, among the first ones, as far as their values are not too many to be weighed; 0 of none.
    """
    chains, linear, unknowns = fitted.problem.chains, fitted.linear, fitted.problem.unknowns
    errors = record_estimates(fitted)[1]
    columns: list[tuple[str, int]] = []  # the deviation of a record from the one that says most of the parameter
    for name in names:
        error = errors[:, unknowns.index(name)]
        others = [record for record in np.argsort(error)[1:] if error[record] < LARGEST_STDERR]
        if len(columns) + len(others) <= _COLUMNS:
            columns += [(name, int(record)) for record in others]
    if not columns:
        return 0.0, 1
    place = [len(unknowns.states) + 2 + unknowns.index(name) for name, _ in columns]
    inside = np.stack([chains.record == record for _, record in columns], axis=-1)
    seen, end = linear.by[..., place] * inside[:, None, None], linear.end_by[..., place] * inside[:, None]
    none = reestimated(fitted, seen[..., :0], end[..., :0])
    of, price, chosen, gain = np.array([name for name, _ in columns]), np.log(fitted.local.samples), (), 0.0
    try:
        found = reestimated(fitted, seen, end)
        while left := [name for name in dict.fromkeys(of) if name not in chosen]:
            tried = {name: none.deviance - _with_scatter(found, of, (*chosen, name)) for name in left}
            best = max(tried, key=lambda name: tried[name])
            if chosen and tried[best] - gain < price:
                break
            chosen, gain = (*chosen, best), tried[best]
    except np.linalg.LinAlgError:  # at first order they take the motion too far to be weighed
        return 0.0, 1
    return gain, len(chosen)


def _with_scatter(found: Reestimated, of: np.ndarray, chosen: tuple[str, ...]) -> float:
    """-2 log likelihood of deviations of these parameters that are normal, of the chosen ones, and 0 of the others.

    A deviation counts from another record's, which is normal, too. Standard deviations are the likeliest ones.
    """
    values, variances = found.strengths, np.diag(found.covariance)
    of_one = [(of[:, None] == name) & (of == name) for name in chosen]
    common = [np.where(both, 1.0 + np.eye(len(of)), 0.0) for both in of_one]
    usual = [np.sqrt(np.sum((values**2 / variances)[of == name]) / np.sum(1.0 / variances[of == name])) for name in chosen]
    known = np.linalg.slogdet(found.covariance)[1]

    def deviance(logs: np.ndarray) -> float:
        scatter = (square * (max(size, 1e-300) * np.exp(log)) ** 2 for square, size, log in zip(common, usual, logs, strict=True))
        covariance = found.covariance + sum(scatter)
        return float(found.deviance + values @ np.linalg.solve(covariance, values) + np.linalg.slogdet(covariance)[1] - known)

    least = minimize(deviance, np.zeros(len(chosen)), method="L-BFGS-B", bounds=[LOGS] * len(chosen))
    return float(least.fun)


def with_values(fitted: Fitted, names: tuple[str, ...], progress: Progress) -> Fitted | None:
    """The model with a value of these parameters in each record; None where it cannot be fitted, or gains no more than chance."""
    try:
        found, std = with_variations(fitted, names, progress=progress)
    except (np.linalg.LinAlgError, NoConvergenceError):
        return None
    varying = sum(size > 0.0 for size in std.values())
    return found if found.converged and varying and chance(fitted.deviance - found.deviance, varying, 1) < LEVEL else None


def if_still_needed(fitted: Fitted, progress: Progress) -> Fitted:
    """The model, with one value for all records where they no longer say otherwise."""
    names = tuple(variations(fitted.problem))
    try:
        common = with_variation(fitted.problem, dict.fromkeys(names, 0.0))
        at = dataclasses.replace(fitted.at, own=np.where(common.border.own, fitted.at.own, 0.0))
        lesser = refitted(common, at, fitted, progress)
    except (np.linalg.LinAlgError, NoConvergenceError):
        return fitted
    gain = lesser.deviance - fitted.deviance
    needed = only_by_force(lesser, fitted) or chance(gain, len(names), 1) < LEVEL
    return lesser if lesser.converged and not needed else fitted
