"""Effects that a nominal model may leave out, one a file."""

from vibrojax.effects.asymmetric_damping import AsymmetricDamping
from vibrojax.effects.back_stop import BackStop
from vibrojax.effects.base import AbstractEffect, Facts, Motion, OwnState
from vibrojax.effects.base_harmonics import BaseHarmonics
from vibrojax.effects.cart_recoil import CartRecoil
from vibrojax.effects.constant_force import ConstantForce
from vibrojax.effects.contact_adhesion import ContactAdhesion
from vibrojax.effects.coulomb_friction import CoulombFriction
from vibrojax.effects.cubic_stiffness import CubicStiffness
from vibrojax.effects.deep_stop import DeepStop
from vibrojax.effects.force_clipping import ForceClipping
from vibrojax.effects.force_lag import ForceLag
from vibrojax.effects.force_saturation import ForceSaturation
from vibrojax.effects.frequency_drift import FrequencyDrift
from vibrojax.effects.gain_error import GainError
from vibrojax.effects.gap_drift import GapDrift
from vibrojax.effects.gap_step import GapStep
from vibrojax.effects.hysteresis import Hysteresis
from vibrojax.effects.mains_hum import MainsHum
from vibrojax.effects.missing_stop import MissingStop
from vibrojax.effects.quadratic_drag import QuadraticDrag
from vibrojax.effects.second_mode import SecondMode
from vibrojax.effects.stop_compliance import StopCompliance
from vibrojax.effects.time_offset import TimeOffset

EFFECTS: dict[str, type[AbstractEffect]] = {
    effect.name: effect
    for effect in (
        CoulombFriction,
        QuadraticDrag,
        CubicStiffness,
        ConstantForce,
        Hysteresis,
        StopCompliance,
        ContactAdhesion,
        BackStop,
        BaseHarmonics,
        CartRecoil,
        FrequencyDrift,
        GapDrift,
        GapStep,
        SecondMode,
        ForceLag,
        ForceClipping,
        MainsHum,
        MissingStop,
        GainError,
        TimeOffset,
        ForceSaturation,
        DeepStop,
        AsymmetricDamping,
    )
}
"""Every listed effect by name."""

__all__ = [
    "EFFECTS",
    "AbstractEffect",
    "AsymmetricDamping",
    "BackStop",
    "BaseHarmonics",
    "CartRecoil",
    "ConstantForce",
    "ContactAdhesion",
    "CoulombFriction",
    "CubicStiffness",
    "DeepStop",
    "Facts",
    "ForceClipping",
    "ForceLag",
    "ForceSaturation",
    "FrequencyDrift",
    "GainError",
    "GapDrift",
    "GapStep",
    "Hysteresis",
    "MainsHum",
    "MissingStop",
    "Motion",
    "OwnState",
    "QuadraticDrag",
    "SecondMode",
    "StopCompliance",
    "TimeOffset",
]
