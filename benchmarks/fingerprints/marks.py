"""The picture of each listed effect: its strength, its coordinate, and what to look for."""

import dataclasses
from collections.abc import Callable
from typing import Any

from benchmarks.fingerprints.coordinates import (
    Points,
    after_impacts,
    beyond_gap,
    cart_over_phase,
    cart_over_time,
    force_over_force,
    misfit_over_time,
    missing_force_after_impacts,
    over_displacement,
    over_indentation,
    over_rate,
    over_reading,
    over_time,
    over_velocity,
    spectrum,
    touch_over_time,
    until,
    while_leaving,
)
from benchmarks.fingerprints.run import LAW, Run
from vibrojax.contact import AbstractContactLaw, NoContact
from vibrojax.effects import EFFECTS, AbstractEffect


@dataclasses.dataclass(frozen=True, kw_only=True)
class Fingerprint:
    """One picture."""

    effect: dict[str, float | str]
    """Fields of the effect."""
    along: str
    """Label of the abscissa."""
    over: str
    """Label of the ordinate."""
    points: Callable[[Run], Points]
    shows: str
    """What to look for, in a sentence."""
    duration: float = 3.0
    sampling: float = 2.5e-4
    law: AbstractContactLaw = LAW
    lines: bool = False
    """Whether to join the points."""


_U, _V, _TIME = "relative displacement u, mm", "relative velocity u', m/s", "time, s"
_MISSING, _TOUCH, _CART = "missing force, N", "place of the touch, µm", "misfit of the cart, µm"
_SINCE, _LOAD_CELL = "time since the touch, ms", "load cell, N"
_CELL, _ACCELERATION = "misfit of the load cell, N", "misfit of the acceleration, m/s²"
_HAMMER, _FORCE = "hammer_displacement", "impact_force"

