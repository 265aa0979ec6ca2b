"""The samples of a record: unusable ones marked, then crop, mask, filters and trends as its table declares them."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64, Int
from scipy.interpolate import CubicSpline
from scipy.ndimage import binary_dilation
from scipy.signal import butter, firwin, freqz, resample_poly, sosfiltfilt, sosfreqz

from identification.experiment.channels import si_unit
from identification.experiment.clock import IRREGULAR_SPREAD, MIN_SAMPLES
from identification.experiment.errors import ExperimentError
from identification.experiment.experiment import Preparation, Sensed
from identification.experiment.limits import LARGEST
from identification.experiment.noise import estimate_noise, quantisation_step

Samples = Float64[np.ndarray, " _"]
_ROUNDING = 1e-9
"""Of a limit: by so much a sample at it may fall short after units have been converted."""


def mark_unusable(values: Samples, time: Samples, channel: str, limits: tuple[float, float] | None) -> tuple[Samples, tuple[str, ...]]:
    """A channel, SI, with NaN for samples at or beyond the declared range of its sensor; and notices on these and on missing ones."""
    missing, found = ~np.isfinite(values), {}
    if not missing.all():
        found[f"missing (NaN, infinite, beyond {LARGEST:.0e} or empty), left out"] = missing
    if limits is not None:
        low, high = limits
        beyond = (values <= low + _ROUNDING * abs(low)) | (values >= high - _ROUNDING * abs(high))
        found[f"at or beyond the declared range, {low:.6g} to {high:.6g} {si_unit(channel)}: left out"] = beyond
        values = np.where(beyond, np.nan, values)
    counts = {why: "1 sample is" if mask.sum() == 1 else f"{mask.sum()} samples are" for why, mask in found.items()}
    return values, tuple(f"{channel}: {counts[why]} {why}, in {_stretches(mask, time)}." for why, mask in found.items() if mask.any())


def runs_of(mask: Bool[np.ndarray, " samples"]) -> tuple[Int[np.ndarray, " stretches"], Int[np.ndarray, " stretches"]]:
    """Index of the first sample of each stretch in which a mask holds, and index past its last.

    Example:
        >>> [edge.tolist() for edge in runs_of(np.array([False, True, True, False]))]
        [[1], [3]]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return edges[::2], edges[1::2]


def _stretches(mask: Bool[np.ndarray, " samples"], time: Float64[np.ndarray, " samples"]) -> str:
    """Place the stretches of a mask in time."""
    first, past = runs_of(mask)
    begin, end = time[first[0]], time[past[-1] - 1]
    if first.size == 1:
        return f"one stretch from {begin:.6g} s to {end:.6g} s ({end - begin:.4g} s long)"
    longest = int(np.argmax(past - first))
    return (
        f"{first.size} stretches between {begin:.6g} s and {end:.6g} s, the longest {past[longest] - first[longest]} samples "
        f"from {time[first[longest]]:.6g} s"
    )


BINS = 2048
"""Frequencies at which the power that filters let pass is added up."""


@dataclass(frozen=True, kw_only=True)
class Saturation:
    """One level at which a channel is cut off.

    Attributes:
        level: in the channel's unit.
        side: "largest" or "smallest".
        runs: number of stretches at that level.
        samples: number of samples in them.
        first: index of the first of these.
    """

    level: float
    side: str
    runs: int
    samples: int
    first: int


def find_saturation(values: Samples) -> tuple[Saturation, ...]:
    """Look for two or more runs of four samples at exactly a channel's largest or smallest value, entered or left steeply.

    Not taken for saturation: a level near zero or one that holds half of all samples (a channel at rest), and crests or rest levels that
    only quantisation makes flat: such a crest falls by about three steps within two samples. At most one finding for either side.

    Example:
        >>> wave = np.sin(np.linspace(0.0, 20.0, 200))
        >>> [found.side for found in find_saturation(np.minimum(wave, 0.8))]
        ['largest']
    """
    finite = values[np.isfinite(values)]
    if finite.size == 0 or finite.max() == finite.min():
        return ()
    span = float(finite.max() - finite.min())
    found = []
    for side, signed in (("largest", values), ("smallest", -values)):
        peak = float(np.nanmax(signed))
        at = signed == peak
        if abs(peak) <= 0.02 * span or at.sum() >= 0.5 * finite.size:
            continue
        first, past = runs_of(at)
        long = past - first >= 4
        if long.sum() < 2:
            continue
        padded = np.concatenate(([np.nan, np.nan], signed, [np.nan, np.nan]))  # how far it falls within two samples of a run
        fall = np.fmax(np.nan_to_num(peak - padded[first], nan=0.0), np.nan_to_num(peak - padded[past + 3], nan=0.0))
        steep = long & (fall > 8.0 * _resolution(finite, abs(peak)))
        if steep.sum() >= 2:
            level, samples = peak if side == "largest" else -peak, int((past - first)[steep].sum())
            found.append(Saturation(level=level, side=side, runs=int(steep.sum()), samples=samples, first=int(first[steep][0])))
    return tuple(found)


