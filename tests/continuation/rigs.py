"""Rigs that the tests of this folder share."""

import numpy as np

from tests.continuation.single_impact_orbit import Oscillator
from vibrojax.contact import AbstractContactLaw, HuntCrossley
from vibrojax.continuation import ForcedRig, Orbit, find_orbit, settle
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.suspension import Linear

STEPS = Landing(contact_steps=40.0, flight_step=1e-3)
FINE = Landing(flight_step=2.5e-4)
SOFT = HuntCrossley(1e6, 1.5, 0.3)
RIGID = Oscillator(zeta=0.05, f_n=5.0, e=0.8, gap=3e-3, amplitude=1e-3)


def rig(law: AbstractContactLaw = SOFT, *, frequency: float, gap: float = 3e-3, zeta: float = 0.05) -> ForcedRig:
    return ForcedRig(Model(1.0, Linear(zeta, 5.0), law), gap=gap, base_amplitude=1e-3, frequency_hz=frequency)


def settled(forced: ForcedRig, start: tuple[float, float] = (0.0, 0.0), landing: Landing = STEPS) -> Orbit:
    state, cycles = settle(forced, np.array(start), landing=landing)
    return find_orbit(forced, state, cycles=cycles, landing=landing)


def without_impact(forced: ForcedRig, landing: Landing = STEPS) -> Orbit:
    """The orbit that does not reach the stop, found with the stop out of the way."""
    state = find_orbit(forced.replace("gap", 1.0), np.zeros(2), landing=landing).state
    return find_orbit(forced, state, landing=landing)
