"""Damping ratio and natural frequency of the suspension: from free flight by the weak form, or from a prescribed motion."""

from collections.abc import Iterable
from functools import reduce
from operator import add

import numpy as np
from jaxtyping import Float

from identification.experiment import Load, Record
from identification.experiment.samples import bridged
from identification.guesses.motion import Kinematics, relative_displacement
from identification.guesses.weak_form import Regression, robust_regression, weak_integrals
from vibrojax.model import STANDARD_GRAVITY

UNLOADED = Load()
FEWEST = 10
"""Fewest equations of one bump length that are a regression of their own."""
SQUARE = 1
"""Place of omega_n^2 among the unknowns, after 2 zeta omega_n."""


def suspension_start(
    records: list[Record], motions: list[Kinematics | None], *, mass: float | None, load: Load = UNLOADED
) -> tuple[dict[str, float], float | None]:
    """Least-squares zeta and f_n over all flights of all records, and the mass where `mass` is None and a force was applied.

    u'' + 2 zeta omega_n u' + omega_n^2 u = -y'' + f / m, f the applied force and the known load, is multiplied by a bump phi that
    vanishes with its slope at both ends and integrated by parts, so that no record is ever differentiated:
    int(u phi'') - 2 zeta omega_n int(u phi') + omega_n^2 int(u phi) = int((f / m - y'') phi).

    Every length of the bump gives a separate regression of each record: noise dominates short ones, long ones average the vibration away.
    That with the smallest standard error of omega_n^2 counts, and records count by their information. Equations across an impact that was
    not seen are outliers, to which the regression is robust.

    Where no displacement was recorded, the same equation differentiated twice holds for the acceleration u'' = x'' - y'':
    int(u'' phi'') - 2 zeta omega_n int(u'' phi') + omega_n^2 int(u'' phi) = int((f / m - y'') phi'').

    Empty where there is no flight long enough or the solution is not a vibration.
    Source: R. Shinbrot, On the analysis of linear and nonlinear systems, Trans. ASME 79 (1957) 547-552.
    """
    found = suspension_information(records, motions, mass=mass, load=load)
    if found is None or not found.estimate[SQUARE] > 0:
        return {}, mass
    rate, square, *inverse_mass = found.estimate
    omega_n = np.sqrt(square)
    zeta = float(np.clip(rate / (2 * omega_n), 1e-3, 1.0))
    if mass is None and inverse_mass[0] > 0:
        mass = 1.0 / inverse_mass[0]
    return {"zeta": zeta, "f_n": float(omega_n / (2 * np.pi))}, mass


def suspension_information(
    records: list[Record], motions: list[Kinematics | None], *, mass: float | None, load: Load = UNLOADED
) -> Regression | None:
    """Regression of 2 zeta omega_n, omega_n^2 and, where `mass` is None, 1 / m, over all records; None without enough equations.

    Records too short for a regression of their own are put together.
    """
    parts, short = [], {}
    for record, motion in zip(records, motions, strict=True):
        if motion is None or record.kind == "prescribed":
            continue
        equations = _equations(record, motion, mass, load)
        own = best_length(regressions(equations.values()))
        if own is not None:
            parts.append(own)
            continue
        for length, pair in equations.items():
            short.setdefault((_in_acceleration(record), length), []).append(pair)
    together = {key: _joined(pairs) for key, pairs in short.items()}
    rest = best_length(regressions(together.values()))
    parts += [] if rest is None else [rest]
    if not parts and together:
        matrix, right = _joined(list(together.values()))
        parts = [robust_regression(matrix, right)] if len(right) >= 4 else []
    return reduce(add, parts) if parts else None


def _joined(pairs: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Matrices and right-hand sides of several regressions, one below the other."""
    return np.concatenate([matrix for matrix, _ in pairs]), np.concatenate([right for _, right in pairs])


def best_length(regressions: Iterable[Regression]) -> Regression | None:
    """The regression with the smallest relative error of omega_n^2; None where none shows a vibration."""
    found = [one for one in regressions if one.estimate[SQUARE] > 0.0]
    return min(found, key=lambda one: one.stderr(SQUARE) / one.estimate[SQUARE], default=None)


def regressions(equations: Iterable[tuple[np.ndarray, np.ndarray]], *, fewest: int = FEWEST) -> list[Regression]:
    """One for each length of the bumps that has enough equations."""
    return [robust_regression(matrix, right) for matrix, right in equations if len(right) >= fewest]


def _equations(
    record: Record, motion: Kinematics, mass: float | None, load: Load
) -> dict[int, tuple[Float[np.ndarray, "bumps unknowns"], Float[np.ndarray, " bumps"]]]:
    """Matrix and right-hand side of the regression, by length of the bumps.

    Where only acceleration was recorded, u'' replaces u, and phi'' replaces phi beside y'' and f. The integrals average out noise, so u is
    taken as recorded: smoothing would attenuate a vibration with few samples per period.
    """
    recorded, alone = relative_displacement(record), _in_acceleration(record)
    u = motion.a if alone else (motion.u if recorded is None else recorded)
    driven = record.kind == "forced"
    force = bridged(record.time, record.channels["applied_force"]) if driven else np.zeros_like(motion.u)
    drive, pull = STANDARD_GRAVITY * np.sin(load.incline) - motion.base_acceleration, force + load.constant_force
    dt, under = float(np.median(np.diff(record.time))), 0 if alone else 2
    found = {}
    for length, integrals in weak_integrals(np.stack([u, drive, pull]), motion.touching, dt).items():
        second, first, zeroth = integrals[..., 0].T
        driving, pulling = integrals[:, under, 1:].T
        columns = [-first, zeroth] if mass is not None else [-first, zeroth, -pulling]
        found[length] = np.stack(columns, axis=1), driving - second + (0.0 if mass is None else pulling / mass)
    return found


def _in_acceleration(record: Record) -> bool:
    """Whether only the hammer's acceleration shows its motion."""
    return relative_displacement(record) is None and "hammer_acceleration" in record.channels


def prescribed_start(records: list[Record], motions: list[Kinematics | None], *, mass: float) -> dict[str, float]:
    """Least-squares zeta and f_n from R = k u + c u' + constant over all samples clear of the stop, k = m omega_n^2, c = 2 zeta omega_n m.

    Every record has its own constant, the offset of its gauge. Empty where no motion is prescribed, or where the solution is no spring with
    a damper.
    """
    parts = []
    for index, (record, motion) in enumerate(zip(records, motions, strict=True)):
        if motion is None or record.kind != "prescribed":
            continue
        free = ~motion.touching
        own = np.zeros((int(free.sum()), len(records)))
        own[:, index] = 1.0
        parts.append((np.column_stack([motion.u[free], motion.v[free], own]), motion.inertia[free]))
    if not parts or sum(len(force) for _, force in parts) < FEWEST:
        return {}
    matrix, force = (np.concatenate(each) for each in zip(*parts, strict=True))
    (stiffness, damping, *_), *_ = np.linalg.lstsq(matrix, force, rcond=None)
    if stiffness <= 0 or damping <= 0:
        return {}
    omega_n = np.sqrt(stiffness / mass)
    return {"zeta": float(damping / (2.0 * mass * omega_n)), "f_n": float(omega_n / (2.0 * np.pi))}
