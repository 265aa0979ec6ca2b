"""Relative motion of records in which no displacement, or no sensor of the cart, shows it: from the suspension's equation of motion."""

import dataclasses

import numpy as np
from jaxtyping import Bool
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from identification.experiment import Load, Record
from identification.experiment.channels import STRUCK
from identification.experiment.samples import bridged
from identification.guesses.motion import Kinematics, cart_is_unseen, drive_omega, harmonic_acceleration, kinematics, stands_out
from identification.guesses.suspension import FEWEST, SQUARE, UNLOADED, best_length, regressions, suspension_information, suspension_start
from identification.guesses.weak_form import Regression, near_contact, weak_integrals
from vibrojax.model import STANDARD_GRAVITY

_OWN = 3
"""Unknowns of a record's own: coefficients of sine and cosine, and a constant."""
Sine = tuple[float, float]
"""Amplitude, m, and phase, rad, of a cart's motion."""
Vibration = tuple[float, float]
"""omega_n, rad/s, and zeta."""


def unseen_bases(
    records: list[Record], motions: list[Kinematics | None], *, mass: float, load: Load = UNLOADED
) -> tuple[list[Kinematics | None], dict[int, Sine]]:
    """Motions against carts without a sensor, and these carts' sines, where the hammer's displacement was recorded.

    In flight x'' + 2 zeta omega_n x' + omega_n^2 x = 2 zeta omega_n y' + omega_n^2 y = p sin(Omega t) + q cos(Omega t), plus a constant for
    the sensor's zero and a load. Multiplied by a bump and integrated by parts, this is linear in all its unknowns. omega_n and zeta are
    common to all records, also those with a known cart, each with its own information. `motions` are None where the cart is unknown;
    sines are by index of the record.
    """
    unseen = [
        i for i, record in enumerate(records) if motions[i] is None and cart_is_unseen(record) and "hammer_displacement" in record.channels
    ]
    if not unseen:
        return motions, {}
    seen = suspension_information(records, motions, mass=mass, load=load) or Regression.nothing(2)
    alone = {i: best_length(_regressions(records[i], _struck(records[i], mass))) for i in unseen}
    found, sines = list(motions), {}
    for index in unseen:
        others = sum((one.without(_OWN) for i, one in alone.items() if i != index and one is not None), seen)
        one = _against_cart(records[index], others, mass=mass)
        if one is not None:
            found[index], sines[index] = one
    return found, sines


def _struck(record: Record, mass: float) -> Bool[np.ndarray, " samples"]:
    """Contacts as far as the hammer's absolute motion shows them."""
    absolute = kinematics(dataclasses.replace(record, kind="drop-test"), mass=mass, base_acceleration=np.zeros_like(record.time))
    assert absolute is not None
    return stands_out(absolute.inertia, np.ones(len(record.time), bool))


def _against_cart(record: Record, suspension: Regression, *, mass: float) -> tuple[Kinematics, Sine] | None:
    """Motion against the cart, and its amplitude and phase; None where no equation shows it.

    Contacts are read from that motion, and the cart again from the flights between them.
    """
    touching, found = _struck(record, mass), None
    for _ in range(3):
        sine = _sine(_regressions(record, touching), suspension, drive_omega(record))
        if sine is None:
            return found
        cart = sine[0] * np.sin(drive_omega(record) * record.time + sine[1])
        channels, noise = record.channels | {"cart_displacement": cart}, record.noise | {"cart_displacement": 0.0}
        seen = dataclasses.replace(record, channels=channels, noise=noise)
        motion = kinematics(seen, mass=mass, base_acceleration=harmonic_acceleration(record, *sine))
        assert motion is not None
        found, same = (motion, sine), np.array_equal(motion.touching, touching)
        touching = motion.touching
        if same:
            break
    return found


def _regressions(record: Record, touching: Bool[np.ndarray, " samples"]) -> list[Regression]:
    """Regressions of 2 zeta omega_n, omega_n^2, p, q and the constant, one for each length of the bumps."""
    x, dt = bridged(record.time, record.channels["hammer_displacement"]), float(np.median(np.diff(record.time)))
    angle, equations = drive_omega(record) * record.time, []
    for integrals in weak_integrals(np.stack([x, np.sin(angle), np.cos(angle), np.ones_like(x)]), touching, dt).values():
        second, first, zeroth = integrals[..., 0].T
        equations.append((np.column_stack([-first, zeroth, -integrals[:, 2, 1:]]), -second))
    return regressions(equations, fewest=FEWEST + _OWN)


def _sine(alone: list[Regression], suspension: Regression, omega: float) -> Sine | None:
    """Amplitude and phase of the cart, with what is known of the suspension from elsewhere; None without a vibration."""
    found = [one + suspension.padded(_OWN) for one in alone]
    found = [one for one in found if one.estimate[SQUARE] > 0.0]
    if not found:
        return None
    rate, square, p, q, _ = min(found, key=lambda one: one.stderr(2) + one.stderr(3)).estimate
    turn = complex(p, q) / complex(square, rate * omega)
    return abs(turn), float(np.angle(turn))


