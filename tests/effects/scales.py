"""Scales of plausible records, and of records that show nothing."""

import dataclasses

from tests.effects.rig import LAW
from vibrojax.effects import ProbeScales

SCALES = ProbeScales(
    mass=0.5,
    f_n=5.0,
    omega_exc=50.0,
    drives=(50.0,),
    gaps={"drop.csv": 0.0, "cart1.csv": 1e-3},
    clock={"drop.csv": (0.0, 1.0), "cart1.csv": (0.0, 3.0)},
    contacts={"drop.csv": (), "cart1.csv": ((0.02, 0.03), (0.07, 0.08), (0.12, 0.13))},
    channels=("hammer_displacement", "impact_force"),
    noise={"hammer_displacement": 1e-5, "impact_force": 0.15},
    amplitude=6e-3,
    lowest=-6e-3,
    speed=0.2,
    force=40.0,
    deepest=2e-4,
    contact_time=6e-3,
    ceilings={},
    lines={"hammer_displacement": (50.0, 23.0)},
    frequencies_searched=24000,
    lags={},
    sampling=5e-4,
    law=LAW,
    tied=True,
)
NOTHING = dataclasses.replace(
    SCALES,
    f_n=0.0,
    omega_exc=0.0,
    drives=(),
    contacts={},
    channels=(),
    noise={},
    amplitude=0.0,
    lowest=0.0,
    speed=0.0,
    force=0.0,
    deepest=0.0,
    contact_time=float("nan"),
    lines={},
    frequencies_searched=0,
    clock={"drop.csv": (0.0, 1.0)},
)
