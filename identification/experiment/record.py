"""One record as the rest of the program sees it: SI, float64, with a notice on every irregularity."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from identification.experiment.readers import stem_of


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """What is done to a record before it is used, as its table declares it.

    Attributes:
        crop: first and last instant that are kept, s; None for the whole record.
        lowpass: cut-off of a low-pass without phase on every channel, Hz, or None.
        decimate: every how many samples one is kept, behind an anti-alias filter, or None.
        resample: new sampling rate, Hz, or None.
        detrend: "constant" or "linear", by channel: what is subtracted.
    """

    crop: tuple[float, float] | None = None
    lowpass: float | None = None
    decimate: int | None = None
    resample: float | None = None
    detrend: dict[str, str] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """What is done, in the order in which it is; empty for nothing."""
        said = [f"crop to {self.crop[0]:g} to {self.crop[1]:g} s"] if self.crop is not None else []
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
