"""Effects that are on no list that the program may know: the right verdict on them is "unlisted"."""

import numpy as np

from benchmarks.simulator.effects.base import either_sign
from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.faults import GainDrift
from benchmarks.simulator.hidden import Hidden


def x_foreign_force(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """A machine next door: F = 0.16 k A0 sin(w_f t + p_f), w_f 1.3 to 2.7 omega_n, its phase another in each record."""
    omega = float(2.0 * np.pi * setting.rig.f_n * rng.uniform(1.3, 2.7))
    phases = {plan.file: {"foreign_phase": float(rng.uniform(-np.pi, np.pi))} for plan in setting.plans}
    return Hidden(motion={"foreign_force": 0.16 * strength * setting.spring_force, "foreign_omega": omega}, records=phases)


def x_warming_spring(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The suspension stiffens or softens while a record lasts: k (1 + a t), a = 0.015 1/s."""
    return Hidden(motion={"warming_rate": either_sign(rng) * 0.015 * strength})


def x_position_damping(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """Damping that grows away from the middle: F = c_1 |u| v, c_1 A0 = c."""
    return Hidden(motion={"position_damping": strength * setting.rig.c / setting.rig.base_amplitude})


def x_gain_drift(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The factor of the hammer's displacement rises or falls while a record lasts: by 3 % a second."""
    return Hidden(faults=(GainDrift(channel="hammer_displacement", rate=either_sign(rng) * 0.03 * strength),))


def x_knocks(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """Somebody knocks: half sines of 3.5 k A0 and 4 to 8 ms on the hammer, every 0.7 to 1.1 s of each driven record."""
    knock = {"knock_force": either_sign(rng) * 3.5 * strength * setting.spring_force, "knock_width": float(rng.uniform(4e-3, 8e-3))}
    knock |= {"knock_period": float(rng.uniform(0.7, 1.1))}
    return Hidden(records={plan.file: knock | {"knock_start": float(rng.uniform(0.1, 0.7))} for plan in setting.driven})


def x_parametric_stiffness(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The suspension's stiffness swings with the drive: k (1 + 0.05 cos(Omega t + p)), as of a pendulum whose hanger moves up and down."""
    return Hidden(motion={"parametric_share": 0.05 * strength, "parametric_phase": float(rng.uniform(-np.pi, np.pi))})


def x_stop_wear(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """Each impact makes the stop softer: k_i exp(-J / J_0), J the impulse since the record's first sample; 40 % in the busiest record."""
    return Hidden(motion={"wear_impulse": 2.0 * setting.impulse / strength})


def x_magnet(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The stop attracts the hammer: F = F_m / (1 + (gap - u) / d)^2, F_m = 0.8 k A0, d 0.8 to 1.5 mm."""
    return Hidden(motion={"magnet_force": 0.8 * strength * setting.spring_force, "magnet_reach": float(rng.uniform(8e-4, 1.5e-3))})
