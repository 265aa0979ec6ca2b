"""Relative motion from acceleration alone: double integration, with constants identified from the suspension's equation of motion."""

import dataclasses

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from identification.experiment import Load, Record
from identification.experiment.samples import bridged
from identification.windows.kinematics import Kinematics, stands_out
from identification.windows.start.suspension import UNLOADED, suspension_start
from vibrojax.model import STANDARD_GRAVITY

_PERIODS = 4.0
"""Length of an integrated piece, in periods of the suspension: long enough to show its phase, short enough not to drift."""
_CLEAR = 9
"""Samples about a contact that are left out of the equations."""
_STRUCK = ("drop-test", "cart-excitation", "forced")
"""Kinds of record in which the hammer may meet its stop."""
_GRID_HZ = np.geomspace(0.3, 300.0, 61)
"""Natural frequencies of the grid search, where no record with a known cart identifies one."""
_ZETA = 0.02
Vibration = tuple[float, float]
"""omega_n, rad/s, and zeta."""


def integrated_motions(
    records: list[Record], motions: list[Kinematics | None], base: list[np.ndarray], *, mass: float, stop: bool, load: Load = UNLOADED
) -> tuple[list[Kinematics | None], dict[int, tuple[float, float]]]:
    """Relative motions, completed by double integration of the hammer's acceleration; and the sines of carts without a sensor.

    In a short piece of a record u = u_0 + v_0 t + b t^2 / 2 + double integral of (x'' - y''), with b the accelerometers' offset. While the
    hammer is clear of the stop, m x'' = f - m (2 zeta omega_n u' + omega_n^2 u). Least squares on this equation gives the three constants,
    and amplitude and phase of a sine y without a sensor, one for the whole record. zeta and omega_n come from the weak form of the same
    equation in all records with a known cart; where the cart is unknown in some, they then minimise the residual of the equations.

    Args:
        records: of the experiment.
        motions: as read from displacements; None where there are none.
        base: y'' of each record as far as known, m/s^2, shape (samples,).
        mass: of the hammer, kg.
        stop: whether the model has a stop.
        load: constant forces that are known.

    Returns:
        The motions, still None where no acceleration was recorded or where it shows no vibration on a spring; and by index of the record
        amplitude, m, and phase, rad, of the carts without a sensor.
    """
    wanted = [i for i, r in enumerate(records) if motions[i] is None and "hammer_acceleration" in r.channels and r.kind != "prescribed"]
    pieced = [_Pieced(record=records[i], rough=_rough(records[i], base[i], mass=mass, stop=stop), mass=mass, load=load) for i in wanted]
    vibration = _vibration(pieced, mass)
    if vibration is None:
        return motions, {}
    found, sines = list(motions), {}
    for index, each in zip(wanted, pieced, strict=True):
        found[index], sine = each.tied_down(vibration)
        if sine is not None:
            sines[index] = sine
    return found, sines


def _vibration(pieced: list["_Pieced"], mass: float) -> Vibration | None:
    """omega_n and zeta of the suspension; None where there is no vibration."""
    known, unseen = ([each for each in pieced if each.unseen is wanted] for wanted in (False, True))
    load = pieced[0].load if pieced else UNLOADED
    start, _ = suspension_start([each.record for each in known], [each.rough for each in known], mass=mass, load=load)
    if start and not unseen:
        return 2.0 * np.pi * start["f_n"], start["zeta"]
    if not unseen:
        return None
    begin = (2.0 * np.pi * start["f_n"], start["zeta"]) if start else _best_of_grid(unseen)

    def misfit(logarithms: np.ndarray) -> np.ndarray:
        omega_n, zeta = np.exp(logarithms)
        return np.concatenate([each.solved((omega_n, zeta), pieces_as=begin)[1] for each in pieced])

    best = least_squares(misfit, np.log(begin), bounds=(np.log(begin) - np.log(4.0), np.log(begin) + np.log(4.0)), max_nfev=30)
    return float(np.exp(best.x[0])), float(np.exp(best.x[1]))


def _best_of_grid(pieced: list["_Pieced"]) -> Vibration:
    """Natural frequency of the grid with the smallest residual of the equations, relative to the acceleration."""
    vibrations = [(2.0 * np.pi * float(f_n), _ZETA) for f_n in _GRID_HZ]
    return min(vibrations, key=lambda each: sum(float(np.sum(one.solved(each, pieces_as=each)[1] ** 2)) for one in pieced))


