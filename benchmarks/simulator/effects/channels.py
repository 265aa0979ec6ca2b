"""Faults of the channels."""

import numpy as np

from benchmarks.simulator.effects.base import either_sign
from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.faults import Clip, ClockRate, Curve, Delay, Gain, HighPass, Hum, LowPass, Tone, ZeroDrift
from benchmarks.simulator.hidden import Hidden

_DISPLACEMENTS = ("hammer_displacement", "cart_displacement")
_PIEZOELECTRIC = ("impact_force", "hammer_acceleration")
_LOUD = {"hammer_displacement": 1.2e-4, "cart_displacement": 1.2e-4, "impact_force": 1.8, "hammer_acceleration": 0.6}
"""Amplitude of a tone that is clearly heard, SI."""
_TONES = (8.0, 45.0)
"""Range of a tone, Hz."""
_APART = 0.1
"""Least distance of a tone from the multiples of every drive, over the drive's frequency."""


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


def sensor_high_pass(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The force cell or the accelerometer discharges, 0.1 to 0.4 s."""
    channel = str(rng.choice([name for name in _PIEZOELECTRIC if name in setting.channels]))
    return Hidden(faults=(HighPass(channel=channel, time_constant=float(rng.uniform(0.1, 0.4)) / strength),))


def recorder_low_pass(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """All channels are low-passed alike, 0.6 to 1.2 ms: cut off at 130 to 270 Hz."""
    time_constant = 1e-3 * strength * float(rng.uniform(0.6, 1.2))
    return Hidden(faults=tuple(LowPass(channel=channel, time_constant=time_constant) for channel in setting.channels))


def nonlinear_reading(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """One channel's characteristic is curved: 4 % of the largest reading by its square and 2 % by its cube, up or down."""
    channel = str(rng.choice(setting.channels))
    largest = max(float(np.abs(signals[channel]).max()) for signals in setting.nominal)
    quadratic, cubic = either_sign(rng) * 0.04 * strength / largest, either_sign(rng) * 0.02 * strength / largest**2
    return Hidden(faults=(Curve(channel=channel, quadratic=quadratic, cubic=cubic),))


def reading_tone(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """A tone of 8 to 45 Hz and 12 standard deviations of the noise in one channel, steady or decaying by 0.5 to 1.5 1/s."""
    channel, frequency = str(rng.choice(setting.channels)), float(rng.uniform(*_TONES))
    while any(abs((frequency / plan.excitation_frequency + 0.5) % 1.0 - 0.5) < _APART for plan in setting.driven):
        frequency = float(rng.uniform(*_TONES))
    decay = float(rng.choice((0.0, rng.uniform(0.5, 1.5))))
    phases = {plan.file: float(rng.uniform(-np.pi, np.pi)) for plan in setting.plans}
    return Hidden(faults=(Tone(channel=channel, amplitude=_LOUD[channel] * strength, frequency=frequency, decay=decay, phases=phases),))


def clock_drift(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """One channel's clock runs slow or fast by 800 ppm: 2.4 ms in 3 s."""
    return Hidden(faults=(ClockRate(channel=str(rng.choice(setting.channels)), ppm=either_sign(rng) * 800.0 * strength),))


def zero_drift(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The zero of one displacement channel creeps by 0.15 mm, with a time constant of 0.4 to 1.2 s."""
    size, time_constant = either_sign(rng) * 1.5e-4 * strength, float(rng.uniform(0.4, 1.2))
    channel = str(rng.choice([name for name in _DISPLACEMENTS if name in setting.channels]))
    return Hidden(faults=(ZeroDrift(channel=channel, size=size, time_constant=time_constant),))
