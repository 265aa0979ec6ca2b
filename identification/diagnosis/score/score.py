"""Score test of all candidates: expected decrease of chi-square due to each, orthogonal to all fitted unknowns."""

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Bool, Float

from identification.diagnosis.score.metric import Metric, Rows
from identification.diagnosis.score.metric import metric as metric_of
from identification.diagnosis.score.signature import Course, signatures
from identification.least_squares import block_arrow
from identification.likelihood.fitted import Fitted, covariance_of
from identification.likelihood.linearised import Linearised
from identification.likelihood.response import response
from identification.windows.prepare import Prepared
from vibrojax.effects import AbstractEffect

_PORTION = 8
"""Candidate members evaluated together: as many as `signatures` takes at most."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Candidate:
    """One candidate effect at its first-order estimated strength, with the expected gain.

    Attributes:
        members: effects at their probing strength; their strengths are estimated together.
        factors: strength over probing strength, by member (and record, for parameters per record).
        gain: expected decrease of chi-square (score test).
        degrees: count of estimated strengths.
    """

    members: tuple[AbstractEffect, ...]
    factors: np.ndarray
    gain: float
    degrees: int

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.members[0].name


@dataclasses.dataclass(frozen=True, kw_only=True)
class Projector:
    """Projection of residual and columns onto the complement of all fitted unknowns."""

    at: Linearised
    """Windows with residuals as without the random force."""
    fit: Rows
    """Their residual and Jacobian, in this order."""
    metric: Metric
    state_gradient: np.ndarray
    """(windows, states): gradient of the fit's own cost."""
    normal: block_arrow.Reduced
    """Normal equations of all fitted unknowns, window states eliminated."""
    hessian_inverse: np.ndarray
    """Inverse of their matrix; zero for unknowns that are not estimated."""
    columns: np.ndarray
    """(windows, unknowns of a window): index of each among all unknowns."""

    def lightened(self) -> "Projector":
        """Without the large arrays that only further columns need."""
        nothing = np.zeros((0, 0, 0))
        metric = dataclasses.replace(self.metric, turned=nothing, basis=nothing)
        return dataclasses.replace(self, fit=Rows(white=nothing, along=nothing, sign=np.zeros(0)), metric=metric)

    @property
    def inverse(self) -> Float[np.ndarray, "windows states states"]:
        """Inverse of the windows' state blocks."""
        return self.normal.eliminated[0]

    @property
    def coupling(self) -> Float[np.ndarray, "windows states unknowns"]:
        """Coupling of the windows' states with the other unknowns of a window."""
        return self.normal.eliminated[1]


