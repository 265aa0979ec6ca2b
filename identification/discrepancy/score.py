"""Score test of all candidates at once: how much each would lower chi-square, orthogonal to everything already fitted."""

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from identification.block_arrow import GAP_PRIOR_STD, covariance
from identification.discrepancy.linearised import Linearised
from identification.discrepancy.response import response
from identification.discrepancy.signature import Course, signatures
from identification.layout import Active, Estimate
from identification.prepare import Prepared
from vibrojax.effects import AbstractEffect

_PORTION = 8
"""Effects whose answers are worked out together."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Candidate:
    """One candidate at the strength that the records ask for, to first order.

    Attributes:
        members: its effects at their probing strength, whose strengths are estimated together.
        factors: strength over probing strength, by member (and record, for what each record has of its own).
        gain: expected drop of chi-square.
        degrees: count of estimated strengths.
        scatter: the gain divided by what the scatter between windows allows for; about `gain` where nothing else is missing.
    """

    members: tuple[AbstractEffect, ...]
    factors: np.ndarray
    gain: float
    degrees: int
    scatter: float

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.members[0].name


@dataclasses.dataclass(frozen=True, kw_only=True)
class Projector:
    """What the fit already explains, taken out of residual and columns."""

    at: Linearised
    inverse: np.ndarray
    coupling: np.ndarray
    state_gradient: np.ndarray
    hessian_inverse: np.ndarray
    gradient: np.ndarray
    active: np.ndarray
    columns: np.ndarray
    """(windows, unknowns of a window): where each stands among all."""
    weights: np.ndarray
    """(windows,) share that each window counts with."""


def projector(prepared: Prepared, at: Linearised, estimate: Estimate, active: Active, weights: np.ndarray) -> Projector:
    """Normal equations of everything that the fit estimates, window states eliminated."""
    root = np.sqrt(weights)[:, None, None, None]
    jacobian = (at.jacobian * root).reshape(len(weights), at.jacobian.shape[1], -1)
    residual = (at.residual * root[:, 0]).reshape(len(weights), -1)
    layout = prepared.layout
    hessian, gradient = jacobian @ jacobian.transpose(0, 2, 1), np.einsum("lis,ls->li", jacobian, residual)
    count = layout.size - layout.states
    for column, index in enumerate(layout.free_own, start=-len(layout.free_own)):
        hessian[:, column, column] += layout.own_states[index].scale ** -2
    inverse = np.stack([covariance(block) for block in hessian[:, count:, count:]])
    coupling = hessian[:, count:, :count]
    state_gradient = gradient[:, count:]
    local = hessian[:, :count, :count] - coupling.transpose(0, 2, 1) @ inverse @ coupling
    slope = gradient[:, :count] - np.einsum("lsi,lst,lt->li", coupling, inverse, state_gradient)
    shared, width, records = layout.shared, len(layout.nuisances), len(estimate.nuisances)
    size = shared + width * records
    own = shared + width * at.record[:, None] + np.arange(width)
    columns = np.concatenate([np.broadcast_to(np.arange(shared), (len(own), shared)), own], axis=1)
    total, right = np.zeros((size, size)), np.zeros(size)
    np.add.at(total, (columns[:, :, None], columns[:, None, :]), local)
    np.add.at(right, columns, slope)
    gaps = shared + width * np.arange(records) + 2
    total[gaps, gaps] += GAP_PRIOR_STD**-2
    right[gaps] += estimate.nuisances[:, 2] * GAP_PRIOR_STD**-2
    flags = np.concatenate([active.shared, active.nuisances.ravel()])
    full = np.zeros_like(total)
    full[np.ix_(flags, flags)] = covariance(total[np.ix_(flags, flags)])
    return Projector(
        at=at,
        inverse=inverse,
        coupling=coupling,
        state_gradient=state_gradient,
        hessian_inverse=full,
        gradient=right,
        active=flags,
        columns=columns,
        weights=weights,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reduced:
    """One column after everything already fitted is taken out, window by window."""

    scores: np.ndarray
    """(windows,): what each window contributes to the score."""
    cross: np.ndarray
    """(windows, unknowns of a window): coupling with what is fitted."""
    column: np.ndarray
    """(windows, time * channels)"""
    on_states: np.ndarray
    """(windows, states)"""


def reduced(by: Projector, column: np.ndarray) -> Reduced:
    """Take the window states out of a column of the residual's derivative."""
    at, root = by.at, np.sqrt(by.weights)
    lanes = len(root)
    flat = (column * root[:, None, None]).reshape(lanes, -1)
    residual = (at.residual * root[:, None, None]).reshape(lanes, -1)
    with_fit = np.einsum("lis,ls->li", (at.jacobian).reshape(lanes, at.jacobian.shape[1], -1), flat) * root[:, None]
    count = at.jacobian.shape[1] - by.inverse.shape[1]
    on_states = with_fit[:, count:]
    pulled = np.einsum("lst,lt->ls", by.inverse, on_states)
    scores = np.einsum("ls,ls->l", flat, residual) - np.einsum("ls,ls->l", pulled, by.state_gradient)
    cross = with_fit[:, :count] - np.einsum("lsi,ls->li", by.coupling, pulled)
    return Reduced(scores=scores, cross=cross, column=flat, on_states=on_states)


