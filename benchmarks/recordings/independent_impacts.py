"""`python -m benchmarks.recordings.independent_impacts --data DIR NAME`: which stop does a plain least-squares fit of collisions prefer?

Nothing of the program takes part but the reading of the recordings. Each record is one simulation from its first sample to its last
(single shooting), all samples count alike, and each record in turn is left out of the fit and then predicted; there, only its initial state
and the place of the stop are fitted.
"""

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numba import njit
from rich.console import Console
from rich.table import Table
from scipy.optimize import least_squares
from scipy.sparse import block_diag, hstack

from identification.experiment import load_experiment
from identification.recipes.load import load_recipe, recipe_experiment

RECIPES = ("airtrack_rubber", "airtrack_collisions")
STOPS = {"firm": (0, 1, 2), "that loses a share of its force": (0, 1, 2, 3), "on a spring": (0, 1, 2, 4, 5, 6)}
"""Free numbers of `simulated` by the kind of stop."""
_FIRST = np.array([np.log(1e4), 1.5, np.log(0.3), 0.0, np.log(5e3), np.log(10.0), np.log(0.02)])
_FIRM = np.array([0.0, 0.0, 0.0, 0.0, np.log(1e9), np.log(300.0), np.log(1.0)])
"""Held numbers: a support of 1 GN/m."""
_SUBSTEPS = 20
"""In a sampling interval."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Collision:
    """One record: time, s; displacement towards the stop, m; stated place of the stop, m; mass, kg."""

    file: str
    time: np.ndarray
    u: np.ndarray
    gap: float
    mass: float

    @property
    def begin(self) -> np.ndarray:
        """First displacement, m, and speed, m/s, by a straight line through the first 30 ms, and place of the stop, m."""
        early = self.time < self.time[0] + 0.03
        slope, start = np.polyfit(self.time[early] - self.time[0], self.u[early], 1)
        return np.array([start, slope, self.gap])

    def residual(self, shared: np.ndarray, own: np.ndarray, *, firm: bool) -> np.ndarray:
        """Simulated less recorded displacement, mm."""
        found = simulated(self.time, self.mass, shared, own, firm, _SUBSTEPS)
        return 1e3 * np.clip(np.nan_to_num(found - self.u, nan=1.0), -1.0, 1.0)


@njit(cache=True)
def simulated(time, mass, shared, own, firm, substeps):
    """Displacement at the samples, m, by the classical Runge-Kutta method.

    m u'' = -F, m_s s'' = F - k_s s - c_s s', F = k d^n (1 + lambda d') (1 + h sign d') >= 0, d = u - gap - s. `shared` holds log k, n,
    log lambda, h, and k_s, f_s, zeta_s by their logarithms; `own` the first u and u', and the gap. A `firm` stop has no s.
    """
    found = np.empty(len(time))
    k, n, damping, share = np.exp(shared[0]), shared[1], np.exp(shared[2]), shared[3]
    stiffness, omega, ratio = np.exp(shared[4]), 2.0 * np.pi * np.exp(shared[5]), np.exp(shared[6])
    z = np.array([own[0], own[1], 0.0, 0.0])
    rates, at, total = np.empty(4), np.empty(4), np.empty(4)
    for sample in range(len(time)):
        found[sample] = z[0]
        if sample == len(time) - 1:
            break
        step = (time[sample + 1] - time[sample]) / substeps
        for _ in range(substeps):
            total[:] = 0.0
            at[:] = z
            for stage in range(4):
                depth, speed = at[0] - own[2] - at[2], at[1] - at[3]
                push = 0.0
                if depth > 0.0:
                    push = k * depth**n * max(1.0 + damping * speed, 0.0) * (1.0 + share * np.tanh(speed / 0.01))
                rates[0], rates[1], rates[2], rates[3] = at[1], -push / mass, at[3], 0.0
                if firm:
                    rates[2] = 0.0
                else:
                    rates[3] = omega**2 * (push / stiffness - at[2]) - 2.0 * ratio * omega * at[3]
                total += rates * (1.0 if stage in (0, 3) else 2.0)
                at = z + (step if stage == 2 else 0.5 * step) * rates
            z = z + step / 6.0 * total
    return found


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    collisions, console = read(options.name, options.data), Console()
    table = Table("stop", "k, N/m^n", "n", "lambda, s/m", "h", "k_s, N/m", "f_s, Hz", "rms of the fit, mm", "left out in turn, %")
    for stop, free in STOPS.items():
        shared, error = fitted(collisions, free)
        with console.status(f"a stop {stop}: leaving out records in turn"):
            errors = [predicted(collisions, index, free) for index in range(len(collisions))]
        numbers = [np.exp(shared[0]), shared[1], np.exp(shared[2]), shared[3], np.exp(shared[4]), np.exp(shared[5])]
        texts = [f"{value:.4g}" if place in free else "" for place, value in enumerate(numbers)]
        table.add_row(stop, *texts, f"{error:.3f}", f"{100.0 * float(np.sqrt(np.mean(np.square(errors)))):.2f}")
    console.print(table)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(
        prog="python -m benchmarks.recordings.independent_impacts", description=(__doc__ or "").split(": ", 1)[1].split("\n")[0]
    )
    made.add_argument("--data", type=Path, required=True, help="folder above the data sets")
    made.add_argument("name", choices=RECIPES, help="recipe")
    return made


def read(name: str, data: Path) -> list[Collision]:
    """All records of a recipe that a fit uses."""
    with recipe_experiment(load_recipe(name), data) as folder:
        experiment = load_experiment(folder)
    return [
        Collision(file=one.stem, time=one.time, u=one.channels["relative_displacement"], gap=one.gap, mass=experiment.mass)
        for one in experiment.records
    ]


def fitted(collisions: Sequence[Collision], free: tuple[int, ...]) -> tuple[np.ndarray, float]:
    """Shared numbers of a least-squares fit to all samples, and its rms error, mm; from the fit of a firm stop on."""
    firm, own, error = _optimum(
        collisions, STOPS["firm"], _FIRM + np.where(np.arange(7) < 3, _FIRST, 0.0), [one.begin for one in collisions]
    )
    if free == STOPS["firm"]:
        return firm, error
    shared, _, error = _optimum(collisions, free, np.where(np.arange(7) < 3, firm, _FIRST), own)
    return shared, error


def _optimum(collisions: Sequence[Collision], free: tuple[int, ...], shared: np.ndarray, own) -> tuple[np.ndarray, np.ndarray, float]:
    """Shared numbers, of which some are free, those of each record, and the rms error, mm."""
    firm, places = 4 not in free, list(free)

    def parts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = shared.copy()
        found[places] = values[: len(free)]
        return found, values[len(free) :].reshape(-1, 3)

    def residual(values: np.ndarray) -> np.ndarray:
        found, begin = parts(values)
        return np.concatenate([one.residual(found, each, firm=firm) for one, each in zip(collisions, begin, strict=True)])

    start = np.concatenate([shared[places], np.ravel(own)])
    scale = np.concatenate([np.full(len(free), 0.1), np.full(3 * len(collisions), 1e-3)])
    most = np.full(len(start), np.inf)
    most[[place for place, number in enumerate(free) if number == 6]] = 0.0  # a damping ratio of one
    lengths = [len(one.time) for one in collisions]
    of_records = block_diag([np.ones((length, 3)) for length in lengths])
    depends = hstack([np.ones((sum(lengths), len(free))), of_records])
    optimum = least_squares(
        residual, start, bounds=(-np.inf, most), x_scale=scale, diff_step=1e-6, ftol=1e-6, max_nfev=200, jac_sparsity=depends
    )
    return *parts(optimum.x), float(np.sqrt(np.mean(optimum.fun**2)))


def predicted(collisions: Sequence[Collision], left_out: int, free: tuple[int, ...]) -> float:
    """Error on a record left out of the fit, over its standard deviation; only its initial state and the stop's place are fitted there."""
    shared, _ = fitted([one for index, one in enumerate(collisions) if index != left_out], free)
    mine, firm = collisions[left_out], 4 not in free
    found = least_squares(lambda own: mine.residual(shared, own, firm=firm), mine.begin, x_scale=1e-3, diff_step=1e-6, ftol=1e-6)
    return float(np.sqrt(np.mean(found.fun**2)) / np.std(1e3 * mine.u))


if __name__ == "__main__":
    main()