FINGERPRINTS: dict[str, Fingerprint] = {
    "coulomb_friction": Fingerprint(
        effect={"friction_force": 0.15}, along=_V, over=_MISSING, points=over_velocity, shows="A step where the velocity changes sign."
    ),
    "quadratic_drag": Fingerprint(
        effect={"drag_coefficient": 3.0},
        along=_V,
        over=_MISSING,
        points=over_velocity,
        shows="Half a parabola either way, against the motion.",
    ),
    "asymmetric_damping": Fingerprint(
        effect={"damping_difference": 0.8},
        along=_V,
        over=_MISSING,
        points=over_velocity,
        shows="A V: the force has the same sign in both directions.",
    ),
    "cubic_stiffness": Fingerprint(
        effect={"cubic_stiffness": 3e6}, along=_U, over=_MISSING, points=over_displacement, shows="A cubic through the place of rest."
    ),
    "constant_force": Fingerprint(
        effect={"constant_force": 0.2},
        along=_TIME,
        over=_MISSING,
        points=over_time,
        shows="A level other than zero, whatever the motion does.",
    ),
    "hysteresis": Fingerprint(
        effect={"hysteresis_force": 0.3, "yield_displacement": 1.5e-3},
        along=_U,
        over=_MISSING,
        points=over_displacement,
        shows="Loops: another branch on the way out than on the way back, whatever the speed.",
    ),
    "stop_compliance": Fingerprint(
        effect={"stop_stiffness": 1e6, "stop_frequency_hz": 400.0, "stop_damping_ratio": 0.05},
        along=_SINCE,
        over=_CELL,
        points=after_impacts("impact_force", scale=1.0, window=(-1e-3, 0.04)),
        sampling=1e-4,
        shows="The load cell rings on after the hammer has left, below zero too.",
    ),
    "contact_adhesion": Fingerprint(
        effect={"adhesion_force": 0.6, "adhesion_reach": 5e-4},
        along="distance to the stop while leaving, mm",
        over=_MISSING,
        points=while_leaving,
        sampling=1e-4,
        shows="A pull that begins at the surface and has ended at the reach, on the way back only.",
    ),
    "back_stop": Fingerprint(
        effect={"distance": 4e-3}, along=_U, over=_MISSING, points=over_displacement, shows="A large push beyond one displacement behind."
    ),
    "base_harmonics": Fingerprint(
        effect={"second_sine": 0.02, "second_cosine": 0.01, "third_sine": 0.015, "third_cosine": 0.0},
        along="phase of the drive, turns",
        over=_CART,
        points=cart_over_phase,
        shows="The same curve in every cycle of the drive.",
    ),
    "cart_recoil": Fingerprint(
        effect={"cart_mass": 5.0, "cart_frequency_hz": 40.0, "cart_damping_ratio": 0.1},
        along=_TIME,
        over=_CART,
        points=lambda run: until(cart_over_time(run), 0.6),
        shows="A kick at every impact, and a decaying oscillation after it.",
        lines=True,
    ),
    "frequency_drift": Fingerprint(
        effect={"drift_rate": 1e-3},
        along=_TIME,
        over=_CART,
        points=cart_over_time,
        shows="An oscillation at the drive's frequency that grows with the square of time.",
        lines=True,
    ),
    "gap_drift": Fingerprint(
        effect={"gap_rate": 1e-4},
        along=_TIME,
        over=_TOUCH,
        points=touch_over_time,
        sampling=5e-5,
        shows="The touch moves steadily from impact to impact.",
    ),
    "gap_step": Fingerprint(
        effect={"gap_jump": 2e-4, "instant": 1.6},
        along=_TIME,
        over=_TOUCH,
        points=touch_over_time,
        sampling=5e-5,
        shows="The touch jumps at one instant and stays.",
    ),
    "second_mode": Fingerprint(
        effect={"mode_mass": 0.01, "mode_frequency_hz": 30.0, "mode_damping_ratio": 0.03},
        along=_SINCE,
        over=_MISSING,
        points=missing_force_after_impacts,
        shows="An oscillation at a frequency of its own, struck at every impact.",
    ),
    "force_lag": Fingerprint(
        effect={"lag": 8e-4},
        along="force of the model, N",
        over=_LOAD_CELL,
        points=force_over_force,
        sampling=1e-4,
        shows="A loop in place of a straight line: too low while the force rises, too high while it falls.",
        lines=True,
    ),
    "force_clipping": Fingerprint(
        effect={"ceiling": 60.0},
        along="force of the model, N",
        over=_LOAD_CELL,
        points=force_over_force,
        sampling=1e-4,
        shows="A straight line up to the ceiling, and none above.",
    ),
    "mains_hum": Fingerprint(
        effect={"frequency_hz": 50.0, "sine": 1e-5, "cosine": 0.0, "of_channel": _HAMMER},
        along="frequency, Hz",
        over="misfit of the channel, µm",
        points=spectrum,
        lines=True,
        shows="One line in the spectrum of one channel, at no multiple of the drive.",
    ),
    "missing_stop": Fingerprint(
        effect={"impact_stiffness": 2e6, "impact_exponent": 1.5, "impact_damping": 0.3, "gap_offset": 0.0},
        along=_U,
        over=_MISSING,
        points=beyond_gap,
        law=NoContact(),
        shows="A large push beyond the gap, none before it.",
    ),
    "gain_error": Fingerprint(
        effect={"factor": 1.02, "of_channel": _HAMMER},
        along="displacement of the model, mm",
        over="misfit of the channel, µm",
        points=over_reading,
        shows="A straight line through the origin, over the channel's own value.",
    ),
    "time_offset": Fingerprint(
        effect={"delay": 3e-4, "of_channel": _HAMMER},
        along="velocity of the model, m/s",
        over="misfit of the channel, µm",
        points=over_rate,
        shows="A straight line through the origin, over the channel's rate of change.",
    ),
    "quintic_stiffness": Fingerprint(
        effect={"quintic_stiffness": 5e10},
        along=_U,
        over=_MISSING,
        points=over_displacement,
        shows="Flat about the place of rest, and ever steeper far from it.",
    ),
    "power_law_damping": Fingerprint(
        effect={"power_coefficient": 0.35, "exponent": 0.5},
        along=_V,
        over=_MISSING,
        points=over_velocity,
        shows="Steep through rest and flatter and flatter where p is below one, as here; where it is above, flat through rest and steeper.",
    ),
    "sensor_high_pass": Fingerprint(
        effect={"time_constant": 0.1, "of_channel": _FORCE},
        along=_TIME,
        over=_CELL,
        points=misfit_over_time(_FORCE, scale=1.0, until=0.6),
        shows="A drop below zero at every impact, by the impulse over the time constant, and a slow way back.",
        lines=True,
    ),
    "recorder_low_pass": Fingerprint(
        effect={"time_constant": 8e-4},
        along=_SINCE,
        over=_ACCELERATION,
        points=after_impacts("hammer_acceleration", scale=1.0, window=(-2e-3, 0.02)),
        sampling=1e-4,
        shows="Too little while an impact's force grows and too much while it falls, in every channel that shows it.",
    ),
    "nonlinear_reading": Fingerprint(
        effect={"quadratic": 2.0, "cubic": 1e3, "of_channel": _HAMMER},
        along="displacement of the model, mm",
        over="misfit of the channel, µm",
        points=over_reading,
        shows="A curve, over the channel's own value.",
    ),
    "reading_tone": Fingerprint(
        effect={"frequency_hz": 11.0, "decay_rate": 1.5, "sine": 5e-5, "cosine": 0.0, "of_channel": _HAMMER},
        along=_TIME,
        over="misfit of the channel, µm",
        points=misfit_over_time(_HAMMER, scale=1e6, until=3.0),
        shows="An oscillation in one channel that impacts and drive leave alone.",
        lines=True,
    ),
    "clock_drift": Fingerprint(
        effect={"drift_ppm": 300.0, "of_channel": _HAMMER},
        along=_TIME,
        over="misfit of the channel, µm",
        points=misfit_over_time(_HAMMER, scale=1e6, until=3.0),
        shows="The channel's rate of change, growing with time.",
        lines=True,
    ),
    "zero_drift": Fingerprint(
        effect={"rate": 3e-4, "settling_rate": 1.5, "of_channel": _HAMMER},
        along=_TIME,
        over="misfit of the channel, µm",
        points=misfit_over_time(_HAMMER, scale=1e6, until=3.0),
        shows="One channel alone moves away slowly, straight on or towards an end.",
        lines=True,
    ),
    "force_saturation": Fingerprint(
        effect={"saturation_force": 0.5, "threshold": 3e-3},
        along=_U,
        over=_MISSING,
        points=over_displacement,
        shows="A ramp through the place of rest that becomes level; the same way out and back.",
    ),
    "deep_stop": Fingerprint(
        effect={"stiffness": 2e7, "depth": 4e-4, "damping": 0.3},
        along="indentation, mm",
        over=_MISSING,
        points=over_indentation,
        sampling=5e-5,
        shows="No force up to one depth in the stop, and a steep push away from it beyond.",
    ),
}
"""By the name of a listed effect."""


def effect_of(name: str) -> AbstractEffect:
    """The effect of a fingerprint, at the strength that the picture shows."""
    numbers: dict[str, Any] = dict(FINGERPRINTS[name].effect)
    return EFFECTS[name](**numbers)
