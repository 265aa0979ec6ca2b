"""Preparation of a record as its table declares it: crop, low-pass, decimation or resampling, removal of a trend."""

from fractions import Fraction
from math import ceil
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64
from scipy.interpolate import CubicSpline
from scipy.ndimage import binary_dilation
from scipy.signal import butter, firwin, freqz, resample_poly, sosfiltfilt, sosfreqz

from identification.experiment.columns.timebase import IRREGULAR_SPREAD, MIN_SAMPLES
from identification.experiment.errors import ExperimentError
from identification.experiment.noise import estimate_noise, quantisation_step
from identification.experiment.record import Preparation, Sensed

Samples = Float64[np.ndarray, " _"]
BUTTERWORTH_ORDER = 4
"""Of the low-pass, run forwards and backwards: no phase, and half the amplitude at the cut-off."""
KAISER, TAPS = 10.0, 40
"""Shape and length, over the ratio of the rates, of the linear-phase filter before a change of rate: it keeps amplitudes to 1e-5 up
to 0.84 of the new half rate, halves them there, and takes them to 1e-5 from 1.16 of it on."""
BINS = 2048
"""Frequencies at which the power that filters let pass is added up."""
FINEST_RATIO = 1000
"""Largest numerator or denominator of the ratio of two sampling rates."""


def prepared(
    time: Samples, channels: dict[str, Samples], asked: Preparation, where: str
) -> tuple[Samples, dict[str, Samples], dict[str, Sensed], tuple[str, ...]]:
    """Prepare a record, in this order: crop, low-pass, decimation or resampling, removal of a trend.

    Args:
        time: s, checked, shape (samples,).
        channels: SI, shape (samples,) each; NaN where not usable.
        asked: what the record declares.
        where: the record, for messages.

    Returns:
        Time and channels as prepared, what is known of each channel's noise before that, and notices on what was done.

    Raises:
        ExperimentError: the record does not allow it: too little is left, a cut-off above half its rate, uneven samples to be filtered.
    """
    time, channels = _cropped(time, channels, asked, where)
    sensed = {name: Sensed(estimate=estimate_noise(values), step=quantisation_step(values)) for name, values in channels.items()}
    lost = {name: ~np.isfinite(values) for name, values in channels.items()}
    power, rate = np.ones(BINS), 1.0 / float(np.median(np.diff(time)))
    if asked.lowpass is not None or asked.decimate is not None:
        _check_even(time, where)
    if asked.lowpass is not None:
        _check_lowpass(asked.lowpass, 0.5 * rate, 1.0 / float(time[-1] - time[0]), where)
        sos: Any = butter(BUTTERWORTH_ORDER, asked.lowpass, fs=rate, output="sos")
        channels = {name: _filtered(sos, time, values) for name, values in channels.items()}
        power = power * np.abs(np.asarray(sosfreqz(sos, BINS)[1])) ** 4
        lost = {name: _widened(values, round(0.5 * rate / asked.lowpass)) for name, values in lost.items()}
    if asked.decimate is not None or asked.resample is not None:
        ratio = Fraction(1, asked.decimate) if asked.decimate is not None else _ratio(asked.resample or rate, time, where)
        if (left := ceil(time.size * ratio)) < MIN_SAMPLES:
            raise ExperimentError(f"preparation leaves {left} samples of {where}: expected at least {MIN_SAMPLES}; leave more of them")
        time, channels, lost, passed = _resampled(time, channels, lost, ratio)
        power = power * passed
    channels = {name: np.where(lost[name], np.nan, values) for name, values in channels.items()}
    for name, kind in asked.detrend.items():
        if name in channels:
            channels[name] = _without_trend(time, channels[name], degree=0 if kind == "constant" else 1)
    stated = {name: Sensed(estimate=one.estimate, step=one.step, gain=float(np.sqrt(power.mean()))) for name, one in sensed.items()}
    filtered = asked.lowpass is not None or asked.decimate is not None or asked.resample is not None
    return time, channels, stated if filtered else {}, _notices(asked, lost, filtered)


def _cropped(time: Samples, channels: dict[str, Samples], asked: Preparation, where: str) -> tuple[Samples, dict[str, Samples]]:
    """The part between two instants."""
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


