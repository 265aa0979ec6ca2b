"""`python -m benchmarks.recordings.independent --data DIR NAME`: which terms does a plain least-squares fit of a swinging arm prefer?

Nothing of the program takes part but the reading of the recordings. Each record is one simulation from its first sample to its last
(single shooting), all samples count alike, and each record in turn is left out of the fit and then predicted; there, only its initial state
is fitted.
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

from identification.experiment import load_experiment
from identification.recipes.load import load_recipe, recipe_experiment

RECIPES = ("free_swing", "multiarm_pendulum", "torque_pendulum")
TERMS = ("dry friction", "quadratic drag", "cubic spring")
CANDIDATES = ((), (0,), (1,), (2,), (0, 1))
"""Indices in `TERMS` of the terms beside viscous damping."""
_STEP = 2e-3
"""Longest step of the integration, s."""
_EVERY = 5e-3
"""Interval of the samples that are compared, s."""
_NOMINAL = 4
"""Parameters of the nominal model: omega, zeta, phi_0, 1 / J."""
_DIVERGED = 9.0
"""Error of a motion that diverges, rad."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Swing:
    """One record: time, s; angle, rad; moment of the motor, N m; and every how many samples are compared."""

    file: str
    time: np.ndarray
    angle: np.ndarray
    moment: np.ndarray
    every: int

    def residual(self, shared: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Simulated less recorded angle, rad."""
        found = simulated(self.time, self.moment, shared, state, _STEP) - self.angle
        return np.clip(np.nan_to_num(found, nan=_DIVERGED), -_DIVERGED, _DIVERGED)[:: self.every]


@njit(cache=True)
def simulated(time, moment, shared, state, substep):
    """Angle at the samples, rad, by the classical Runge-Kutta method; the moment is linear between samples.

    phi'' = moment / J - 2 zeta omega phi' - omega^2 sin(phi - phi_0) - (F_c tanh(phi' / v) + c phi' |phi'| + k_3 (phi - phi_0)^3)

    `shared` holds omega, zeta, phi_0, 1 / J, F_c, c, k_3, the last three per moment of inertia; v is 20 mrad/s.
    """
    found = np.empty(len(time))
    angle, rate = state
    omega, zeta, zero, admittance, friction, drag, cubic = shared
    for sample in range(len(time)):
        found[sample] = angle
        if sample == len(time) - 1:
            break
        whole = time[sample + 1] - time[sample]
        steps = int(np.ceil(whole / substep))
        step = whole / steps
        for part in range(steps):
            first = (moment[sample] * (steps - part) + moment[sample + 1] * part) / steps
            last = (moment[sample] * (steps - part - 1) + moment[sample + 1] * (part + 1)) / steps
            a, v = np.empty(4), np.empty(4)
            at, speed = angle, rate
            for stage in range(4):
                push = first if stage == 0 else last if stage == 3 else 0.5 * (first + last)
                v[stage] = speed
                a[stage] = push * admittance - 2.0 * zeta * omega * speed - omega**2 * np.sin(at - zero)
                a[stage] -= friction * np.tanh(speed / 0.02) + drag * speed * abs(speed) + cubic * (at - zero) ** 3
                ahead = step if stage == 2 else 0.5 * step
                at, speed = angle + ahead * v[stage], rate + ahead * a[stage]
            angle += step / 6.0 * (v[0] + 2.0 * v[1] + 2.0 * v[2] + v[3])
            rate += step / 6.0 * (a[0] + 2.0 * a[1] + 2.0 * a[2] + a[3])
    return found


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    swings, moved = read(options.name, options.data)
    table = Table(
        "beside viscous damping", "terms per moment of inertia", "rms error of the fit, mrad", *(f"{s.file} left out, %" for s in swings)
    )
    for terms in CANDIDATES:
        shared, error = fitted(swings, terms, moved=moved)
        values = ", ".join(f"{shared[_NOMINAL + term]:.4g}" for term in terms)
        errors = [predicted(swings, index, terms, moved=moved) for index in range(len(swings))]
        names = " and ".join(TERMS[term] for term in terms) or "nothing"
        table.add_row(names, values, f"{1e3 * error:.2f}", *(f"{100.0 * one:.2f}" for one in errors))
    Console().print(table)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(
        prog="python -m benchmarks.recordings.independent", description=(__doc__ or "").split(": ", 1)[1].split("\n")[0]
    )
    made.add_argument("--data", type=Path, required=True, help="folder above the data sets")
    made.add_argument("name", choices=RECIPES, help="recipe")
    return made


def read(name: str, data: Path) -> tuple[list[Swing], bool]:
    """All records of a recipe, held back or not, and whether a motor moves the arm."""
    with recipe_experiment(load_recipe(name), data) as folder:
        records = load_experiment(folder).records
    swings = [
        Swing(
            file=record.stem,
            time=record.time,
            angle=record.channels["relative_displacement"],
            moment=record.channels.get("applied_force", np.zeros(len(record.time))),
            every=max(1, round(_EVERY / float(np.median(np.diff(record.time))))),
        )
        for record in records
    ]
    return swings, any(swing.moment.any() for swing in swings)


def fitted(swings: Sequence[Swing], terms: tuple[int, ...], *, moved: bool) -> tuple[np.ndarray, float]:
    """Shared parameters of a least-squares fit to all samples, and its rms error, rad; the terms are added to the fitted nominal model."""
    shared, states = np.zeros(_NOMINAL + len(TERMS)), np.array([[swing.angle[0], 0.0] for swing in swings])
    shared[:_NOMINAL] = _rate(swings[0]), 0.02, 0.0, 6.0
    nominal = [0, 1, 2, *((3,) if moved else ())]
    for free in (nominal, [*nominal, *(_NOMINAL + term for term in terms)]):
        shared, states, error = _optimum(swings, free, shared, states)
    return shared, error


def _optimum(swings: Sequence[Swing], free: list[int], shared: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Shared parameters, of which some are free, initial states, and the rms error, rad."""

    def parts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = shared.copy()
        found[free] = values[: len(free)]
        return found, values[len(free) :].reshape(-1, 2)

    def residual(values: np.ndarray) -> np.ndarray:
        found, begin = parts(values)
        return np.concatenate([swing.residual(found, state) for swing, state in zip(swings, begin, strict=True)])

    start = np.concatenate([shared[free], states.ravel()])
    optimum = least_squares(residual, start, x_scale=np.maximum(np.abs(start), 0.1), diff_step=1e-5, ftol=1e-6, max_nfev=60)
    return *parts(optimum.x), float(np.sqrt(np.mean(optimum.fun**2)))


def predicted(swings: Sequence[Swing], left_out: int, terms: tuple[int, ...], *, moved: bool) -> float:
    """Error on a record left out of the fit, over its standard deviation; only its initial state is fitted there."""
    shared, _ = fitted([swing for index, swing in enumerate(swings) if index != left_out], terms, moved=moved)
    mine = swings[left_out]
    found = least_squares(lambda state: mine.residual(shared, state), [mine.angle[0], 0.0], diff_step=1e-5, ftol=1e-6)
    return float(np.sqrt(np.mean(found.fun**2)) / np.std(mine.angle))


def _rate(swing: Swing) -> float:
    """Angular frequency of the strongest line, rad/s."""
    spectrum = np.abs(np.fft.rfft(swing.angle - swing.angle.mean(), 1 << 18))
    frequency = np.fft.rfftfreq(1 << 18, float(np.median(np.diff(swing.time))))
    return 2.0 * np.pi * float(frequency[np.argmax(spectrum)])


if __name__ == "__main__":
    main()
