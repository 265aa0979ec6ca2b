"""Effects that a nominal model may leave out, one a file. An effect is known to the program by its import here."""

from vibrojax.effects.base import AbstractEffect as AbstractEffect
from vibrojax.effects.base import Motion as Motion
from vibrojax.effects.base import OwnState as OwnState
from vibrojax.effects.probe import Probe as Probe
from vibrojax.effects.probe import ProbeScales as ProbeScales
from vibrojax.listing import final_classes

# isort: off
# In the order of candidates.
from vibrojax.effects.coulomb_friction import CoulombFriction as CoulombFriction
from vibrojax.effects.quadratic_drag import QuadraticDrag as QuadraticDrag
from vibrojax.effects.cubic_stiffness import CubicStiffness as CubicStiffness
from vibrojax.effects.constant_force import ConstantForce as ConstantForce
from vibrojax.effects.hysteresis import Hysteresis as Hysteresis
from vibrojax.effects.stop_compliance import StopCompliance as StopCompliance
from vibrojax.effects.contact_adhesion import ContactAdhesion as ContactAdhesion
from vibrojax.effects.back_stop import BackStop as BackStop
from vibrojax.effects.base_harmonics import BaseHarmonics as BaseHarmonics
from vibrojax.effects.cart_recoil import CartRecoil as CartRecoil
from vibrojax.effects.frequency_drift import FrequencyDrift as FrequencyDrift
from vibrojax.effects.gap_drift import GapDrift as GapDrift
from vibrojax.effects.gap_step import GapStep as GapStep
from vibrojax.effects.second_mode import SecondMode as SecondMode
from vibrojax.effects.force_lag import ForceLag as ForceLag
from vibrojax.effects.force_clipping import ForceClipping as ForceClipping
from vibrojax.effects.mains_hum import MainsHum as MainsHum
from vibrojax.effects.missing_stop import MissingStop as MissingStop
from vibrojax.effects.gain_error import GainError as GainError
from vibrojax.effects.time_offset import TimeOffset as TimeOffset
from vibrojax.effects.quintic_stiffness import QuinticStiffness as QuinticStiffness
from vibrojax.effects.power_law_damping import PowerLawDamping as PowerLawDamping
from vibrojax.effects.sensor_high_pass import SensorHighPass as SensorHighPass
from vibrojax.effects.recorder_low_pass import RecorderLowPass as RecorderLowPass
from vibrojax.effects.nonlinear_reading import NonlinearReading as NonlinearReading
from vibrojax.effects.reading_tone import ReadingTone as ReadingTone
from vibrojax.effects.clock_drift import ClockDrift as ClockDrift
from vibrojax.effects.force_saturation import ForceSaturation as ForceSaturation
from vibrojax.effects.deep_stop import DeepStop as DeepStop
from vibrojax.effects.asymmetric_damping import AsymmetricDamping as AsymmetricDamping
# isort: on

EFFECTS: dict[str, type[AbstractEffect]] = {effect.name: effect for effect in final_classes(vars(), AbstractEffect)}
"""Every listed effect by name."""
