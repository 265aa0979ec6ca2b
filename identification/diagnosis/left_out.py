"""Prediction of what is left out: each record in turn by what the others say, or the later half of a single one.

The chain's equations at the mode give the parameters without a record, and the density of that record given all others, at the
variances found: a difference of two marginal likelihoods. Strengths are integrated over there, since a best one would have seen it.
"""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Bool

from identification.estimation.held_back import held_back_chain, rms_nrmse
from identification.estimation.prediction import brief_frequency, record_fits, strikes
from identification.experiment import Experiment
from identification.result.result import RecordFit
from identification.trajectory.elimination import Solution, solved
from identification.trajectory.fit import Fitted
from identification.trajectory.motion import Linearised
from identification.trajectory.segments import VARIATION
from identification.trajectory.variances import reweighed, vanishes
from vibrojax.errors import NoConvergenceError

_MOST_FOLDS = 6


@dataclasses.dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A fitted model with its errors on what was left out.

    Attributes:
        fitted: the model.
        density: -2 log predictive density of the records held back, else of those left out in turn; infinite where the model fails there.
        chain: of the records held back; None where there are none, or where the model fails there.
    """

    fitted: Fitted
    density: float
    chain: Fitted | None = None

    @cached_property
    def held_back(self) -> tuple[RecordFit, ...]:
        """Records that entered no fit, with their predictions."""
        return () if self.chain is None else record_fits(_unknown_values(self.chain))

    @cached_property
    def error(self) -> float:
        """Rms error of the free motion on records held back, else on those left out in turn; 1 where the model cannot follow them."""
        return rms_nrmse(self.held_back or left_out_fits(self.fitted)) if np.isfinite(self.density) else 1.0

    @cached_property
    def brief_error(self) -> float:
        """The same where motions with impacts are followed over a quarter of a period from the states that are estimated there.

        Under a random force a motion leaves the recorded one by chance, most of all at an impact that is missed, whatever the model says.
        """
        if not np.isfinite(self.density):
            return 1.0
        held_back = () if self.chain is None else record_fits(_unknown_values(self.chain), brief=True)
        return rms_nrmse(held_back or left_out_fits(self.fitted, brief=True))

    @property
    def is_shaken(self) -> bool:
        """Whether the model has a random force, and motions with impacts to predict: brief errors then compare it with others."""
        problem, at = (self.chain or self.fitted).problem, (self.chain or self.fitted).at
        records = enumerate(problem.experiment.records)
        hits = any(strikes(problem, at, index) and brief_frequency(problem, record) > 0 for index, record in records)
        return hits and not vanishes(self.fitted.problem, self.fitted.variances.force)


def errors_of(before: LeftOut, after: LeftOut, *, brief: bool) -> tuple[float, float]:
    """Errors of two models on what was left out: brief ones, or those of the free motion."""
    return (before.brief_error, after.brief_error) if brief else (before.error, after.error)


def left_out(fitted: Fitted, experiment: Experiment) -> LeftOut:
    """What a fitted model predicts of the records held back, else of each record by what the others say."""
    try:
        chain = held_back_chain(fitted, experiment)
        if chain is None:
            return LeftOut(fitted=fitted, density=left_out_density(fitted))
    except (np.linalg.LinAlgError, NoConvergenceError):  # a wrong model may leave no motion that comes near what it has not seen
        return LeftOut(fitted=fitted, density=np.inf)
    return LeftOut(fitted=fitted, density=chain.deviance, chain=chain)


def folds(fitted: Fitted) -> tuple[Bool[np.ndarray, " segments"], ...]:
    """Segments that are left out together."""
    chains = fitted.problem.chains
    records = len(chains.knots)
    if records == 1:
        return (np.arange(len(chains.record)) >= len(chains.record) // 2,)
    return tuple(chains.record % min(records, _MOST_FOLDS) == fold for fold in range(min(records, _MOST_FOLDS)))


def left_out_density(fitted: Fitted) -> float:
    """-2 log predictive density of every fold given the others, added up."""
    whole = _solved(fitted, np.zeros(len(fitted.problem.chains.record), bool)).deviance
    return float(sum(whole - _solved(fitted, fold).deviance for fold in folds(fitted)))


def left_out_fits(fitted: Fitted, *, brief: bool = False) -> tuple[RecordFit, ...]:
    """Every record with its prediction by the parameters that the others give; of a single one, its later half by those of the earlier.

    The state at its beginning, and what every record has of its own but values of common parameters, are those of the record itself.
    """
    found: dict[int, RecordFit] = {}
    for fold in folds(fitted):
        step = _solved(fitted, fold).shared
        one, at, border = fitted.solution, fitted.at, fitted.problem.border
        own = -one.own_by_shared @ step
        rows = np.repeat(np.arange(len(own)), [knots.stop - knots.start for knots in fitted.problem.chains.knots])
        size = at.states.shape[1] + 1
        knots = -(one.by_shared @ step).reshape(-1, size) - np.einsum("kso,ko->ks", one.by_own.reshape(len(rows), size, -1), own[rows])
        moved = dataclasses.replace(
            at,
            states=at.states + knots[:, :-1],
            shared=np.clip(at.shared + step * border.shared_scale, border.lower, border.upper),
            own=at.own + own * border.own_scale,
        )
        chosen = np.unique(fitted.problem.chains.record[fold]).tolist()
        without = dataclasses.replace(fitted, at=moved)
        if len(fitted.problem.chains.knots) > 1:
            without = _unknown_values(without)
        found |= dict(zip(chosen, record_fits(without, chosen, brief=brief), strict=True))
    return tuple(found[index] for index in sorted(found))


def _unknown_values(fitted: Fitted) -> Fitted:
    """The model with the common value, where parameters have one in each record: that of a further record is not known beforehand."""
    own = np.array([name.startswith(VARIATION) for name in fitted.problem.unknowns.own], bool)
    return dataclasses.replace(fitted, at=dataclasses.replace(fitted.at, own=np.where(own, 0.0, fitted.at.own)))


def _solved(fitted: Fitted, left_out: Bool[np.ndarray, " segments"]) -> Solution:
    """The equations at the mode of what is not left out: whole records, or the beginning of one."""
    problem, linear, at = fitted.problem, fitted.linear, fitted.at
    part, rows, records = problem.chains.part(~left_out)
    border = problem.border
    border = dataclasses.replace(
        border,
        own=border.own[records],
        own_mean=border.own_mean[records],
        own_precision=border.own_precision[records],
        strengths=np.zeros_like(border.strengths),
        own_strengths=np.zeros_like(border.own_strengths),
    )
    at = dataclasses.replace(at, states=at.states[rows], force=at.force[rows], own=at.own[records])
    linear = Linearised(**{f.name: getattr(linear, f.name)[~left_out] for f in dataclasses.fields(linear)})
    lesser = dataclasses.replace(problem, chains=part, border=border)
    local = reweighed(lesser, at, linear, fitted.variances.readings)
    return solved(lesser, at, local, fitted.variances.force)
