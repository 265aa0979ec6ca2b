"""What a simulated rig can conceal, by name: the effects on the program's list, and those on no list (`x_…`)."""

from benchmarks.simulator.effects import channels, drive, stop, suspension, unlisted
from benchmarks.simulator.effects.base import Draw, Effect
from benchmarks.simulator.effects.setting import Setting

__all__ = ["EFFECTS", "LISTED", "UNLISTED", "Effect", "Setting"]

_FORCE = frozenset({"impact_force"})


def _table(*draws: Draw, needs: frozenset[str] = frozenset()) -> dict[str, Effect]:
    """An effect is named as the function that draws it."""
    return {draw.__name__: Effect(name=draw.__name__, draw=draw, needs=needs) for draw in draws}


LISTED: dict[str, Effect] = {
    **_table(suspension.coulomb_friction, suspension.quadratic_drag, suspension.cubic_stiffness, suspension.constant_force),
    **_table(suspension.hysteresis, stop.stop_compliance, stop.contact_adhesion, stop.back_stop),
    **_table(drive.base_harmonics, drive.cart_recoil, drive.frequency_drift, stop.gap_drift, stop.gap_step, suspension.second_mode),
    **_table(channels.force_lag, channels.force_clipping, needs=_FORCE),
    **_table(channels.mains_hum, stop.missing_stop, channels.gain_error, channels.time_offset),
    **_table(stop.deep_stop, suspension.asymmetric_damping, suspension.force_saturation),
    **_table(suspension.quintic_stiffness, suspension.power_law_damping),
    **_table(channels.sensor_high_pass, needs=_FORCE),
    **_table(channels.recorder_low_pass, channels.nonlinear_reading, channels.reading_tone, channels.clock_drift),
    **_table(channels.zero_drift),
}
UNLISTED: dict[str, Effect] = _table(
    unlisted.x_foreign_force,
    unlisted.x_warming_spring,
    unlisted.x_position_damping,
    unlisted.x_gain_drift,
    unlisted.x_knocks,
    unlisted.x_parametric_stiffness,
    unlisted.x_stop_wear,
    unlisted.x_magnet,
)
EFFECTS: dict[str, Effect] = LISTED | UNLISTED
