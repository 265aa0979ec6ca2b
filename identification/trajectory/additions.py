"""What additions to a chain would gain: columns beside its border, scored, or taken in with all variances estimated anew.

Source: C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50-57 (score test); the chain's other unknowns are eliminated exactly.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import cho_solve_banded

from identification.trajectory.chain_equations import Weighed, motion_covariance, whitened_rows, whitenings
from identification.trajectory.elimination import Solution, solved
from identification.trajectory.fit import Fitted
from identification.trajectory.motion import Estimate, Linearised
from identification.trajectory.random_force import RandomForce
from identification.trajectory.start import Problem
from identification.trajectory.step import moved
from identification.trajectory.variances import Variances, annealed, coloured, reweighed, vanishes


@dataclasses.dataclass(frozen=True, kw_only=True)
class Score:
    """Expected gain of one candidate, with its strengths at first order.

    Attributes:
        gain: of twice the log likelihood, with all other unknowns at their optimum and the variances held.
        strengths: of its columns, over their probing strengths.
        known: whether the records tell each strength from everything else; (columns,).
        directions: combinations of columns that they do tell; (columns, combinations). None where those are all.
    """

    gain: float
    strengths: np.ndarray
    known: np.ndarray
    directions: np.ndarray | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scorer:
    """The chain's equations at an estimate under given variances, ready for columns beside them.

    Attributes:
        problem, solution: of the chain.
        white: whitenings by channel.
        rows: whitened derivatives and residuals by channel.
        local: systems of the segments.
        precision: of the states at the end of every segment; (segments, states, states).
    """

    problem: Problem
    solution: Solution
    white: tuple
    rows: tuple
    local: Weighed
    precision: np.ndarray

    def score(
        self, seen: Float[np.ndarray, "segments samples channels columns"], end: Float[np.ndarray, "segments states columns"]
    ) -> "Cross":
        """Products of columns with everything in the equations; several candidates at once."""
        chains, unknowns = self.problem.chains, self.problem.unknowns
        size, shared, own = len(unknowns.states) + 1, len(unknowns.shared), len(unknowns.own)
        columns, records = seen.shape[-1], len(chains.knots)
        parts = [chains.of_record(record) for record in range(records)]
        cross = np.zeros((len(chains.left), 3 * size + shared + own, columns))
        square, right = np.zeros((records, columns, columns)), np.zeros((records, columns))
        for channel, (white, (rows, residual)) in enumerate(zip(self.white, self.rows, strict=True)):
            if not seen[:, :, channel].any():
                continue
            values = white(seen[:, :, channel])
            cross += rows.swapaxes(1, 2) @ values
            for record, part in enumerate(parts):
                flat = values[part].reshape(-1, columns)
                square[record] += flat.T @ flat
                right[record] += flat.T @ residual[part].ravel()
        acts = end.any(axis=(1, 2)) & self.local.linked
        for record, part in enumerate(parts):
            mine = part.start + np.flatnonzero(acts[part])
            pulled = self.precision[mine] @ -end[mine]
            cross[mine] += self.local.defect[mine].swapaxes(1, 2) @ pulled
            flat = pulled.reshape(-1, columns)
            square[record] -= end[mine].reshape(-1, columns).T @ flat
            right[record] += flat.T @ self.local.gap[mine].ravel()
        knots = np.zeros((chains.knot_count + 1, size, columns))
        for behind in range(3):
            knots[chains.left + behind] += cross[:, behind * size : (behind + 1) * size]
        begins = np.flatnonzero(chains.first)
        return Cross(
            knots=knots[1:].reshape(-1, columns),
            shared=np.add.reduceat(cross[:, 3 * size : 3 * size + shared], begins, axis=0),
            own=np.add.reduceat(cross[:, 3 * size + shared :], begins, axis=0),
            square=square,
            right=right,
        )

    def reduced(self, cross: "Cross") -> "Reduced":
        """What the columns say once knots and each record's own numbers have been eliminated."""
        one, size = self.solution, len(self.problem.unknowns.states) + 1
        solved = cho_solve_banded((one.factor, True), cross.knots, check_finite=False)
        gradient, information, shared = np.zeros_like(cross.right), cross.square.copy(), cross.shared.copy()
        for record, knots in enumerate(self.problem.chains.knots):
            rows = slice(size * knots.start, size * knots.stop)
            own = cross.own[record] - one.by_own[rows].T @ cross.knots[rows]
            shared[record] -= one.by_shared[rows].T @ cross.knots[rows] + one.own_by_shared[record].T @ own
            information[record] -= cross.knots[rows].T @ solved[rows] + own.T @ one.own_inverse[record] @ own
            gradient[record] = (
                cross.right[record]
                + cross.knots[rows].T @ one.knots.ravel()[rows]
                + cross.own[record].T @ one.own[record]
                + cross.shared[record].T @ one.shared
            )
        return Reduced(gradient=gradient, information=information, shared=shared, square=cross.square, covariance=one.covariance)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cross:
    """Products of columns with the unknowns, with themselves and with the residuals; by record but for the knots, which belong to one."""

    knots: np.ndarray
    shared: np.ndarray
    own: np.ndarray
    square: np.ndarray
    right: np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reduced:
    """Gradient and information of columns by record, with the shared unknowns beside them.

    Attributes:
        gradient: (records, columns).
        information: (records, columns, columns).
        shared: products with the shared unknowns; (records, shared, columns).
        square: information of the columns by themselves; (records, columns, columns).
        covariance: of the shared unknowns.
    """

    gradient: np.ndarray
    information: np.ndarray
    shared: np.ndarray
    square: np.ndarray
    covariance: np.ndarray

    def scored(self, columns: Sequence[int], counts: Bool[np.ndarray, "records columns"]) -> "Score | None":
        """Score of a candidate by its columns, each in the records in which it counts; None where it takes the motion too far.

        Directions that everything else can replace have no information left, and do not count.
        """
        both = counts[:, :, None] & counts[:, None, :]
        chosen = np.ix_(range(len(counts)), columns, columns)
        shared = (self.shared[:, :, columns] * counts[:, None, :]).sum(axis=0)
        gradient = (self.gradient[:, columns] * counts).sum(axis=0)
        information = (self.information[chosen] * both).sum(axis=0) - shared.T @ self.covariance @ shared
        if not np.isfinite(information).all():
            return None
        square = np.diagonal((self.square[chosen] * both).sum(axis=0))
        size = np.sqrt(np.where(square > 0.0, square, np.inf))  # of a column that is nowhere, nothing is known
        values, vectors = np.linalg.eigh(0.5 * (information + information.T) / np.outer(size, size))
        fine = values > 1e-8  # of the columns' own information; less is rounding
        inverse = (vectors[:, fine] / values[fine]) @ vectors[:, fine].T / np.outer(size, size)
        strengths = -inverse @ gradient
        return Score(
            gain=float(max(-gradient @ strengths, 0.0)),
            strengths=strengths,
            known=np.abs(vectors[:, ~fine]).max(axis=1, initial=0.0) < 0.5,
            directions=None if fine.all() else vectors[:, fine] / size[:, None],
        )