def _check_even(time: Samples, where: str) -> None:
    """A filter needs equal steps."""
    steps = np.diff(time)
    if np.ptp(steps) > IRREGULAR_SPREAD * float(np.median(steps)):
        raise ExperimentError(
            f"{where} is to be filtered and its samples come unevenly, at steps of {steps.min():.4g} to {steps.max():.4g} s: expected "
            f"equal steps; set resample = {1.0 / float(np.median(steps)):.4g} (Hz) in place of lowpass or decimate"
        )


def _check_lowpass(frequency: float, high: float, low: float, where: str) -> None:
    """A cut-off lies below half the sampling rate, and above one over the duration, below which a record holds nothing but its mean."""
    if frequency >= high:
        raise ExperimentError(f"lowpass of {where} is {frequency:g} Hz: expected less than half its sampling rate, {high:.6g} Hz; lower it")
    if frequency <= low:
        raise ExperimentError(f"lowpass of {where} is {frequency:g} Hz: expected more than one over its duration, {low:.6g} Hz; raise it")


def _filtered(sos: Any, time: Samples, values: Samples) -> Samples:
    """A channel filtered forwards and backwards; stretches without samples are bridged for it."""
    return np.asarray(sosfiltfilt(sos, _bridged(time, values)))


def _bridged(time: Samples, values: Samples) -> Samples:
    """A channel with straight lines where samples are missing."""
    usable = np.isfinite(values)
    return values if usable.all() else np.interp(time, time[usable], values[usable])


def _widened(lost: Bool[np.ndarray, " _"], reach: int) -> Bool[np.ndarray, " _"]:
    """Missing samples, with those beside them that a filter fills from the straight line across: so many on either side."""
    return np.asarray(binary_dilation(lost, iterations=reach)) if reach and lost.any() else lost


def _ratio(wanted: float, time: Samples, where: str) -> Fraction:
    """The wanted sampling rate, Hz, over that of the record."""
    rate = (time.size - 1) / float(time[-1] - time[0])
    ratio = Fraction(wanted / rate).limit_denominator(FINEST_RATIO)
    if not 0 < ratio.numerator <= FINEST_RATIO:
        raise ExperimentError(
            f"resample of {where} is {wanted:g} Hz, and it comes at {rate:.6g} Hz: expected a rate nearer to that; correct it"
        )
    return ratio


def _resampled(
    time: Samples, channels: dict[str, Samples], lost: dict[str, Any], ratio: Fraction
) -> tuple[Samples, dict[str, Samples], dict[str, Any], Samples]:
    """Channels at another rate, low-passed at half of the lower one; uneven samples are first put onto even ones by cubic splines.

    The last value is what passes of the power at frequencies from 0 to half the record's own rate.
    """
    rate, (up, down) = (time.size - 1) / float(time[-1] - time[0]), ratio.as_integer_ratio()
    even = time[0] + np.arange(time.size) / rate
    onto = {name: np.asarray(CubicSpline(time, _bridged(time, values))(even)) for name, values in channels.items()}
    if ratio == 1:
        return even, onto, lost, np.ones(BINS)
    slower = max(up, down)
    window: Any = firwin(TAPS * slower + 1, 1.0 / slower, window=("kaiser", KAISER))  # type: ignore[arg-type]
    onto = {name: np.asarray(resample_poly(values, up, down, window=window, padtype="line")) for name, values in onto.items()}
    stamps = time[0] + np.arange(next(iter(onto.values())).size) / (rate * float(ratio))
    nearest = np.clip(np.rint((stamps - time[0]) * rate).astype(int), 0, time.size - 1)
    lost = {name: _widened(values, -(-slower // up)) for name, values in lost.items()}
    passed = np.asarray(freqz(window, worN=np.arange(BINS) * np.pi / (BINS * up))[1])  # type: ignore[arg-type]
    return stamps, onto, {name: values[nearest] for name, values in lost.items()}, np.abs(passed) ** 2


def _without_trend(time: Samples, values: Samples, *, degree: int) -> Samples:
    """A channel without its mean or straight line."""
    usable = np.isfinite(values)
    return values - np.polyval(np.polyfit(time[usable] - time[0], values[usable], degree), time - time[0])


def _notices(asked: Preparation, lost: dict[str, Any], filtered: bool) -> tuple[str, ...]:
    """What was done, in one sentence; and what filters do to missing samples."""
    said = [f"Prepared as declared: {asked.words}."]
    holes = [name for name, values in lost.items() if values.any()]
    if filtered and holes:
        said.append(f"Missing samples of {', '.join(holes)} were bridged by straight lines for the filter, and are left out.")
    return tuple(said)