def integrated_motions(
    records: list[Record], motions: list[Kinematics | None], base: list[np.ndarray], *, mass: float, stop: bool, load: Load = UNLOADED
) -> tuple[list[Kinematics | None], dict[int, Sine]]:
    """Relative motions, completed by double integration of the hammer's acceleration; and the sines of carts without a sensor.

    In a short piece of a record u = u_0 + v_0 t + b t^2 / 2 + double integral of (x'' - y''), with b the accelerometers' offset. While the
    hammer is clear of the stop, m x'' = f - m (2 zeta omega_n u' + omega_n^2 u). Least squares on this equation gives the three constants,
    and amplitude and phase of a sine y without a sensor, one for the whole record. zeta and omega_n come from the weak form of the same
    equation in all records with a known cart; where the cart is unknown in some, they then minimise the residual of the equations.

    `motions` are None where no displacement was recorded, and still None afterwards where no acceleration was recorded or where it shows no
    vibration on a spring; `base` is y'' of each record as far as known, m/s^2, shape (samples,); `stop` says whether the model has one.
    Sines are by index of the record.
    """
    wanted = [i for i, r in enumerate(records) if motions[i] is None and "hammer_acceleration" in r.channels and r.kind != "prescribed"]
    pieced = [_Pieced(record=records[i], rough=_rough(records[i], base[i], mass=mass, stop=stop), mass=mass, load=load) for i in wanted]
    vibration = _vibration(pieced, mass)
    if vibration is None:
        return motions, {}
    found, sines = list(motions), {}
    for index, each in zip(wanted, pieced, strict=True):
        found[index], sine = each.integrated(vibration)
        if sine is not None:
            sines[index] = sine
    return found, sines


def _vibration(pieced: list["_Pieced"], mass: float) -> Vibration | None:
    """omega_n and zeta of the suspension; None where there is no vibration."""
    known, unseen = ([each for each in pieced if cart_is_unseen(each.record) is wanted] for wanted in (False, True))
    load = pieced[0].load if pieced else UNLOADED
    start, _ = suspension_start([each.record for each in known], [each.rough for each in known], mass=mass, load=load)
    if start and not unseen:
        return 2.0 * np.pi * start["f_n"], start["zeta"]
    if not unseen:
        return None
    if start:
        begin = 2.0 * np.pi * start["f_n"], start["zeta"]
    else:
        # No known cart shows the suspension: zeta = 0.02, and f_n from 0.3 to 300 Hz.
        grid = [(2.0 * np.pi * float(f_n), 0.02) for f_n in np.geomspace(0.3, 300.0, 61)]
        begin = min(grid, key=lambda each: sum(float(np.sum(one.solved(each, pieces_as=each)[1] ** 2)) for one in unseen))

    def misfit(logarithms: np.ndarray) -> np.ndarray:
        omega_n, zeta = np.exp(logarithms)
        return np.concatenate([each.solved((omega_n, zeta), pieces_as=begin)[1] for each in pieced])

    best = least_squares(misfit, np.log(begin), bounds=(np.log(begin) - np.log(4.0), np.log(begin) + np.log(4.0)), max_nfev=30)
    return float(np.exp(best.x[0])), float(np.exp(best.x[1]))


def _rough(record: Record, base: np.ndarray, *, mass: float, stop: bool) -> Kinematics:
    """Contact and u'' from the acceleration alone; u and u' are zero."""
    absolute = bridged(record.time, record.channels["hammer_acceleration"])
    inertia, nothing = -mass * absolute, np.zeros_like(absolute)
    touching = np.zeros(len(absolute), bool)
    if stop and record.kind in (*STRUCK, "forced"):
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

    def solved(self, vibration: Vibration, *, pieces_as: Vibration) -> tuple[np.ndarray, np.ndarray]:
        """Constants of all pieces, and of the cart's sine; and the residual of the equations, relative to the acceleration."""
        factors, integrals, _ = self._terms(pieces_as)
        omega_n, zeta = vibration
        matrix = omega_n**2 * factors[0] + 2.0 * zeta * omega_n * factors[1]
        left = self._pull() - omega_n**2 * integrals[0] - 2.0 * zeta * omega_n * integrals[1]
        free = ~near_contact(self.rough.touching)
        constants, *_ = np.linalg.lstsq(matrix[free], left[free], rcond=None)
        return constants, (matrix[free] @ constants - left[free]) / max(float(np.std(self._pull())), 1e-300)

    def integrated(self, vibration: Vibration) -> tuple[Kinematics, Sine | None]:
        """Integrated motion, and amplitude and phase of a cart without a sensor."""
        constants, _ = self.solved(vibration, pieces_as=vibration)
        factors, integrals, omega = self._terms(vibration)
        u, v = (integral + factor @ constants for integral, factor in zip(integrals, factors, strict=True))
        touching = self.rough.touching & (u > self.record.gap - 0.05 * np.ptp(u))
        if not cart_is_unseen(self.record):
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
        known = self.rough.a if not cart_is_unseen(self.record) else -self.rough.inertia / self.mass
        acceleration = CubicSpline(time, known)
        integrals = acceleration.antiderivative(2)(time), acceleration.antiderivative(1)(time)
        pieces = max(1, int((time[-1] - time[0]) * vibration[0] / (8.0 * np.pi)))  # four periods: they show the phase, and do not drift
        borders = np.linspace(0, len(time), pieces + 1).round().astype(int)
        of_u, of_v = np.zeros((len(time), 3 * pieces)), np.zeros((len(time), 3 * pieces))
        for piece, (first, last) in enumerate(zip(borders[:-1], borders[1:], strict=True)):
            t = time[first:last] - time[first]
            of_u[first:last, 3 * piece : 3 * piece + 3] = np.stack([np.ones_like(t), t, 0.5 * t**2], axis=1)
            of_v[first:last, 3 * piece : 3 * piece + 3] = np.stack([np.zeros_like(t), np.ones_like(t), t], axis=1)
        omega = drive_omega(self.record)
        if cart_is_unseen(self.record):
            sine, cosine = np.sin(omega * time), np.cos(omega * time)
            of_u = np.column_stack([of_u, -sine, -cosine])
            of_v = np.column_stack([of_v, -omega * cosine, omega * sine])
        return (of_u, of_v), integrals, omega
