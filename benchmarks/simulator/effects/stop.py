"""What a rigid stop at a fixed gap leaves out."""

import numpy as np

from benchmarks.simulator.effects.base import either_sign
from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.hidden import Hidden


def stop_compliance(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The stop is a mass of 0.1 m on a spring (300 to 800 Hz) and a damper (2 to 6 %); the load cell carries spring and damper."""
    mass = 0.1 * strength * setting.rig.m
    omega = 2.0 * np.pi * rng.uniform(300.0, 800.0)
    damping = 2.0 * rng.uniform(0.02, 0.06) * mass * omega
    return Hidden(motion={"stop_mass": mass, "stop_stiffness": float(mass * omega**2), "stop_damping": float(damping)})


def contact_adhesion(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """While leaving, a pull of F_ad = 1.2 k A0 that ends linearly 0.25 to 0.6 mm outside the stop; the load cell feels it."""
    return Hidden(motion={"adhesion_force": 1.2 * strength * setting.spring_force, "adhesion_reach": float(rng.uniform(2.5e-4, 6e-4))})


def back_stop(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """A second stop of the same law at u = -gap_b, 30 % nearer than the hammer would go (median of the records)."""
    farthest = float(np.median([-u.min() for u in setting.displacements]))
    return Hidden(motion={"back_gap": (1.0 - 0.3 * strength) * farthest})


def deep_stop(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """A harder stop behind the first, at 50 to 75 % of how deep the hammer would go (median of the records).

    There it would push with thrice the highest force of the first one.
    """
    deepest = float(np.median([(u - plan.true_gap).max() for u, plan in zip(setting.displacements, setting.driven, strict=True)]))
    if deepest <= 0:
        raise ValueError("a deep stop needs records that reach the first one: take another seed")
    depth = float(rng.uniform(0.5, 0.75)) * deepest
    stiffness = 3.0 * strength * setting.highest_force / (deepest - depth) ** 1.5
    damping = rng.uniform(1.0, 3.0) * setting.rig.lambda_i
    return Hidden(motion={"deep_stiffness": float(stiffness), "deep_depth": depth, "deep_damping": float(damping)})


def gap_drift(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The gap grows or shrinks by 0.12 mm/s from each record's first sample on."""
    return Hidden(motion={"gap_rate": either_sign(rng) * 1.2e-4 * strength})


def gap_step(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The gap jumps by 0.25 mm at one instant, between 30 and 70 %, of one driven record."""
    plan = setting.driven[rng.integers(len(setting.driven))]
    end = float(setting.nominal[0]["time"][-1])
    jump = {"gap_jump": either_sign(rng) * 2.5e-4 * strength, "jump_time": float(rng.uniform(0.3, 0.7) * end)}
    return Hidden(records={plan.file: jump})


def missing_stop(rng: np.random.Generator, setting: Setting, strength: float) -> Hidden:
    """The experiment declares a model without contact; the stop is there all the same, whatever the strength."""
    return Hidden(law="none")
