"""Stiffness and damping of a suspension with prescribed motion, by linear regression of the force."""

import numpy as np

from identification.experiment import Record
from identification.windows.kinematics import Kinematics

_FEWEST = 10


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
    if not parts or sum(len(force) for _, force in parts) < _FEWEST:
        return {}
    matrix, force = (np.concatenate(each) for each in zip(*parts, strict=True))
    (stiffness, damping, *_), *_ = np.linalg.lstsq(matrix, force, rcond=None)
    if stiffness <= 0 or damping <= 0:
        return {}
    omega_n = np.sqrt(stiffness / mass)
    return {"zeta": float(damping / (2.0 * mass * omega_n)), "f_n": float(omega_n / (2.0 * np.pi))}