def information(by: Projector, columns: Sequence[Reduced]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Score (m,), information (m, m) and the windows' scores (m, windows) of some columns, orthogonal to the fit."""
    size = len(by.gradient)
    coupling = np.zeros((len(columns), size))
    for row, one in zip(coupling, columns, strict=True):
        np.add.at(row, by.columns, one.cross)
    onto = coupling @ by.hessian_inverse
    scores = np.stack([one.scores for one in columns]) - np.einsum("mlc,lc->ml", onto[:, by.columns], _window_slopes(by))
    matrix = np.array(
        [[np.sum(a.column * b.column) - np.einsum("ls,lst,lt->", a.on_states, by.inverse, b.on_states) for b in columns] for a in columns]
    )
    return scores.sum(axis=1), matrix - onto @ coupling.T, scores


def _window_slopes(by: Projector) -> np.ndarray:
    """(windows, unknowns of a window): each window's part of the fit's own gradient."""
    root = by.weights[:, None]
    lanes = len(root)
    jacobian = by.at.jacobian.reshape(lanes, by.at.jacobian.shape[1], -1)
    gradient = np.einsum("lis,ls->li", jacobian, by.at.residual.reshape(lanes, -1)) * root
    count = jacobian.shape[1] - by.inverse.shape[1]
    return gradient[:, :count] - np.einsum("lsi,lst,lt->li", by.coupling, by.inverse, by.state_gradient)


def score(
    prepared: Prepared, by: Projector, courses: tuple[Course, ...], candidates: Sequence[tuple[AbstractEffect, ...]], mass: float
) -> list[Candidate]:
    """Every candidate with the gain that it promises, best first."""
    files, at = prepared.layout.files, by.at
    members = [member for candidate in candidates for member in candidate]
    columns: dict[int, Reduced] = {}

    def answer(batch: list[AbstractEffect]) -> list[tuple[int, Reduced]]:
        perturbed = signatures(at, courses, files, batch)
        return [(id(effect), reduced(by, response(at, mass, one))) for effect, one in zip(batch, perturbed, strict=True)]

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        for found in threads.map(answer, _alike(members)):
            columns.update(found)
    tested = [_candidate(by, candidate, [columns[id(member)] for member in candidate]) for candidate in candidates]
    return sorted(tested, key=lambda candidate: -candidate.gain)


def _candidate(by: Projector, members: tuple[AbstractEffect, ...], columns: list[Reduced]) -> Candidate:
    per_record = any(p.per_record for p in members[0].parameters)
    if per_record:
        records = np.unique(by.at.record)
        columns = [_only(column, by.at.record == record) for column in columns for record in records]
    total, matrix, windows = information(by, columns)
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    fine = scale > 0
    if not fine.any():
        return Candidate(members=members, factors=np.zeros(len(total)), gain=0.0, degrees=len(total), scatter=0.0)
    inverse = covariance(matrix)
    factors = -inverse @ total
    gain = float(total @ inverse @ total)
    if len(total) == 1 and members[0].one_signed and factors[0] < 0:
        gain, factors = 0.0, np.zeros(1)
    spread = windows @ windows.T
    scatter = float(total @ np.linalg.pinv(spread, hermitian=True) @ total) if gain > 0 else 0.0
    return Candidate(members=members, factors=factors, gain=gain, degrees=int(fine.sum()), scatter=scatter)


def _only(column: Reduced, chosen: np.ndarray) -> Reduced:
    """The column in some windows alone."""
    return Reduced(
        scores=column.scores * chosen,
        cross=column.cross * chosen[:, None],
        column=column.column * chosen[:, None],
        on_states=column.on_states * chosen[:, None],
    )


def _alike(members: Sequence[AbstractEffect]) -> list[list[AbstractEffect]]:
    """Effects of one class, channel and record together, in handy portions."""
    kinds: dict[tuple, list[AbstractEffect]] = {}
    for member in members:
        kinds.setdefault((type(member), member.channel, member.record), []).append(member)
    return [kind[first : first + _PORTION] for kind in kinds.values() for first in range(0, len(kind), _PORTION)]