def _resolution(finite: Float64[np.ndarray, " usable"], size: float) -> float:
    """Step between neighbouring values of about `size`: that of the quantisation, or of the digits the numbers were printed with.

    Where neighbours are alike at most levels, it is that of these: the few others may be means. At two they may be in any resting channel.
    """
    alike, every = np.unique(finite[1:][np.diff(finite) == 0.0])[1:-1], np.unique(finite)
    levels = np.diff(alike if alike.size > 2 and 2 * alike.size > every.size else every)
    sample = finite[:: max(1, finite.size // 1000)]
    digits = max(len(f"{abs(value):.11e}".partition("e")[0].replace(".", "").rstrip("0")) for value in sample)
    return max(float(levels.min()), 10.0 ** (np.floor(np.log10(size)) - digits + 1))


def prepared(
    time: Samples, channels: dict[str, Samples], asked: Preparation, where: str
) -> tuple[Samples, dict[str, Samples], dict[str, Sensed], tuple[str, ...]]:
    """Prepare a record, in this order: crop, mask, low-pass, decimation or resampling, removal of a trend.

    Returns:
        Time, s, and channels, SI, as prepared, what is known of each channel's noise before that, and notices on what was done.

    Raises:
        ExperimentError: the record does not allow it: too little is left, a cut-off above half its rate, uneven samples to be filtered.
    """
    time, channels = cropped(time, channels, asked, where)
    usable = [name for name, values in channels.items() if np.isfinite(values).sum() >= MIN_SAMPLES]
    channels = _masked(time, channels, asked, where)
    for name in usable:
        if (left := int(np.isfinite(channels[name]).sum())) < MIN_SAMPLES:
            raise ExperimentError(f"mask leaves {left} samples of {name} of {where}: expected at least {MIN_SAMPLES}; mask less of it")
    sensed = {name: Sensed(estimate=estimate_noise(values), step=quantisation_step(values)) for name, values in channels.items()}
    lost = {name: ~np.isfinite(values) for name, values in channels.items()}
    power, rate = np.ones(BINS), 1.0 / float(np.median(np.diff(time)))
    steps = np.diff(time)
    if (asked.lowpass is not None or asked.decimate is not None) and np.ptp(steps) > IRREGULAR_SPREAD * float(np.median(steps)):
        raise ExperimentError(
            f"{where} is to be filtered and its samples come unevenly, at steps of {steps.min():.4g} to {steps.max():.4g} s: expected "
            f"equal steps; set resample = {rate:.4g} (Hz) in place of lowpass or decimate"
        )
    if asked.lowpass is not None:
        given, slowest = f"lowpass of {where} is {asked.lowpass:g} Hz", 1.0 / float(time[-1] - time[0])
        if asked.lowpass >= 0.5 * rate:
            raise ExperimentError(f"{given}: expected less than half its sampling rate, {0.5 * rate:.6g} Hz; lower it")
        if asked.lowpass <= slowest:  # below it a record holds nothing but its mean
            raise ExperimentError(f"{given}: expected more than one over its duration, {slowest:.6g} Hz; raise it")
        sos: Any = butter(4, asked.lowpass, fs=rate, output="sos")  # run both ways: no phase, and half the amplitude at the cut-off
        channels = {name: np.asarray(sosfiltfilt(sos, bridged(time, values))) for name, values in channels.items()}
        power = power * np.abs(np.asarray(sosfreqz(sos, BINS)[1])) ** 4
        lost = {name: _widened(values, round(0.5 * rate / asked.lowpass)) for name, values in lost.items()}
    if asked.decimate is not None or asked.resample is not None:
        ratio = Fraction(1, asked.decimate) if asked.decimate is not None else _ratio(asked.resample or rate, time, where)
        if (left := ceil(time.size * ratio)) < MIN_SAMPLES:
            raise ExperimentError(f"preparation leaves {left} samples of {where}: expected at least {MIN_SAMPLES}; leave more of them")
        time, channels, lost, passed = _resampled(time, channels, lost, ratio)
        power = power * passed
    channels = {name: np.where(lost[name], np.nan, values) for name, values in channels.items()}
    for name in asked.detrend.keys() & channels.keys():
        usable, degree = np.isfinite(channels[name]), 0 if asked.detrend[name] == "constant" else 1
        trend = np.polyfit(time[usable] - time[0], channels[name][usable], degree)
        channels[name] = channels[name] - np.polyval(trend, time - time[0])
    stated = {name: Sensed(estimate=one.estimate, step=one.step, gain=float(np.sqrt(power.mean()))) for name, one in sensed.items()}
    filtered = asked.lowpass is not None or asked.decimate is not None or asked.resample is not None
    said = [f"Prepared as declared: {asked.words}."]
    holes = [name for name, values in lost.items() if values.any()]
    if filtered and holes:
        said.append(f"Missing samples of {', '.join(holes)} were bridged by straight lines for the filter, and are left out.")
    return time, channels, stated if filtered else {}, tuple(said)


def cropped(time: Samples, channels: dict[str, Samples], asked: Preparation, where: str) -> tuple[Samples, dict[str, Samples]]:
    """The part between two instants, all of it where the record declares none."""
    if asked.crop is None:
        return time, channels
    begin, end = asked.crop
    kept = (time >= begin) & (time <= end)
    if kept.sum() < MIN_SAMPLES:
        raise ExperimentError(
            f"crop of {where} leaves {int(kept.sum())} samples between {begin:g} and {end:g} s: expected at least {MIN_SAMPLES}; the "
            f"record runs from {time[0]:.6g} to {time[-1]:.6g} s"
        )
    return time[kept], {name: values[kept] for name, values in channels.items()}


def _masked(time: Samples, channels: dict[str, Samples], asked: Preparation, where: str) -> dict[str, Samples]:
    """Channels without the samples of the stretches that are left out."""
    left_out = np.zeros(time.size, bool)
    for begin, end in asked.mask:
        inside = (time >= begin) & (time <= end)
        if not inside.any():
            raise ExperimentError(
                f"mask of {where} names {begin:g} to {end:g} s, where it has no sample: expected a stretch between {time[0]:.6g} and "
                f"{time[-1]:.6g} s; correct it"
            )
        left_out |= inside
    if time.size - left_out.sum() < MIN_SAMPLES:
        raise ExperimentError(f"mask of {where} leaves {time.size - left_out.sum()} samples: expected at least {MIN_SAMPLES}; shorten it")
    return {name: np.where(left_out, np.nan, values) for name, values in channels.items()}


def bridged(time: Samples, values: Samples) -> Samples:
    """A channel with straight lines where samples are missing."""
    usable = np.isfinite(values)
    return values if usable.all() else np.interp(time, time[usable], values[usable])


def _widened(lost: Bool[np.ndarray, " _"], reach: int) -> Bool[np.ndarray, " _"]:
    """Missing samples, with those beside them that a filter fills from the straight line across: so many on either side."""
    return np.asarray(binary_dilation(lost, iterations=reach)) if reach and lost.any() else lost


def _ratio(wanted: float, time: Samples, where: str) -> Fraction:
    """The wanted sampling rate, Hz, over that of the record."""
    rate = (time.size - 1) / float(time[-1] - time[0])
    ratio = Fraction(wanted / rate).limit_denominator(1000)
    if not 0 < ratio.numerator <= 1000:
        raise ExperimentError(
            f"resample of {where} is {wanted:g} Hz, and it comes at {rate:.6g} Hz: expected a rate nearer to that; correct it"
        )
    return ratio


def _resampled(
    time: Samples, channels: dict[str, Samples], lost: dict[str, Any], ratio: Fraction
) -> tuple[Samples, dict[str, Samples], dict[str, Any], Samples]:
    """Channels at another rate, low-passed at half of the lower one; uneven samples are first put onto even ones by cubic splines.

    The last value is what passes of the power at frequencies from 0 to half the record's own rate. The linear-phase filter keeps amplitudes
    to 1e-5 up to 0.84 of the new half rate, halves them there, and takes them to 1e-5 from 1.16 of it on.
    """
    rate, (up, down) = (time.size - 1) / float(time[-1] - time[0]), ratio.as_integer_ratio()
    even = time[0] + np.arange(time.size) / rate
    onto = {name: np.asarray(CubicSpline(time, bridged(time, values))(even)) for name, values in channels.items()}
    if ratio == 1:
        return even, onto, lost, np.ones(BINS)
    slower = max(up, down)
    window: Any = firwin(40 * slower + 1, 1.0 / slower, window=("kaiser", 10.0))  # type: ignore[arg-type]
    onto = {name: np.asarray(resample_poly(values, up, down, window=window, padtype="line")) for name, values in onto.items()}
    stamps = time[0] + np.arange(next(iter(onto.values())).size) / (rate * float(ratio))
    nearest = np.clip(np.rint((stamps - time[0]) * rate).astype(int), 0, time.size - 1)
    lost = {name: _widened(values, -(-slower // up)) for name, values in lost.items()}
    passed = np.asarray(freqz(window, worN=np.arange(BINS) * np.pi / (BINS * up))[1])  # type: ignore[arg-type]
    return stamps, onto, {name: values[nearest] for name, values in lost.items()}, np.abs(passed) ** 2
