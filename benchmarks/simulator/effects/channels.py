"""Faults of the channels."""

import numpy as np

from benchmarks.simulator.effects.base import either_sign
from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.faults import Clip, Delay, Gain, Hum, LowPass
from benchmarks.simulator.hidden import Hidden

_DISPLACEMENTS = ("hammer_displacement", "cart_displacement")


def force_lag(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The load cell is low-passed, 2.2 ms."""
    return Hidden(faults=(LowPass(channel="impact_force", time_constant=2.2e-3 * strength),))


def force_clipping(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The load cell saturates at 55 % of the highest force."""
    return Hidden(faults=(Clip(channel="impact_force", level=(1.0 - 0.45 * strength) * setting.highest_force),))


def mains_hum(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """A line of 50 or 60 Hz and 0.12 mm in one displacement channel, its phase another in each record."""
    channel, frequency = str(rng.choice(_DISPLACEMENTS)), float(rng.choice((50.0, 60.0)))
    phases = {plan.file: float(rng.uniform(-np.pi, np.pi)) for plan in setting.plans}
    return Hidden(faults=(Hum(channel=channel, amplitude=1.2e-4 * strength, frequency=frequency, phases=phases),))


def gain_error(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """One channel's factor is 12 % too large or too small."""
    return Hidden(faults=(Gain(channel=str(rng.choice(setting.channels)), factor=1.0 + either_sign(rng) * 0.12 * strength),))


def time_offset(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """One channel is 1.5 ms late or early."""
    return Hidden(faults=(Delay(channel=str(rng.choice(setting.channels)), delay=either_sign(rng) * 1.5e-3 * strength),))
