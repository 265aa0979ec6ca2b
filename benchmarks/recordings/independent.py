"""`python -m benchmarks.recordings.independent --data DIR NAME`: which terms does a plain least-squares fit of a swinging arm prefer?

Nothing of the program takes part but the reading of the recordings. Each record is one simulation from its first sample to its last
(single shooting), all samples count alike, and each record in turn is left out of the fit and then predicted; there, only its initial state
is fitted.
"""

import argparse
import dataclasses
import itertools
from pathlib import Path

import numpy as np
from numba import njit
from rich.console import Console
from rich.table import Table
from scipy.optimize import least_squares

from identification.recipes.load import load_recipe
from identification.recipes.prepare import recipe_experiment

TERMS = ("dry friction", "quadratic drag", "cubic spring")
RECIPES = {
    "free_swing": ("angle", "deg", None),
    "multiarm_pendulum": ("angle", "rad", None),
    "torque_pendulum": ("position", "rad", "torque"),
}
"""By recipe: column of the angle, its unit, column of the moment."""
_SLOW = 0.02
"""Angular velocity below which dry friction is smoothed, rad/s."""
_SUBSTEP = 2e-3
"""Longest step of the integration, s."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Swing:
    """One record.

    Attributes:
        time: s.
        angle: rad.
        moment: of the motor, N m; zeros where there is none.
    """

    file: str
    time: np.ndarray
    angle: np.ndarray
    moment: np.ndarray


@njit(cache=True)
def simulated(time, moment, shared, state, substep):
    """Angle at the samples, rad, by the classical Runge-Kutta method.

    phi'' = moment / J - 2 zeta omega phi' - omega^2 sin(phi - phi_0) - (F_c tanh(phi' / v) + c phi' |phi'| + k_3 (phi - phi_0)^3)

    Args:
        time, moment: of the record; the moment is linear between samples.
        shared: omega, zeta, phi_0, 1 / J, F_c, c, k_3; the last three per moment of inertia.
        state: initial angle and angular velocity.
        substep: longest step, s.
    """
    found = np.empty(len(time))
    angle, rate = state
    omega, zeta, zero, admittance, friction, drag, cubic = shared
    for sample in range(len(time)):
        found[sample] = angle
        if sample == len(time) - 1:
            break
        whole = time[sample + 1] - time[sample]
        steps = int(np.ceil(whole / substep))
        step = whole / steps
        for part in range(steps):
            first = (moment[sample] * (steps - part) + moment[sample + 1] * part) / steps
            last = (moment[sample] * (steps - part - 1) + moment[sample + 1] * (part + 1)) / steps
            a, v = np.empty(4), np.empty(4)
            at, speed = angle, rate
            for stage in range(4):
                push = first if stage == 0 else last if stage == 3 else 0.5 * (first + last)
                v[stage] = speed
                a[stage] = push * admittance - 2.0 * zeta * omega * speed - omega**2 * np.sin(at - zero)
                a[stage] -= friction * np.tanh(speed / 0.02) + drag * speed * abs(speed) + cubic * (at - zero) ** 3
                ahead = step if stage == 2 else 0.5 * step
                at, speed = angle + ahead * v[stage], rate + ahead * a[stage]
            angle += step / 6.0 * (v[0] + 2.0 * v[1] + 2.0 * v[2] + v[3])
            rate += step / 6.0 * (a[0] + 2.0 * a[1] + 2.0 * a[2] + a[3])
    return found
