"""The fit's peer: SciPy `least_squares` with finite differences around a compiled simulator.

Same windows, same data, same unknowns, same start, same residuals and the same weak prior on the gap errors as the program's own fit.
"""

import dataclasses
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix, lil_matrix, vstack

from benchmarks.fit import peer_kernel as kernel
from identification.least_squares.fit import free_unknowns
from identification.windows.layout import GAP_PRIOR_STD, Estimate
from identification.windows.prepare import Prepared

_CODES = {
    "hammer_displacement": kernel.HAMMER,
    "cart_displacement": kernel.CART,
    "hammer_acceleration": kernel.ACCELERATION,
    "impact_force": kernel.FORCE,
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class PeerFit:
    """Where the peer ended."""

    estimate: Estimate
    cost: float
    seconds: float
    jacobians: int | None
    """None where MINPACK does not tell."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variant:
    """One way to call `least_squares`."""

    title: str
    options: dict
    sparse: bool = False


VARIANTS = {
    "scipy_fd": Variant(title="SciPy, dense two-point differences", options={"method": "trf", "x_scale": "jac"}),
    "scipy_fd_minpack": Variant(title="SciPy, MINPACK", options={"method": "lm", "x_scale": "jac"}),
    "scipy_fd_sparse": Variant(title="SciPy, sparse differences", options={"method": "trf", "x_scale": "jac", "ftol": 1e-10}, sparse=True),
}


class Problem:
    """The residual vector of all windows as a function of one vector of unknowns: shared, free nuisances, window states."""

    def __init__(self, prepared: Prepared, *, substeps: int) -> None:
        (group,) = prepared.groups
        self.prepared, self.substeps = prepared, substeps
        self.active = free_unknowns(prepared)
        self.windows = group
        used = [np.arange(samples) for samples in group.lengths]
        self.counts = np.asarray(group.lengths, dtype=np.int64)
        self.offsets = np.concatenate([[0], np.cumsum(self.counts)[:-1]])
        self.measured = np.concatenate([group.measured[lane, index] for lane, index in enumerate(used)])
        self.weight = np.concatenate([group.weight[lane, index] for lane, index in enumerate(used)])
        self.steps = np.array([(t[n - 1] - t[0]) / (n - 1) for t, n in zip(group.ts, self.counts, strict=True)])
        self.codes = np.array([_CODES[name] for name in group.channels])
        self.owners = np.concatenate([np.full(n, record) for n, record in zip(self.counts, group.record, strict=True)])

    def pack(self, estimate: Estimate) -> np.ndarray:
        """Vector of unknowns."""
        return np.concatenate([estimate.shared, estimate.nuisances[self.active.nuisances], estimate.states.ravel()])

    def unpack(self, vector: np.ndarray) -> Estimate:
        """The inverse of `pack`; unknowns that are not free stay as they start."""
        shared, count = len(self.prepared.start.shared), int(self.active.nuisances.sum())
        nuisances = self.prepared.start.nuisances.copy()
        nuisances[self.active.nuisances] = vector[shared : shared + count]
        return Estimate(shared=vector[:shared], nuisances=nuisances, states=vector[shared + count :].reshape(-1, 2))

    def data_residuals(self, estimate: Estimate, *, substeps: int | None = None) -> np.ndarray:
        """(samples of all windows, channels)."""
        values, group = self.prepared.layout.physical(estimate.shared), self.windows
        rows = np.empty((len(self.counts), 10))
        mass = values.get("m", self.prepared.model.mass)
        rows[:, :6] = mass, values["zeta"], 2 * np.pi * values["f_n"], values["k_i"], values["n"], values["lambda_i"]
        amplitude, phase, gap_error = estimate.nuisances[group.record].T
        rows[:, 6:] = np.stack([group.gap + gap_error, amplitude, 2 * np.pi * group.frequency_hz, phase], axis=1)
        out = np.empty_like(self.measured)
        kernel.residuals(
            np.ascontiguousarray(group.ts[:, 0]),
            self.steps,
            self.counts,
            self.offsets,
            rows,
            np.ascontiguousarray(estimate.states),
            self.codes,
            self.measured,
            self.weight,
            substeps or self.substeps,
            out,
        )
        return out

    def size(self, estimate: Estimate) -> dict[str, int]:
        """Counts of samples, channels, residuals and unknowns."""
        return {
            "samples": len(self.measured),
            "channels": len(self.codes),
            "residuals": self.measured.size + len(estimate.nuisances),
            "unknowns": len(self.pack(estimate)),
        }

    def __call__(self, vector: np.ndarray) -> np.ndarray:
        """What SciPy squares and adds up."""
        estimate = self.unpack(vector)
        return np.concatenate([self.data_residuals(estimate).ravel(), estimate.nuisances[:, 2] / GAP_PRIOR_STD])

    def sparsity(self) -> csr_matrix:
        """Which unknowns each residual depends on."""
        shared, free = len(self.prepared.start.shared), self.active.nuisances
        number = np.full(free.shape, -1)
        number[free] = shared + np.arange(free.sum())
        first_state, channels = shared + int(free.sum()), len(self.codes)
        lane = np.repeat(np.arange(len(self.counts)), self.counts)
        columns = [np.full(len(lane), i) for i in range(shared)]
        columns += [number[self.owners, i] for i in range(free.shape[1])]
        columns += [first_state + 2 * lane, first_state + 2 * lane + 1]
        table = np.repeat(np.stack(columns, axis=1), channels, axis=0)
        rows = np.broadcast_to(np.arange(len(table))[:, None], table.shape)
        there = table >= 0
        width = first_state + 2 * len(self.counts)
        data = csr_matrix((np.ones(there.sum()), (rows[there], table[there])), (len(table), width))
        prior = lil_matrix((len(free), width))
        for record in np.flatnonzero(free[:, 2]):
            prior[record, number[record, 2]] = 1.0
        return csr_matrix(vstack([data, prior]))


def peer_fit(problem: Problem, start: Estimate, variant: Variant) -> PeerFit:
    """SciPy's fit from `start`; the simulator is compiled before the clock starts."""
    vector = problem.pack(start)
    problem(vector)
    before = time.perf_counter()
    sparsity = problem.sparsity() if variant.sparse else None
    found = least_squares(problem, vector, jac="2-point", jac_sparsity=sparsity, **variant.options)
    return PeerFit(
        estimate=problem.unpack(found.x),
        cost=float(found.cost),
        seconds=time.perf_counter() - before,
        jacobians=None if found.njev is None else int(found.njev),
    )
