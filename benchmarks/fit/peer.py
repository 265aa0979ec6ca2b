"""The fit's peer: SciPy `least_squares` with finite differences around a compiled simulator, by multiple shooting.

Same data, same parameters, same start and the same weak prior on the gap errors as the program's own fit; the states at the starts of the
windows are free.
"""

import dataclasses
import time

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix, lil_matrix, vstack

from benchmarks.fit import peer_kernel as kernel
from benchmarks.fit.windows import Point, windows_of
from identification.guesses.parameters import GAP_PRIOR_STD_M
from identification.trajectory.start import Problem as Chain

_CODES = {
    "hammer_displacement": kernel.HAMMER,
    "cart_displacement": kernel.CART,
    "hammer_acceleration": kernel.ACCELERATION,
    "impact_force": kernel.FORCE,
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class PeerFit:
    """Where the peer ended."""

    at: Point
    sigma: np.ndarray
    """Standard errors of the shared parameters."""
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

    def __init__(self, chain: Chain, *, substeps: int) -> None:
        self.chain, self.windows, self.substeps = chain, windows_of(chain), substeps
        self.free = chain.border.own[:, :3]
        self.steps = np.array(
            [
                (self.windows.time[begin + n - 1] - self.windows.time[begin]) / (n - 1)
                for begin, n in zip(self.windows.offsets, self.windows.counts, strict=True)
            ]
        )
        self.codes = np.array([_CODES[name] for name in self.windows.channels])

    @property
    def start(self) -> Point:
        """First guess."""
        return self.windows.start

    def values(self, at: Point) -> dict[str, float]:
        """Parameters by name, SI, with the mass."""
        found = self.chain.values(dataclasses.replace(self.chain.start, shared=at.shared))
        return {"m": float(self.chain.experiment.mass)} | found

    def pack(self, at: Point) -> np.ndarray:
        """Vector of unknowns."""
        return np.concatenate([at.shared, at.nuisances[self.free], at.states.ravel()])

    def unpack(self, vector: np.ndarray) -> Point:
        """The inverse of `pack`; unknowns that are not free stay as they start."""
        shared, count = len(self.start.shared), int(self.free.sum())
        nuisances = self.start.nuisances.copy()
        nuisances[self.free] = vector[shared : shared + count]
        return Point(shared=vector[:shared], nuisances=nuisances, states=vector[shared + count :].reshape(-1, 2))

    def data_residuals(self, at: Point, *, substeps: int | None = None) -> np.ndarray:
        """(samples of all windows, channels)."""
        values, windows = self.values(at), self.windows
        rows = np.empty((len(windows.counts), 10))
        rows[:, :6] = values["m"], values["zeta"], 2 * np.pi * values["f_n"], values["k_i"], values["n"], values["lambda_i"]
        amplitude, phase, gap_error = at.nuisances[windows.record].T
        rows[:, 6:] = np.stack([windows.gap + gap_error, amplitude, 2 * np.pi * windows.frequency_hz, phase], axis=1)
        out = np.empty_like(windows.measured)
        kernel.residuals(
            windows.time[windows.offsets],
            self.steps,
            windows.counts.astype(np.int64),
            windows.offsets.astype(np.int64),
            rows,
            np.ascontiguousarray(at.states),
            self.codes,
            windows.measured,
            windows.weight,
            substeps or self.substeps,
            out,
        )
        return out

    def size(self, at: Point) -> dict[str, int]:
        """Counts of samples, channels, residuals and unknowns."""
        samples, channels = self.windows.measured.shape
        residuals = samples * channels + len(at.nuisances)
        return {"samples": samples, "channels": channels, "residuals": residuals, "unknowns": len(self.pack(at))}

    def __call__(self, vector: np.ndarray) -> np.ndarray:
        """What SciPy squares and adds up."""
        at = self.unpack(vector)
        return np.concatenate([self.data_residuals(at).ravel(), at.nuisances[:, 2] / GAP_PRIOR_STD_M])

    def sparsity(self) -> csr_matrix:
        """Which unknowns each residual depends on."""
        shared, free, windows = len(self.start.shared), self.free, self.windows
        number = np.full(free.shape, -1)
        number[free] = shared + np.arange(free.sum())
        first_state, channels = shared + int(free.sum()), len(self.codes)
        lane = np.repeat(np.arange(len(windows.counts)), windows.counts)
        columns = [np.full(len(lane), i) for i in range(shared)]
        columns += [number[windows.record[lane], i] for i in range(free.shape[1])]
        columns += [first_state + 2 * lane, first_state + 2 * lane + 1]
        table = np.repeat(np.stack(columns, axis=1), channels, axis=0)
        rows = np.broadcast_to(np.arange(len(table))[:, None], table.shape)
        there = table >= 0
        width = first_state + 2 * len(windows.counts)
        data = csr_matrix((np.ones(there.sum()), (rows[there], table[there])), (len(table), width))
        prior = lil_matrix((len(free), width))
        for record in np.flatnonzero(free[:, 2]):
            prior[record, number[record, 2]] = 1.0
        return csr_matrix(vstack([data, prior]))


def peer_fit(problem: Problem, start: Point, variant: Variant) -> PeerFit:
    """SciPy's fit from `start`; the simulator is compiled before the clock starts."""
    vector = problem.pack(start)
    problem(vector)
    before = time.perf_counter()
    sparsity = problem.sparsity() if variant.sparse else None
    found = least_squares(problem, vector, jac="2-point", jac_sparsity=sparsity, **variant.options)
    seconds = time.perf_counter() - before
    jacobian = found.jac.toarray() if variant.sparse else found.jac
    return PeerFit(
        at=problem.unpack(found.x),
        sigma=np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))[: len(start.shared)],
        cost=float(found.cost),
        seconds=seconds,
        jacobians=None if found.njev is None else int(found.njev),
    )
