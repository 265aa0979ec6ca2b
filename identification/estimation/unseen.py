"""Held-back records under the parameters of a fit to the others: a chain of their own, and its prediction."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.estimation.horizons import horizons
from identification.estimation.prediction import record_fits
from identification.experiment import Experiment
from identification.result.result import RecordFit
from identification.trajectory.fit import Fitted, fit
from identification.trajectory.remodel import remodelled, with_variation
from identification.trajectory.segments import VARIATION
from identification.trajectory.start import problem_of

SIGNAL = 9.0
"""Ratio of a channel's variance to its noise variance below which the channel holds no signal to predict."""


def held_back_chain(fitted: Fitted, experiment: Experiment, progress: Callable[[str], None] = lambda line: None) -> Fitted | None:
    """The held-back records with the shared parameters of a fit held; None where no record is held back.

    Estimated from them are their states, random force and reading errors, and each record's own numbers.
    """
    if not experiment.held_back:
        return None
    records = tuple(dataclasses.replace(record, held_back=False) for record in experiment.held_back)
    model = fitted.problem.model_at(fitted.at)
    problem = problem_of(dataclasses.replace(experiment, records=records, parameters={}), law=model.law.name)
    if model.effects:
        problem = remodelled(problem, problem.start, dataclasses.replace(problem.model, effects=model.effects))
    of_fit, border = fitted.problem.unknowns, fitted.problem.border
    varying = {
        name.partition(".")[2]: float(border.own_scale[place])
        for place, name in enumerate(of_fit.own)
        if name.startswith(VARIATION) and border.own[:, place].any()
    }
    problem = with_variation(problem, varying)
    shared = np.array([fitted.at.shared[of_fit.index(name)] for name, _ in problem.unknowns.shared])
    held = dataclasses.replace(problem.border, shared=np.zeros(len(shared), bool))
    start = dataclasses.replace(problem.start, shared=shared)
    return fit(dataclasses.replace(problem, border=held, start=start), progress=progress)


def held_back_fits(fitted: Fitted, experiment: Experiment, progress: Callable[[str], None] = lambda line: None) -> tuple[RecordFit, ...]:
    """Prediction of every held-back record, in their order, with the errors of forecasts."""
    return forecasts(held_back_chain(fitted, experiment, progress))


def forecasts(chain: Fitted | None) -> tuple[RecordFit, ...]:
    """Records of a held-back chain with their predictions and the errors of forecasts; none without a chain."""
    if chain is None:
        return ()
    return tuple(dataclasses.replace(one, horizons=far) for one, far in zip(record_fits(chain), horizons(chain), strict=True))


def rms_nrmse(records: tuple[RecordFit, ...]) -> float:
    """Root mean square of the normalised errors over all channels with signal.

    A prediction that is off by more than the signal itself has failed, and counts as 1: how far off a motion ends up that parts from the
    recorded one, as a chaotic one does, says nothing of the model.
    """
    errors = [error for record in records for channel, error in record.nrmse.items() if has_signal(record, channel)]
    return float(np.sqrt(np.mean(np.minimum(np.nan_to_num(errors, nan=1.0), 1.0) ** 2))) if errors else float("nan")


def has_signal(record: RecordFit, channel: str) -> bool:
    """Whether a channel's variance exceeds that of its noise by the factor `SIGNAL`."""
    return bool(np.nanvar(record.measured[channel]) > SIGNAL * record.noise[channel] ** 2)
