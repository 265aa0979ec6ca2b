"""An experiment as the rest of the program sees it: the rig as the operator described it, its sensors and its records, in SI."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import Sensitivity
from identification.experiment.readers import stem_of


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


@dataclass(frozen=True, kw_only=True)
class Suspension:
    """How the hammer hangs on the cart.

    Attributes:
        kind: "linear" (spring and damper), "pendulum" (wires, full geometry), "pivot" (bearing, any angle) or "free" (neither of them).
        length: of the pendulum, or radius at which the displacement of a pivot is measured, m, above 0; None for the other kinds.
    """

    kind: str
    length: float | None = None


@dataclass(frozen=True, kw_only=True)
class Load:
    """Constant forces on the hammer that the operator knows; positive towards the stop.

    Attributes:
        incline: angle of the rail to the horizontal, rad; positive where the stop lies downhill.
        constant_force: N.
    """

    incline: float = 0.0
    constant_force: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Filter:
    """A known Butterworth filter through which a channel was recorded.

    Attributes:
        channel: its name.
        band: "lowpass" or "highpass".
        order: from 1 on.
        corner: Hz, above 0: the amplitude has fallen to 1/sqrt(2) there.
    """

    channel: str
    band: str
    order: int
    corner: float


@dataclass(frozen=True, kw_only=True)
class Prior:
    """Normal prior of a parameter: mean and standard deviation in the parameter's own unit."""

    mean: float
    std: float


@dataclass(frozen=True, kw_only=True)
class ParameterOption:
    """What the operator wants of one parameter of the fit; numbers are in the parameter's own unit.

    Attributes:
        start: first guess; None leaves the choice to the fit.
        fixed: True keeps the parameter at `start`.
        bounds: lowest and highest value of the fit; None for the usual range.
        prior: what is known of it beside these records; None for nothing.
        varies: True gives every record a value of its own, about a common mean; how much they differ is estimated.
    """

    start: float | None = None
    fixed: bool = False
    bounds: tuple[float, float] | None = None
    prior: Prior | None = None
    varies: bool = False


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """What is done to a record before it is used, as its table declares it.

    Attributes:
        crop: first and last instant that are kept, s; None for the whole record.
        mask: first and last instants of stretches, s, that are left out of every channel.
        lowpass: cut-off of a low-pass without phase on every channel, Hz, or None.
        decimate: every how many samples one is kept, behind an anti-alias filter, or None.
        resample: new sampling rate, Hz, or None.
        detrend: "constant" or "linear", by channel: what is subtracted.
    """

    crop: tuple[float, float] | None = None
    mask: tuple[tuple[float, float], ...] = ()
    lowpass: float | None = None
    decimate: int | None = None
    resample: float | None = None
    detrend: dict[str, str] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """What is done, in the order in which it is; empty for nothing."""
        said = [f"crop to {self.crop[0]:g} to {self.crop[1]:g} s"] if self.crop is not None else []
        said += [f"{begin:g} to {end:g} s left out" for begin, end in self.mask]
        said += [f"low-pass at {self.lowpass:g} Hz"] if self.lowpass is not None else []
        said += [f"one sample of {self.decimate} kept behind an anti-alias filter"] if self.decimate is not None else []
        said += [f"resampled to {self.resample:g} Hz"] if self.resample is not None else []
        said += [f"{'mean' if kind == 'constant' else 'straight line'} taken out of {name}" for name, kind in self.detrend.items()]
        return ", ".join(said)


@dataclass(frozen=True, kw_only=True)
class Sensed:
    """What a channel's samples said of its noise before they were filtered.

    Attributes:
        estimate: standard deviation of the noise, SI; None where it cannot be estimated.
        step: of the quantisation, SI; 0 where there is none.
        gain: standard deviation of white noise behind the filters over that before them.
    """

    estimate: float | None
    step: float
    gain: float = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """One record of an experiment.

    Attributes:
        file: path of the record inside the experiment's folder, as written there.
        kind: "drop-test", "cart-excitation", "free-decay", "forced" or "prescribed".
        gap: clearance between hammer and stop at rest, m, as set by the operator.
        excitation_frequency: Hz, as set; None where the record has no drive or the drive is the measured motion.
        base: "sine", or "measured" where the recorded cart motion drives the model.
        base_amplitude: A0 of y = A0 sin(2 pi f t + base_phase), m, or None.
        base_phase: rad, or None.
        initial_displacement: hammer minus cart at the first sample, m, or None.
        initial_velocity: hammer minus cart at the first sample, m/s, or None.
        duration: s, as declared, or None.
        sampling_frequency: Hz, as declared, or None.
        held_back: True where no fit may see the record: it is there to be predicted.
        time: time stamps in s, finite and strictly increasing, shape (samples,).
        channels: recorded channels in SI, float64, shape (samples,); NaN where a sample is not usable.
        noise: standard deviation of each recorded channel, SI, above 0: declared plus quantisation, else estimated.
        noise_estimated: the channels whose noise was estimated.
        preparation: what was done to the recorded samples.
        sensed: of the channels that were filtered, what their samples said of their noise before.
        sha256: of the file's bytes, hexadecimal; None where there is no file.
        notices: sentences for the operator on everything that was found odd or handled.
    """

    file: str
    kind: str
    gap: float
    time: Float64[np.ndarray, " samples"]
    excitation_frequency: float | None = None
    base: str = "sine"
    base_amplitude: float | None = None
    base_phase: float | None = None
    initial_displacement: float | None = None
    initial_velocity: float | None = None
    duration: float | None = None
    sampling_frequency: float | None = None
    held_back: bool = False
    channels: dict[str, Float64[np.ndarray, " samples"]] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    noise_estimated: frozenset[str] = frozenset()
    preparation: Preparation = Preparation()
    sensed: dict[str, Sensed] = field(default_factory=dict)
    sha256: str | None = None
    notices: tuple[str, ...] = ()

    @property
    def stem(self) -> str:
        """File name without folder and suffix ("cart1" for "march/cart1.csv.gz"); unique within an experiment."""
        return stem_of(self.file)


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiment:
    """Everything that an experiment folder says.

    Attributes:
        name: as declared, else the folder's name.
        folder: where it was read.
        mass: of the hammer, kg, above 0.
        mass_is_known: False where the mass was not weighed and is to be estimated, `mass` being the first guess.
        suspension: how the hammer hangs.
        load: constant forces on the hammer that are known.
        law: name of the contact law the operator chose, not checked here; None for the nominal one.
        parameters: what the operator wants of single parameters, by name.
        sensors: by channel.
        filters: known ones, in the order in which readings pass them: those of a sensor, then those of the recorder.
        records: at least one, in the order of the file.
        sha256: of the experiment file's bytes, hexadecimal.
        warnings: sentences on what is odd about the experiment and may be right.
    """

    name: str
    folder: Path
    mass: float
    suspension: Suspension
    records: tuple[Record, ...]
    sha256: str
    mass_is_known: bool = True
    load: Load = Load()
    law: str | None = None
    parameters: dict[str, ParameterOption] = field(default_factory=dict)
    sensors: dict[str, Sensor] = field(default_factory=dict)
    filters: tuple[Filter, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def fitting(self) -> "Experiment":
        """The experiment without its held-back records: what a fit may see."""
        return replace(self, records=tuple(record for record in self.records if not record.held_back))

    @property
    def held_back(self) -> tuple[Record, ...]:
        """Records that no fit may see."""
        return tuple(record for record in self.records if record.held_back)
