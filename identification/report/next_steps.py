"""What an experimenter can do after a fit: from the verdict, and from what these records do not determine."""

import numpy as np

from identification.report.verdict import GOOD, Verdict
from identification.result.result import NOT_IDENTIFIABLE, FitResult
from identification.wording.names import spoken, symbol_text

RUN_MODEL = "model.json holds {which}; `vibrojax simulate` runs it for any experiment with the same rig."
_ALMOST_ONE = 0.99


def next_steps(result: FitResult, verdict: Verdict) -> tuple[str, ...]:
    """Sentences, the most urgent first."""
    steps = []
    if not result.converged:
        steps.append("Check units, signs, mass and gaps: the fit did not converge.")
    if verdict.level != GOOD:
        steps.append("`vibrojax diagnose` with the same experiment looks for what the model leaves out, and says where it acts.")
    if estimated := sorted({spoken(channel) for record in result.experiment.records for channel in record.noise_estimated}):
        steps.append(
            f"State the noise of {', '.join(estimated)} in experiment.toml, measured with the rig at rest: errors and verdict rest on it."
        )
    if unknown := [symbol_text(one.spec.symbol) for one in result.parameters if one.status == NOT_IDENTIFIABLE]:
        steps.append(f"Add records in which {', '.join(unknown)} shows, or fix {'it' if len(unknown) == 1 else 'them'} in experiment.toml.")
    if pairs := _inseparable(result):
        steps.append(f"Impacts at other speeds would separate {', '.join(pairs)}: their errors hold only for the pair.")
    if not result.held_back:
        steps.append("Mark a record with `held_back = true` and fit again: its misfit then says how well the model predicts.")
    return (*steps, RUN_MODEL.format(which="the fitted model"))


def _inseparable(result: FitResult) -> list[str]:
    """Pairs of contact parameters whose estimates are almost perfectly correlated."""
    symbols = {p.spec.name: symbol_text(p.spec.symbol) for p in result.parameters}
    law = {p.name for p in result.model.law.parameters}
    return [
        f"{symbols[first]} and {symbols[second]}"
        for i, first in enumerate(result.correlated)
        for j, second in enumerate(result.correlated[:i])
        if {first, second} <= law and np.abs(result.correlation[i, j]) > _ALMOST_ONE
    ]
