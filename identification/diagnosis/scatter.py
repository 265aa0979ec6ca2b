"""Parameters that differ between records: an alternative to every effect, since a rig that does not repeat itself may look like one.

Source: R. DerSimonian, N. Laird, Controlled Clinical Trials 7 (1986) 177-188 (random effects); W. G. Cochran, Biometrics 10 (1954) 101-129
(homogeneity).
"""

import dataclasses

import numpy as np
from scipy.optimize import minimize

from identification.diagnosis.augment import refitted
from identification.diagnosis.decide import LEVEL
from identification.estimation.parameters import between_records
from identification.estimation.varying import with_variations
from identification.result.evidence import chance
from identification.trajectory.additions import Reestimated, reestimated
from identification.trajectory.fit import Fitted, Progress
from identification.trajectory.remodel import with_variation
from identification.trajectory.segments import VARIATION
from identification.trajectory.variances import is_largest
from vibrojax.errors import NoConvergenceError

_COLUMNS = 48
"""Values that are weighed together at first order, at most."""
_LOGS = (-7.0, 3.0)
"""Range of a standard deviation over the values of the records, logarithms."""


def contradicted(fitted: Fitted) -> tuple[str, ...]:
    """Nominal parameters that may differ between records: all that these identify, where they contradict each other in one of them.

    The most contradicted first; none once one has a value in each record, nor beside a random force as large as it may be, where physics is
    missing that acts on each record in its own way. A record hardly tells k_i from n by itself, so that the test of one alone says little.
    """
    if is_largest(fitted.problem, fitted.variances.force):
        return ()
    tested = sorted((one for one in between_records(fitted) if "." not in one.name), key=lambda one: one.chance)
    contradict = any(one.chance < LEVEL / len(tested) for one in tested) and not differing(fitted)
    return tuple(one.name for one in tested) if contradict else ()


def differing(fitted: Fitted) -> tuple[str, ...]:
    """Parameters that have a value in each record."""
    problem = fitted.problem
    own = [name for place, name in enumerate(problem.unknowns.own) if problem.border.own[:, place].any()]
    return tuple(name.removeprefix(VARIATION) for name in own if name.startswith(VARIATION))


def gain_of_values(fitted: Fitted, names: tuple[str, ...]) -> tuple[float, int]:
    """Gain of twice the log likelihood by a value in each record, and how many standard deviations that adds.

    Values are normal about a common mean. At first order, all variances estimated anew; of those parameters of which that says most by the
    information criterion, among the first ones, as far as their values are not too many to be weighed; 0 of none.
    """
    chains, linear, unknowns = fitted.problem.chains, fitted.linear, fitted.problem.unknowns
    others = range(1, len(chains.files))
    names = names[: _COLUMNS // max(len(others), 1)]
    if not names or not others:
        return 0.0, 1
    places = [len(unknowns.states) + 2 + unknowns.index(name) for name in names]
    inside = [chains.record == record for record in others]
    seen = np.stack([linear.by[..., place] * mine[:, None, None] for place in places for mine in inside], axis=-1)
    end = np.stack([linear.end_by[..., place] * mine[:, None] for place in places for mine in inside], axis=-1)
    none = reestimated(fitted, seen[..., :0], end[..., :0], fitted.variances)
    try:
        found = reestimated(fitted, seen, end, fitted.variances)
    except np.linalg.LinAlgError:  # at first order they take the motion too far to be weighed
        return 0.0, 1
    price, chosen, gain = np.log(fitted.local.samples), (), 0.0
    while len(chosen) < len(names):
        tried = {one: none.deviance - _with_scatter(found, (*chosen, one), len(names)) for one in range(len(names)) if one not in chosen}
        best = max(tried, key=lambda one: tried[one])
        if chosen and tried[best] - gain < price:
            break
        chosen, gain = (*chosen, best), tried[best]
    return gain, len(chosen)


def _with_scatter(found: Reestimated, chosen: tuple[int, ...], names: int) -> float:
    """-2 log likelihood of values in records that are normal about a mean, those of the chosen parameters; with the likeliest deviations.

    Values count from the first record's, which scatters as they do.
    """
    values = found.strengths.reshape(names, -1)
    others, usual = values.shape[1], np.maximum(np.sqrt(np.mean(values**2, axis=1)), 1e-300)
    of_one = np.kron(np.eye(names), np.eye(others) + 1.0)
    _, known = np.linalg.slogdet(found.covariance)

    def deviance(logs: np.ndarray) -> float:
        std = np.zeros(names)
        std[list(chosen)] = usual[list(chosen)] * np.exp(logs)
        covariance = found.covariance + of_one * np.repeat(std, others)[:, None] ** 2
        square = found.strengths @ np.linalg.solve(covariance, found.strengths)
        return float(found.deviance + square + np.linalg.slogdet(covariance)[1] - known)

    least = minimize(deviance, np.zeros(len(chosen)), method="L-BFGS-B", bounds=[_LOGS] * len(chosen))
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
    names = differing(fitted)
    try:
        common = with_variation(fitted.problem, dict.fromkeys(names, 0.0))
        at = dataclasses.replace(fitted.at, own=np.where(common.border.own, fitted.at.own, 0.0))
        lesser = refitted(common, at, fitted, progress)
    except (np.linalg.LinAlgError, NoConvergenceError):
        return fitted
    gain = lesser.deviance - fitted.deviance
    return lesser if lesser.converged and not chance(gain, len(names), 1) < LEVEL else fitted
