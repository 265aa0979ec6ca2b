"""Time stamps: those of a file, checked, or those that a record declares."""

import numpy as np
from jaxtyping import Float64

from identification.experiment.errors import ExperimentError
from identification.experiment.readers.limits import check_samples

MIN_SAMPLES = 16
IRREGULAR_SPREAD = 0.01
COARSEST_ROUNDING = 1e-5
"""Of a sampling step: time stamps of double precision, counted from a far origin such as 1970, are rounded to more than that."""


def drop_bad_time(
    time: Float64[np.ndarray, " samples"], channels: dict[str, Float64[np.ndarray, " samples"]]
) -> tuple[Float64[np.ndarray, " kept"], dict[str, Float64[np.ndarray, " kept"]], tuple[str, ...]]:
    """Leave out samples without a time stamp, or with that of the sample before.

    Args:
        time: as recorded, shape (samples,).
        channels: beside it, shape (samples,) each.

    Returns:
        What is left, and a notice on what is not. Time that runs backwards is left as it is.
    """
    lost = ~np.isfinite(time)
    sound = np.flatnonzero(~lost)
    repeated = sound[1:][np.diff(time[sound]) == 0.0]
    kept = np.setdiff1d(sound, repeated, assume_unique=True)
    if kept.size == time.size:
        return time, channels, ()
    notice = (
        f"As drop_bad_time asks, {time.size - kept.size} of {time.size} samples are left out: {int(lost.sum())} without a time stamp, "
        f"{repeated.size} with that of the sample before."
    )
    return time[kept], {name: values[kept] for name, values in channels.items()}, (notice,)


def check_time(time: Float64[np.ndarray, " samples"], where: str) -> tuple[str, ...]:
    """Check the time stamps of a record.

    Args:
        time: s, shape (samples,).
        where: the record, for messages.

    Returns:
        A notice if the spread of the sampling step, largest minus smallest, exceeds 1 % of its median; else nothing.

    Raises:
        ExperimentError: no or too few samples, a time that is not finite, that does not grow, or that is too far from 0 to be exact.
    """
    if time.size < MIN_SAMPLES:
        count = f"only {time.size} samples" if time.size else "no samples, it is empty"
        raise ExperimentError(f"{where} has {count}: expected at least {MIN_SAMPLES}; record longer or remove the record")
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise ExperimentError(
            f"time of {where} is not finite at sample {bad[0] + 1}: expected a number in every row; correct it there, or leave such "
            "samples out with drop_bad_time = true in the record"
        )
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        i = int(back[0])
        raise ExperimentError(
            f"time of {where} does not grow at sample {i + 2} ({time[i]:.9g} s is followed by {time[i + 1]:.9g} s): "
            "expected strictly increasing time stamps; "
            + ("leave repeated ones out with drop_bad_time = true in the record" if steps[i] == 0.0 else "sort them")
        )
    rounding = float(np.spacing(np.abs(time).max()) / np.median(steps))
    if rounding > COARSEST_ROUNDING:
        raise ExperimentError(
            f"time of {where} begins at {time[0]:.9g} s, so far from 0 that its stamps are rounded to {rounding:.1g} of a sampling step: "
            "expected time since about the record's begin; subtract its first stamp"
        )
    smallest, median, largest = float(steps.min()), float(np.median(steps)), float(steps.max())
    if largest - smallest <= IRREGULAR_SPREAD * median:
        return ()
    at = time[int(np.argmax(steps))]
    return (f"The sampling is irregular: steps of {smallest:.4g} to {largest:.4g} s, median {median:.4g}; the longest follows {at:.6g} s.",)


def check_drive(frequency: float | None, time: Float64[np.ndarray, " samples"], where: str) -> None:
    """Check that the samples of a file can show its drive: pauses between them say nothing of that.

    Args:
        frequency: of the excitation, Hz; None without one.
        time: s, checked, shape (samples,).
        where: the record, for messages.

    Raises:
        ExperimentError: there are fewer than two samples in a period.
    """
    sampling = 1.0 / float(np.median(np.diff(time)))
    if frequency is not None and frequency > 0.5 * sampling * (1.0 + COARSEST_ROUNDING):
        raise ExperimentError(
            f"excitation_frequency of {where} is {frequency:g} Hz, and its samples come at {sampling:.4g} Hz: expected at most half of"
            f" that; check that it is in Hz{_in_ms(frequency, sampling)}"
        )


def _in_ms(frequency: float, sampling: float) -> str:
    """A hint where the drive would be well sampled if the time stamps were in ms."""
    return (
        ', or add time_unit = "ms" to the record if its time stamps are in ms'
        if frequency < 500.0 * sampling
        else ", and the unit of the time"
    )


def declared_time(duration: float | None, sampling_frequency: float | None, where: str) -> Float64[np.ndarray, " samples"]:
    """Make the time stamps of a record that has no file.

    Args:
        duration: s, above 0.
        sampling_frequency: Hz, above 0.
        where: the record, for messages.

    Returns:
        Stamps from 0 to `duration` inclusive, s, shape (samples,).

    Raises:
        ExperimentError: one of the two is missing, or they give fewer than two or too many samples.

    Example:
        >>> declared_time(0.5, 4.0, "record 'a.csv'")
        array([0.  , 0.25, 0.5 ])
    """
    if duration is None or sampling_frequency is None:
        raise ExperimentError(f"{where} has no file: expected its file, or duration and sampling_frequency; add them")
    steps = np.floor(duration * sampling_frequency * (1.0 + 1e-12) + 1e-9)
    if steps < 1.0:
        raise ExperimentError(f"duration of {where} is shorter than one sampling step: expected at least one; lengthen it")
    check_samples(int(min(steps, 1e18)) + 1, where)
    return np.arange(int(steps) + 1) / sampling_frequency
