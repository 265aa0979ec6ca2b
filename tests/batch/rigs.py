"""Rigs of the batch tests, for the package and for the oracle that shares no code with it."""

import numpy as np

from benchmarks import oracle
from vibrojax.batch import Points, grid
from vibrojax.contact import AbstractContactLaw, HuntCrossley
from vibrojax.model import Model
from vibrojax.suspension import Linear

AMPLITUDE, GAP = 2e-3, 1e-3
FREQUENCIES = np.array([3.1, 4.4, 5.2, 6.25, 7.7, 8.6])
SOFT = HuntCrossley(1e6, 1.5, 0.3)


def model(law: AbstractContactLaw = SOFT, **parts) -> Model:
    return Model(**(dict(mass=0.5, suspension=Linear(0.02, 4.0), law=law) | parts))


def points(frequencies=FREQUENCIES, **fixed) -> Points:
    return grid({"frequency_hz": frequencies}, **(dict(base_amplitude=AMPLITUDE, gap=GAP) | fixed))


def oracle_motion(frequency_hz: float, cycles: int, *, force=None, state=(0.0, 0.0), **rig) -> oracle.Motion:
    """By SciPy's DOP853 at 1e-11, at each strobe."""
    numbers = dict(mass=0.5, zeta=0.02, f_n=4.0, gap=GAP, base_amplitude=AMPLITUDE, frequency_hz=frequency_hz) | rig
    force = oracle.hunt_crossley(1e6, 1.5, 0.3) if force is None else force
    return oracle.motion(oracle.Rig(**numbers, force=force or None), np.arange(cycles + 1) / frequency_hz, state)
