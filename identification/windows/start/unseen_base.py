"""Sine of a cart without a sensor, from the hammer's displacement in flight: linear in amplitude and phase, by the weak form."""

import dataclasses

import numpy as np
from jaxtyping import Bool

from identification.experiment import Load, Record
from identification.experiment.samples import bridged
from identification.windows.kinematics import Kinematics, kinematics, stands_out
from identification.windows.start.base_motion import harmonic_acceleration
from identification.windows.start.bumps import weak_integrals
from identification.windows.start.robust_regression import Regression, robust_regression
from identification.windows.start.suspension import FEWEST, SQUARE, UNLOADED, best_length, suspension_information

_OWN = 3
"""Unknowns of a record's own: coefficients of sine and cosine, and a constant."""
_TURNS = 3
"""How often contacts are read from the motion against the cart as found, and the cart again from the flights between them."""


def unseen_bases(
    records: list[Record], motions: list[Kinematics | None], *, mass: float, load: Load = UNLOADED
) -> tuple[list[Kinematics | None], dict[int, tuple[float, float]]]:
    """Motions against carts without a sensor, and these carts' sines, where the hammer's displacement was recorded.

    In flight x'' + 2 zeta omega_n x' + omega_n^2 x = 2 zeta omega_n y' + omega_n^2 y = p sin(Omega t) + q cos(Omega t), plus a constant for
    the sensor's zero and a load. Multiplied by a bump and integrated by parts, this is linear in all its unknowns. omega_n and zeta are
    common to all records, also those with a known cart, each with its own information.

    Args:
        records: of the experiment.
        motions: as read from displacements; None where the cart is unknown.
        mass: of the hammer, kg.
        load: constant forces that are known.

    Returns:
        The motions with those that were found, and by index of the record amplitude, m, and phase, rad.
    """
    unseen = [i for i, record in enumerate(records) if motions[i] is None and _unseen(record)]
    if not unseen:
        return motions, {}
    seen = suspension_information(records, motions, mass=mass, load=load) or Regression.nothing(2)
    alone = {i: _alone(_regressions(records[i], _struck(records[i], mass))) for i in unseen}
    found, sines = list(motions), {}
    for index in unseen:
        others = sum((one for i, one in alone.items() if i != index), seen)
        one = _against_cart(records[index], others, mass=mass)
        if one is not None:
            found[index], sines[index] = one
    return found, sines


def _unseen(record: Record) -> bool:
    """Whether a harmonic cart has no sensor and the hammer's displacement was recorded."""
    driven = record.kind == "cart-excitation" and record.base == "sine" and record.excitation_frequency is not None
    return driven and "hammer_displacement" in record.channels and not {"cart_displacement", "cart_acceleration"} & set(record.channels)


def _alone(regressions: list[Regression]) -> Regression:
    """What one record with an unseen cart says of the suspension."""
    found = best_length(regressions)
    return Regression.nothing(2) if found is None else found.without(_OWN)


def _struck(record: Record, mass: float) -> Bool[np.ndarray, " samples"]:
    """Contacts as far as the hammer's absolute motion shows them."""
    absolute = kinematics(dataclasses.replace(record, kind="drop-test"), mass=mass, base_acceleration=np.zeros_like(record.time))
    assert absolute is not None
    return stands_out(absolute.inertia, np.ones(len(record.time), bool))


def _against_cart(record: Record, suspension: Regression, *, mass: float) -> tuple[Kinematics, tuple[float, float]] | None:
    """Motion against the cart, and its amplitude and phase; None where no equation shows it."""
    touching, found = _struck(record, mass), None
    for _ in range(_TURNS):
        sine = _sine(_regressions(record, touching), suspension, _omega(record))
        if sine is None:
            return found
        motion = _relative(record, *sine, mass=mass)
        assert motion is not None
        found, same = (motion, sine), np.array_equal(motion.touching, touching)
        touching = motion.touching
        if same:
            break
    return found


def _relative(record: Record, amplitude: float, phase: float, *, mass: float) -> Kinematics | None:
    """Smoothed motion against a harmonic cart."""
    cart = amplitude * np.sin(_omega(record) * record.time + phase)
    seen = dataclasses.replace(
        record, channels=record.channels | {"cart_displacement": cart}, noise=record.noise | {"cart_displacement": 0.0}
    )
    return kinematics(seen, mass=mass, base_acceleration=harmonic_acceleration(record, amplitude, phase))


def _regressions(record: Record, touching: Bool[np.ndarray, " samples"]) -> list[Regression]:
    """Regressions of 2 zeta omega_n, omega_n^2, p, q and the constant, one for each length of the bumps."""
    x, dt = bridged(record.time, record.channels["hammer_displacement"]), float(np.median(np.diff(record.time)))
    angle = _omega(record) * record.time
    found = []
    for integrals in weak_integrals(np.stack([x, np.sin(angle), np.cos(angle), np.ones_like(x)]), touching, dt).values():
        second, first, zeroth = integrals[..., 0].T
        if len(second) >= FEWEST + _OWN:
            found.append(robust_regression(np.column_stack([-first, zeroth, -integrals[:, 2, 1:]]), -second))
    return found


def _sine(regressions: list[Regression], suspension: Regression, omega: float) -> tuple[float, float] | None:
    """Amplitude and phase of the cart, with what is known of the suspension from elsewhere; None without a vibration."""
    found = [one + suspension.padded(_OWN) for one in regressions]
    found = [one for one in found if one.estimate[SQUARE] > 0.0]
    if not found:
        return None
    rate, square, p, q, _ = min(found, key=lambda one: one.stderr(2) + one.stderr(3)).estimate
    turn = complex(p, q) / complex(square, rate * omega)
    return abs(turn), float(np.angle(turn))


def _omega(record: Record) -> float:
    """Frequency of the cart as set, rad/s."""
    return 2.0 * np.pi * (record.excitation_frequency or 0.0)
