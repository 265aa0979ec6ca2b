"""Parameters that change in the course of a record, as those of a spring that warms up do."""

import dataclasses

import numpy as np
from scipy.special import chdtrc

from identification.discrepancy.disagreement import TOLD, estimated, estimates, pride
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance

Estimated = tuple[float, float]
"""Value and standard error, SI."""
MUCH = 0.1
"""Share of the misfit from which what a drift explains is much of it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Drift:
    """How a parameter differs between the first half of records and their second.

    Attributes:
        name: of the parameter.
        chance: that noise alone makes the halves of all records differ as much.
        gain: drop of chi-square if every half had its own value, beside what another value for each record brings.
        change: root mean square over records, weighed with and beyond their errors, in the parameter's internal coordinate.
        halves: by file, what the first and the second half of its windows alone would estimate.
    """

    name: str
    chance: float
    gain: float
    change: float
    halves: dict[str, tuple[Estimated, Estimated]]

    @property
    def surest(self) -> str:
        """File of the record in which the change is largest beside its error."""

        def sure(file: str) -> float:
            (early, early_error), (late, late_error) = self.halves[file]
            return abs(late - early) / np.hypot(early_error, late_error)

        return max(self.halves, key=sure)


def drifts(fitted: Fitted, allowed: Tolerance) -> tuple[Drift, ...]:
    """Every estimated parameter that both halves of a record determine, of at least one.

    The squared differences between halves over their variances sum to a chi-square, one degree of freedom a record, where the model is
    complete; see `estimates`.
    """
    shared, proud, halves, found = fitted.outcome.estimate.shared, pride(fitted, allowed), _halves(fitted), []
    shift, sigma = estimates(fitted, allowed, [half for pair in halves.values() for half in pair])
    shift, sigma = shift.reshape(-1, 2, len(shared)), proud * sigma.reshape(-1, 2, len(shared))
    for index, p in enumerate(fitted.prepared.layout.parameters):
        told = np.all(sigma[:, :, index] < TOLD, axis=1)
        if not told.any():
            continue
        moved, errors = shared[index] + shift[told, :, index], sigma[told, :, index]
        weight = 1.0 / np.sum(errors**2, axis=1)
        chi2, count = float(np.sum(weight * np.diff(moved, axis=1)[:, 0] ** 2)), int(told.sum())
        files = [file for file, known in zip(halves, told, strict=True) if known]
        own = {files[k]: (estimated(p, moved[k, 0], errors[k, 0]), estimated(p, moved[k, 1], errors[k, 1])) for k in range(count)}
        change = float(np.sqrt(max(chi2 - count, 0.0) / np.sum(weight)))
        found.append(Drift(name=p.name, chance=float(chdtrc(count, chi2)), gain=proud**2 * chi2, change=change, halves=own))
    return tuple(found)


def _halves(fitted: Fitted) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Windows of the first and of the second half of every record that has two windows or more, by its file."""
    prepared = fitted.prepared
    first, found = np.concatenate([group.first for group in prepared.groups]), {}
    for index, record in enumerate(prepared.experiment.records):
        mine = prepared.record == index
        late = mine & (first > np.median(first[mine]))
        if late.any():
            found[record.file] = mine & ~late, late
    return found