def _rough(record: Record, base: np.ndarray, *, mass: float, stop: bool) -> Kinematics:
    """Contact and u'' from the acceleration alone; u and u' are zero."""
    absolute = bridged(record.time, record.channels["hammer_acceleration"])
    inertia, nothing = -mass * absolute, np.zeros_like(absolute)
    touching = np.zeros(len(absolute), bool)
    if stop and record.kind in _STRUCK:
        touching = stands_out(inertia, np.ones(len(absolute), bool))
    force = bridged(record.time, record.channels["impact_force"]) if "impact_force" in record.channels else None
    return Kinematics(u=nothing, v=nothing, a=absolute - base, base_acceleration=base, force=force, inertia=inertia, touching=touching)


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Pieced:
    """One record, integrated in pieces."""

    record: Record
    rough: Kinematics
    mass: float
    load: Load

    @property
    def unseen(self) -> bool:
        """Whether only the hammer's acceleration shows the driven cart."""
        driven = self.record.kind == "cart-excitation" and self.record.base == "sine" and self.record.excitation_frequency is not None
        return driven and not {"cart_displacement", "cart_acceleration"} & set(self.record.channels)

    def solved(self, vibration: Vibration, *, pieces_as: Vibration) -> tuple[np.ndarray, np.ndarray]:
        """Constants of all pieces, and of the cart's sine; and the residual of the equations, relative to the acceleration."""
        factors, integrals, _ = self._terms(pieces_as)
        omega_n, zeta = vibration
        matrix = omega_n**2 * factors[0] + 2.0 * zeta * omega_n * factors[1]
        left = self._pull() - omega_n**2 * integrals[0] - 2.0 * zeta * omega_n * integrals[1]
        free = ~(np.convolve(self.rough.touching, np.ones(_CLEAR), "same") > 0)
        constants, *_ = np.linalg.lstsq(matrix[free], left[free], rcond=None)
        return constants, (matrix[free] @ constants - left[free]) / max(float(np.std(self._pull())), 1e-300)

    def tied_down(self, vibration: Vibration) -> tuple[Kinematics, tuple[float, float] | None]:
        """Integrated motion, and amplitude and phase of a cart without a sensor."""
        constants, _ = self.solved(vibration, pieces_as=vibration)
        factors, integrals, omega = self._terms(vibration)
        u, v = (integral + factor @ constants for integral, factor in zip(integrals, factors, strict=True))
        touching = self.rough.touching & (u > self.record.gap - 0.05 * np.ptp(u))
        if not self.unseen:
            return dataclasses.replace(self.rough, u=u, v=v, touching=touching), None
        sine, cosine = constants[-2:]
        angle = omega * self.record.time
        base = -(omega**2) * (sine * np.sin(angle) + cosine * np.cos(angle))
        motion = dataclasses.replace(
            self.rough, u=u, v=v, a=-self.rough.inertia / self.mass - base, base_acceleration=base, touching=touching
        )
        return motion, (float(np.hypot(sine, cosine)), float(np.arctan2(cosine, sine)))

    def _pull(self) -> np.ndarray:
        """Applied force and load over mass less x'', m/s^2: the acceleration due to the suspension in flight."""
        applied = bridged(self.record.time, self.record.channels["applied_force"]) if self.record.kind == "forced" else 0.0
        downhill = STANDARD_GRAVITY * np.sin(self.load.incline)
        return (applied + self.load.constant_force + self.rough.inertia) / self.mass + downhill

    def _terms(self, vibration: Vibration) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray], float]:
        """Columns of u and u' for every constant, double and single integral of the acceleration, and frequency of the cart, rad/s."""
        time = self.record.time
        known = self.rough.a if not self.unseen else -self.rough.inertia / self.mass
        acceleration = CubicSpline(time, known)
        integrals = acceleration.antiderivative(2)(time), acceleration.antiderivative(1)(time)
        pieces = max(1, int((time[-1] - time[0]) * vibration[0] / (2.0 * np.pi * _PERIODS)))
        borders = np.linspace(0, len(time), pieces + 1).round().astype(int)
        of_u, of_v = np.zeros((len(time), 3 * pieces)), np.zeros((len(time), 3 * pieces))
        for piece, (first, last) in enumerate(zip(borders[:-1], borders[1:], strict=True)):
            t = time[first:last] - time[first]
            of_u[first:last, 3 * piece : 3 * piece + 3] = np.stack([np.ones_like(t), t, 0.5 * t**2], axis=1)
            of_v[first:last, 3 * piece : 3 * piece + 3] = np.stack([np.zeros_like(t), np.ones_like(t), t], axis=1)
        omega = 2.0 * np.pi * (self.record.excitation_frequency or 0.0)
        if self.unseen:
            sine, cosine = np.sin(omega * time), np.cos(omega * time)
            of_u = np.column_stack([of_u, -sine, -cosine])
            of_v = np.column_stack([of_v, -omega * cosine, omega * sine])
        return (of_u, of_v), integrals, omega
