"""One sensor of the rig: the unit its readings are written in, its sensitivity, noise and range."""

from dataclasses import dataclass

from identification.experiment.sensitivity import Sensitivity


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """What the experiment file declares about one channel.

    Attributes:
        unit: unit of the recorded numbers, for instance "mm"; they are converted to SI on reading. None where the files state it.
        sensitivity: of a sensor whose output was recorded in V, mV or mA; None where the recorded numbers are what it measures.
        sign: -1 where the sensor is mounted so that its readings point the other way; they are multiplied by it on reading.
        noise: standard deviation in SI, above 0; None where it is to be estimated from each record.
        zero: standard deviation, in SI, of a zero that the operator does not know, above 0; None where it is known to be
            right. Every record then has a zero of its own, which is estimated with this as its prior.
        range: lowest and highest value, in SI, that the sensor can show; samples at or beyond it are not usable. None: unlimited.
    """

    unit: str | None = None
    sensitivity: Sensitivity | None = None
    sign: int = 1
    noise: float | None = None
    zero: float | None = None
    range: tuple[float, float] | None = None
