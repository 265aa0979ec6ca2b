"""Effects of the suspension: friction, losses by a power of the speed, a curved or saturating force, preload, hysteresis, a second mode."""

import numpy as np

from benchmarks.simulator.effects.base import either_sign
from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.hidden import NOTHING, Hidden

_SOFTEST = 0.3
"""The force of a softening suspension is at most this much less than that of a linear one."""


def coulomb_friction(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = F_c tanh(v / v_s) against the motion; F_c = 0.08 k A0, v_s 0.1 to 0.5 mm/s."""
    return Hidden(motion={"friction_force": 0.08 * strength * setting.spring_force, "friction_speed": float(rng.uniform(1e-4, 5e-4))})


def quadratic_drag(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = c_d v |v|; at the speed A0 omega_n 0.025 k A0."""
    return Hidden(motion={"drag": 0.025 * strength * setting.spring_force / setting.speed**2})


def cubic_stiffness(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = k_3 u^3; k_3 A0^2 = 0.0075 k hardening or -0.0012 k softening, less where the hammer would run away or nearly so."""
    share = 0.0075 if either_sign(rng) > 0.0 else -0.0012
    hidden = Hidden(motion={"cubic": share * strength * setting.rig.k / setting.rig.base_amplitude**2})
    while hidden.motion["cubic"] < 0.0 and -hidden.motion["cubic"] * setting.farthest(hidden) ** 2 > _SOFTEST * setting.rig.k:
        hidden = Hidden(motion={"cubic": 0.7 * hidden.motion["cubic"]})
    return hidden


def constant_force(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = F_0 towards the stop or away from it; 0.32 k A0."""
    return Hidden(motion={"constant_force": either_sign(rng) * 0.32 * strength * setting.spring_force})


def hysteresis(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """Bouc and Wen: F = K z, z' = A v - B |v| z - G v |z|, B = G = A/2; K = 0.2 k A0, 1/A = 0.8 to 1.2 A0."""
    slope = 1.0 / (rng.uniform(0.8, 1.2) * setting.rig.base_amplitude)
    return Hidden(
        motion={
            "hysteresis_force": 0.2 * strength * setting.spring_force,
            "hysteresis_a": slope,
            "hysteresis_b": 0.5 * slope,
            "hysteresis_g": 0.5 * slope,
        }
    )


def second_mode(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """A mass of 0.06 m hangs on the hammer by a spring (20 to 60 Hz) and a damper (2 to 4 %)."""
    mass = 0.06 * strength * setting.rig.m
    omega = 2.0 * np.pi * np.exp(rng.uniform(np.log(20.0), np.log(60.0)))
    damping = 2.0 * rng.uniform(0.02, 0.04) * mass * omega
    return Hidden(motion={"mode_mass": mass, "mode_stiffness": float(mass * omega**2), "mode_damping": float(damping)})


def asymmetric_damping(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = D_c |v| / 2 to either side; at the speed A0 omega_n 0.03 k A0, or such that no direction is damped by less than 0.2 c."""
    difference = min(0.06 * strength * setting.spring_force / setting.speed, 1.6 * setting.rig.c)
    return Hidden(motion={"damping_difference": either_sign(rng) * difference})


def force_saturation(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = -F_s u / u_s up to |u| = u_s, and constant beyond; F_s = 0.08 k A0, u_s = 0.3 to 0.6 A0."""
    threshold = rng.uniform(0.3, 0.6) * setting.rig.base_amplitude
    return Hidden(motion={"saturation_force": 0.08 * strength * setting.spring_force, "saturation_threshold": float(threshold)})


def quintic_stiffness(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = k_5 u^5; as far as the linear suspension goes, 12 % of its force hardening or 6 % softening, less where the hammer runs away."""
    share = 0.12 if either_sign(rng) > 0.0 else -0.06
    hidden = Hidden(motion={"quintic": share * strength * setting.rig.k / setting.farthest(NOTHING) ** 4})
    while hidden.motion["quintic"] < 0.0 and -hidden.motion["quintic"] * setting.farthest(hidden) ** 4 > _SOFTEST * setting.rig.k:
        hidden = Hidden(motion={"quintic": 0.7 * hidden.motion["quintic"]})
    return hidden


def power_law_damping(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """F = d v |v|^(p - 1), p near 0.5, 1.5, 2.5 or 3, smoothed below 0.1 to 0.5 mm/s; at the speed A0 omega_n 0.04 k A0."""
    exponent = float(rng.choice((0.5, 1.5, 2.5, 3.0)) + rng.uniform(-0.1, 0.1))
    loss = 0.04 * strength * setting.spring_force / setting.speed**exponent
    return Hidden(motion={"power_loss": loss, "power_exponent": exponent, "power_speed": float(rng.uniform(1e-4, 5e-4))})
