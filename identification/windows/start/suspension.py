"""Damping ratio and natural frequency from free flight, by the weak form of the equation of motion."""

import numpy as np

from identification.experiment import Load, Record
from identification.windows.kinematics import Kinematics, bridged, relative_displacement
from identification.windows.start.bumps import bumps
from vibrojax.load import STANDARD_GRAVITY

UNLOADED = Load()
_FEWEST = 10
"""Fewest equations of one bump length for a comparison of lengths by their residual."""


def suspension_start(
    records: list[Record], motions: list[Kinematics | None], *, mass: float | None, load: Load = UNLOADED
) -> tuple[dict[str, float], float | None]:
    """Least-squares zeta and f_n over all flights of all records, and the mass where `mass` is None and a force was applied.

    u'' + 2 zeta omega_n u' + omega_n^2 u = -y'' + f / m, f the applied force and the known load, is multiplied by a bump phi that
    vanishes with its slope at both ends and integrated by parts, so that no record is ever differentiated:
    int(u phi'') - 2 zeta omega_n int(u phi') + omega_n^2 int(u phi) = int((f / m - y'') phi).

    Every length of the bump gives a separate solution: noise dominates short ones, long ones average the vibration away. The solution is
    that of the length with the smallest residual of its equations, relative to their right-hand side.

    Where no displacement was recorded, the same equation differentiated twice holds for the acceleration u'' = x'' - y'':
    int(u'' phi'') - 2 zeta omega_n int(u'' phi') + omega_n^2 int(u'' phi) = int((f / m - y'') phi'').

    Empty where there is no flight long enough or the solution is not a vibration.
    Source: R. Shinbrot, On the analysis of linear and nonlinear systems, Trans. ASME 79 (1957) 547-552.
    """
    by_length: dict[tuple[bool, int], list[tuple[float, ...]]] = {}
    for record, motion in zip(records, motions, strict=True):
        if motion is not None and record.kind != "prescribed":
            for length, row in _rows(record, motion, load):
                by_length.setdefault((_in_acceleration(record), length), []).append(row)
    enough = [rows for rows in by_length.values() if len(rows) >= _FEWEST]
    if not enough:
        everything = [row for rows in by_length.values() for row in rows]
        if len(everything) < 4:
            return {}, mass
        enough = [everything]
    solution, _ = min((_solved(np.array(rows), mass) for rows in enough), key=lambda found: found[1])
    if solution[1] <= 0:
        return {}, mass
    omega_n = np.sqrt(solution[1])
    zeta = float(np.clip(solution[0] / (2 * omega_n), 1e-3, 1.0))
    found_mass = mass if mass is not None else (1.0 / solution[2] if solution[2] > 0 else None)
    return {"zeta": zeta, "f_n": float(omega_n / (2 * np.pi))}, found_mass


def _solved(rows: np.ndarray, mass: float | None) -> tuple[np.ndarray, float]:
    """Least-squares 2 zeta omega_n, omega_n^2 and, where the mass is not known, 1 / m; and the relative residual of the equations."""
    second, first, zeroth, drive, force, weight = rows.T
    columns = [-first, zeroth] if mass is not None else [-first, zeroth, -force]
    matrix = np.stack(columns, axis=1) * weight[:, None]
    right = (drive - second + (0.0 if mass is None else force / mass)) * weight
    solution, *_ = np.linalg.lstsq(matrix, right, rcond=None)
    left_over = np.sum((matrix @ solution - right) ** 2) / max(len(right) - len(solution), 1)
    return solution, float(left_over / max(np.mean(right**2), 1e-300))


def _rows(record: Record, motion: Kinematics, load: Load) -> list[tuple[int, tuple[float, ...]]]:
    """Length and weak-form integrals of every bump in every flight: of u phi'', u phi', u phi, -y'' phi, f phi, and the equation's weight.

    Where only acceleration was recorded, u'' replaces u, and phi'' replaces phi beside y'' and f. The integrals average out noise, so u is
    taken as recorded: smoothing would attenuate a vibration with few samples per period.
    """
    recorded = relative_displacement(record)
    recorded, alone = motion.u if recorded is None else recorded, _in_acceleration(record)
    dt = float(np.median(np.diff(record.time)))
    driven = record.kind == "forced"
    force = bridged(record.time, record.channels["applied_force"]) if driven else np.zeros_like(motion.u)
    force, downhill = force + load.constant_force, STANDARD_GRAVITY * np.sin(load.incline)
    rows = []
    for bump in bumps(motion.touching, dt):
        u, under = (motion.a[bump.part], bump.curve) if alone else (recorded[bump.part], bump.value)
        drive, pull = (downhill - motion.base_acceleration[bump.part]) @ under, force[bump.part] @ under
        rows.append((len(u), (u @ bump.curve, u @ bump.slope, u @ bump.value, drive, pull, bump.weight)))
    return rows


def _in_acceleration(record: Record) -> bool:
    """Whether only the hammer's acceleration shows its motion."""
    return relative_displacement(record) is None and "hammer_acceleration" in record.channels
