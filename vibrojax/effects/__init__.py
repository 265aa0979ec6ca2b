"""Effects that a nominal model may leave out. An effect is known to the program by its import here."""

from vibrojax.effects.base import AbstractEffect as AbstractEffect
from vibrojax.effects.base import Motion as Motion
from vibrojax.effects.base import OwnState as OwnState
from vibrojax.effects.probe import Probe as Probe
from vibrojax.effects.probe import ProbeScales as ProbeScales
from vibrojax.parameters import final_classes

# isort: off
# In the order of candidates.
from vibrojax.effects.forces import CoulombFriction as CoulombFriction
from vibrojax.effects.forces import QuadraticDrag as QuadraticDrag
from vibrojax.effects.forces import CubicStiffness as CubicStiffness
from vibrojax.effects.forces import ConstantForce as ConstantForce
from vibrojax.effects.forces import Hysteresis as Hysteresis
from vibrojax.effects.stops import StopCompliance as StopCompliance
from vibrojax.effects.stops import ContactAdhesion as ContactAdhesion
from vibrojax.effects.stops import BackStop as BackStop
from vibrojax.effects.cart import BaseHarmonics as BaseHarmonics
from vibrojax.effects.cart import CartRecoil as CartRecoil
from vibrojax.effects.cart import FrequencyDrift as FrequencyDrift
from vibrojax.effects.stops import GapDrift as GapDrift
from vibrojax.effects.stops import GapStep as GapStep
from vibrojax.effects.forces import SecondMode as SecondMode
from vibrojax.effects.filters import ForceLag as ForceLag
from vibrojax.effects.readings import ForceClipping as ForceClipping
from vibrojax.effects.readings import MainsHum as MainsHum
from vibrojax.effects.stops import MissingStop as MissingStop
from vibrojax.effects.readings import GainError as GainError
from vibrojax.effects.readings import TimeOffset as TimeOffset
from vibrojax.effects.forces import QuinticStiffness as QuinticStiffness
from vibrojax.effects.forces import PowerLawDamping as PowerLawDamping
from vibrojax.effects.filters import SensorHighPass as SensorHighPass
from vibrojax.effects.filters import RecorderLowPass as RecorderLowPass
from vibrojax.effects.readings import NonlinearReading as NonlinearReading
from vibrojax.effects.readings import ReadingTone as ReadingTone
from vibrojax.effects.readings import ClockDrift as ClockDrift
from vibrojax.effects.forces import ForceSaturation as ForceSaturation
from vibrojax.effects.stops import DeepStop as DeepStop
from vibrojax.effects.forces import AsymmetricDamping as AsymmetricDamping
from vibrojax.effects.readings import ZeroDrift as ZeroDrift
from vibrojax.effects.stops import FallingRestitution as FallingRestitution
# isort: on

EFFECTS: dict[str, type[AbstractEffect]] = {effect.name: effect for effect in final_classes(vars(), AbstractEffect)}
"""Every listed effect by name."""
