"""What a cart that follows a pure sine leaves out."""

import numpy as np

from benchmarks.simulator.effects.base import either_sign
from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.hidden import Hidden


def base_harmonics(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """Y = A0 [sin a + h_2 sin(2 a + p_2) + h_3 sin(3 a + p_3)]; h_2 = 0.05, h_3 a fifth to three fifths of it."""
    second = 0.05 * strength
    return Hidden(
        motion={
            "second_harmonic": second,
            "second_phase": float(rng.uniform(-np.pi, np.pi)),
            "third_harmonic": float(second * rng.uniform(0.2, 0.6)),
            "third_phase": float(rng.uniform(-np.pi, np.pi)),
        }
    )


def cart_recoil(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The cart recoils from the stop's force: M_c r'' + c_c r' + k_c r = F, y + r; M_c = 6 m, 15 to 28 Hz, 5 to 12 %."""
    mass = 6.0 * setting.rig.m / strength
    omega = 2.0 * np.pi * rng.uniform(15.0, 28.0)
    damping = 2.0 * rng.uniform(0.05, 0.12) * mass * omega
    return Hidden(motion={"cart_mass": mass, "cart_stiffness": float(mass * omega**2), "cart_damping": float(damping)})


def frequency_drift(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The frequency is f (1 + r t) from each record's first sample on; r = 0.004 1/s up or down."""
    return Hidden(motion={"frequency_rate": either_sign(rng) * 0.004 * strength})