def some_force(fitted: Fitted) -> RandomForce:
    """The random force of a fit; a thousandth of the force of the suspension where nothing is left of it."""
    force, least = fitted.variances.force, RandomForce(std=1e-3 * fitted.problem.scales.force, memory=fitted.variances.force.memory)
    return least if vanishes(fitted.problem, force) else force


def scorer(problem: Problem, at: Estimate, linear: Linearised, variances: Variances) -> Scorer:
    """Equations of the chain under given variances."""
    white = whitenings(problem.chains, linear, variances.readings)
    local = reweighed(problem, at, linear, variances.readings)
    solution = solved(problem, at, local, variances.force)
    covariance = motion_covariance(problem.chains, problem.scales, variances.force, problem.mass(at))
    return Scorer(
        problem=problem,
        solution=solution,
        white=white,
        rows=tuple(whitened_rows(problem.chains, problem.unknowns, problem.border, linear, white)),
        local=local,
        precision=np.linalg.inv(covariance),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reestimated:
    """The chain with columns taken in, on one linearisation, and all variances estimated anew.

    Attributes:
        deviance: -2 log likelihood.
        strengths: of the columns.
        covariance: of the strengths; (columns, columns).
        variances: estimated.
        at: estimate after the step.
    """

    deviance: float
    strengths: np.ndarray
    covariance: np.ndarray
    variances: Variances
    at: Estimate


def reestimated(fitted: Fitted, seen: np.ndarray, end: np.ndarray) -> Reestimated:
    """Take columns into the border and estimate their strengths, the random force and the reading errors together.

    Strengths enter by maximum likelihood, so that models with different columns compare.
    """
    problem, linear, at = _with_columns(fitted, seen, end)
    rng, force, readings = np.random.default_rng(1), some_force(fitted), fitted.variances.readings
    tried: list[Reestimated] = []
    count, rounds = seen.shape[-1], 2
    for round_ in range(rounds + 1):
        local = reweighed(problem, at, linear, readings)
        if round_ < rounds:
            force = annealed(problem, at, local, force, evaluations=14 if round_ == 0 else 9)
        solution = solved(problem, at, local, force)
        after = moved(problem, at, solution, 1.0)
        tried.append(
            Reestimated(
                deviance=solution.deviance,
                strengths=solution.shared[len(solution.shared) - count :],
                covariance=solution.covariance[len(solution.shared) - count :, len(solution.shared) - count :],
                variances=Variances(force=force, readings=readings),
                at=dataclasses.replace(after, shared=after.shared[: len(after.shared) - count]),
            )
        )
        if round_ and tried[-2].deviance - tried[-1].deviance < 1.0:  # the variances have been found
            break
        if round_ < rounds:
            readings = coloured(problem, at, linear, local, force, rng, draws=2)
    return min(tried, key=lambda one: one.deviance)


def _with_columns(fitted: Fitted, seen: np.ndarray, end: np.ndarray) -> tuple[Problem, Linearised, Estimate]:
    """The problem with further shared unknowns, whose derivatives are given."""
    problem, linear, at, count = fitted.problem, fitted.linear, fitted.at, seen.shape[-1]
    unknowns, border = problem.unknowns, problem.border
    place = len(unknowns.states) + 2 + len(unknowns.shared)
    alive = linear.done[:, None, None]
    linear = dataclasses.replace(
        linear,
        by=np.concatenate([linear.by[..., :place], seen * alive[..., None], linear.by[..., place:]], axis=-1),
        end_by=np.concatenate([linear.end_by[..., :place], end * alive, linear.end_by[..., place:]], axis=-1),
    )
    more = {
        "shared": True,
        "shared_scale": 1.0,
        "shared_mean": 0.0,
        "shared_precision": 0.0,
        "lower": -np.inf,
        "upper": np.inf,
        "strengths": True,
    }
    border = dataclasses.replace(
        border, **{name: np.concatenate([getattr(border, name), np.full(count, value)]) for name, value in more.items()}, proximal=0.0
    )
    unknowns = dataclasses.replace(unknowns, shared=(*unknowns.shared, *((f"addition.{k}", False) for k in range(count))))
    at = dataclasses.replace(at, shared=np.concatenate([at.shared, np.zeros(count)]))
    return dataclasses.replace(problem, unknowns=unknowns, border=border), linear, at
