"""Parameters that differ between records: an alternative to every effect, since a rig that does not repeat itself may look like one.

Source: R. DerSimonian, N. Laird, Controlled Clinical Trials 7 (1986) 177-188 (random effects); W. G. Cochran, Biometrics 10 (1954) 101-129
(homogeneity).
"""

import dataclasses

import numpy as np

from identification.diagnosis.augment import refitted
from identification.diagnosis.decide import LEVEL
from identification.estimation.parameters import between_records
from identification.estimation.varying import with_variations
from identification.result.evidence import chance
from identification.trajectory.additions import reestimated
from identification.trajectory.fit import Fitted, Progress
from identification.trajectory.remodel import with_variation
from identification.trajectory.segments import VARIATION
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
    contradict = any(one.chance < LEVEL / len(tested) for one in tested) and not differing(fitted)
    return tuple(one.name for one in tested) if contradict else ()


def differing(fitted: Fitted) -> tuple[str, ...]:
    """Parameters that have a value in each record."""
    problem = fitted.problem
    own = [name for place, name in enumerate(problem.unknowns.own) if problem.border.own[:, place].any()]
    return tuple(name.removeprefix(VARIATION) for name in own if name.startswith(VARIATION))


def gain_of_values(fitted: Fitted, names: tuple[str, ...]) -> tuple[float, int]:
    """Gain of twice the log likelihood by a value in each record, and how many values that adds.

    At first order, all variances estimated anew; of the first names, as far as their values are not too many to be weighed, 0 of none.
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
        return none.deviance - reestimated(fitted, seen, end, fitted.variances).deviance, seen.shape[-1]
    except np.linalg.LinAlgError:  # at first order they take the motion too far to be weighed
        return 0.0, 1


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
