"""A simulated experiment whose likelihood is curved: few weak impacts, seen by the displacement alone."""

import dataclasses
from pathlib import Path

import numpy as np

from benchmarks.simulator import draw_plan, draw_rig, standard_sensors, write_experiment

NAME = "few weak impacts"
_SEED = 2
_KIND = "stiff"
_NOISE = 0.65
"""Factor on the usual noise of the displacements."""
_RELEASE = -1e-3
"""Where the hammer is let go, m: a third of the usual height."""
_SAMPLES = (3001, 3001)


def write_curved(folder: Path) -> None:
    """Simulate one drop test into `folder`.

    A contact of a few samples shows k_i and n by the time it lasts and how that depends on the impact speed, so that both are known
    poorly, to 0.8 in ln k_i, and their posterior is skewed.
    """
    rng = np.random.default_rng(_SEED)
    rig = draw_rig(rng, _KIND)
    drop = dataclasses.replace(draw_plan(rng, _KIND, rig.f_n, samples=_SAMPLES)[0], release=_RELEASE)
    sensors = tuple(dataclasses.replace(one, noise=_NOISE * one.noise) for one in standard_sensors(force=False, acceleration=False))
    write_experiment(folder, rig, (drop,), sensors, rng, truth=None)