def projector(fitted: Fitted) -> Projector:
    """Projection orthogonal to the unknowns of a fit, in the metric of its likelihood."""
    metric, layout, at = metric_of(fitted.point), fitted.prepared.layout, fitted.point.without_force()
    return Projector(
        at=at,
        fit=metric(np.concatenate([at.residual[:, None], at.jacobian], axis=1)),
        metric=metric,
        state_gradient=fitted.posterior.equations.gradient[:, layout.size - layout.states :],
        normal=fitted.posterior.reduced,
        hessian_inverse=covariance_of(fitted),
        columns=block_arrow.columns(fitted.estimate, fitted.point.at.record),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reduced:
    """One column of the derivative with the window states projected out, window by window."""

    scores: np.ndarray
    """(windows,): contribution of each window to the score."""
    cross: np.ndarray
    """(windows, unknowns of a window): coupling with the fitted unknowns."""
    column: Rows
    """The column itself: one row."""
    on_states: np.ndarray
    """(windows, states)"""

    @property
    def squared(self) -> float:
        """Squared norm of the column."""
        return self.column.total(self.column)

    def restricted_to(self, chosen: Bool[np.ndarray, " windows"]) -> "Reduced":
        """The column restricted to some windows."""
        return Reduced(
            scores=self.scores * chosen,
            cross=self.cross * chosen[:, None],
            column=self.column.restricted_to(chosen),
            on_states=self.on_states * chosen[:, None],
        )


def reduced(by: Projector, columns: Float[np.ndarray, "windows columns time channels"]) -> list[Reduced]:
    """Project the window states out of columns of the residual's derivative."""
    rows = by.metric(columns)
    with_fit = rows.inner(by.fit)
    count = with_fit.shape[2] - by.inverse.shape[1]
    on_states = with_fit[..., count:]
    pulled = on_states @ by.inverse
    scores = with_fit[..., 0] - np.einsum("lcs,ls->lc", pulled, by.state_gradient)
    cross = with_fit[..., 1:count] - pulled @ by.coupling
    return [
        Reduced(scores=scores[:, c], cross=cross[:, c], column=rows[c : c + 1], on_states=on_states[:, c]) for c in range(columns.shape[1])
    ]


def information(by: Projector, columns: Sequence[Reduced]) -> tuple[Float[np.ndarray, " columns"], Float[np.ndarray, "columns columns"]]:
    """Score vector and Fisher information of some columns, orthogonal to all fitted unknowns."""
    coupling = np.zeros((len(columns), len(by.normal.gradient)))
    for row, one in zip(coupling, columns, strict=True):
        np.add.at(row, by.columns, one.cross)
    onto = coupling @ by.hessian_inverse
    scores = np.stack([one.scores for one in columns]).sum(axis=1) - onto @ by.normal.gradient
    matrix = np.zeros((len(columns), len(columns)))
    for i, a in enumerate(columns):
        for j, b in enumerate(columns[: i + 1]):
            matrix[i, j] = matrix[j, i] = a.column.total(b.column) - np.einsum("ls,lst,lt->", a.on_states, by.inverse, b.on_states)
    return scores, matrix - onto @ coupling.T


def score(
    prepared: Prepared, by: Projector, courses: tuple[Course, ...], candidates: Sequence[tuple[AbstractEffect, ...]], mass: float
) -> list[Candidate]:
    """Score test of every candidate, by decreasing expected gain."""
    files, at = prepared.layout.files, by.at

    def tested(batch: list[tuple[AbstractEffect, ...]]) -> list[Candidate]:
        perturbed = signatures(at, courses, files, [member for candidate in batch for member in candidate])
        columns = iter(reduced(by, np.stack([response(at, mass, one) for one in perturbed], axis=1)))
        return [_candidate(by, candidate, [next(columns) for _ in candidate]) for candidate in batch]

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        found = [one for batch in threads.map(tested, _alike(candidates)) for one in batch]
    return sorted(found, key=lambda candidate: -candidate.gain)


def _candidate(by: Projector, members: tuple[AbstractEffect, ...], columns: list[Reduced]) -> Candidate:
    per_record = any(p.per_record for p in members[0].parameters)
    if per_record:
        records = np.unique(by.at.record)
        columns = [column.restricted_to(by.at.record == record) for column in columns for record in records]
    total, matrix = information(by, columns)
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    fine = scale > 0
    if not fine.any():
        return Candidate(members=members, factors=np.zeros(len(total)), gain=0.0, degrees=len(total))
    inverse = block_arrow.covariance(matrix)
    factors = -inverse @ total
    gain = float(total @ inverse @ total)
    if len(total) == 1 and factors[0] < 0 and not members[0].probe.either_sign:
        gain, factors = 0.0, np.zeros(1)
    return Candidate(members=members, factors=factors, gain=gain, degrees=int(fine.sum()))


def _alike(candidates: Sequence[tuple[AbstractEffect, ...]]) -> list[list[tuple[AbstractEffect, ...]]]:
    """Batches of candidates of one class, channel and record."""
    kinds: dict[tuple, list[tuple[AbstractEffect, ...]]] = {}
    for members in candidates:
        kinds.setdefault((type(members[0]), members[0].channel, members[0].record, len(members)), []).append(members)
    portions = []
    for (*_, members), kind in kinds.items():
        count = max(1, _PORTION // members)
        portions += [kind[first : first + count] for first in range(0, len(kind), count)]
    return portions
