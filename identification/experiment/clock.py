"""The clock of a record: where its stamps count from, whether they show even samples, and the stretches of a clock that steps back.

Stamps are printed with too few digits, come in blocks, count from 1970, or jitter where a program and not the converter took them.
`clocked` makes of them the time of each sample, as far as the stamps alone say it; what needs the operator's word is a `ClockSettings`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial import ConvexHull

from identification.experiment.errors import ExperimentError
from identification.experiment.limits import check_samples

MIN_SAMPLES = 16
IRREGULAR_SPREAD = 0.01
COARSEST_ROUNDING = 1e-5
"""Of a sampling step: time stamps of double precision, counted from a far origin such as 1970, are rounded to more than that."""
LONG = 1.5
"""Of the median step: one that is longer is a pause."""
Stamps = Float64[np.ndarray, " samples"]
Kept = Float64[np.ndarray, " kept"]
"""Of the samples, those that are used."""


@dataclass(frozen=True, kw_only=True)
class ClockSettings:
    """What a record declares of its time stamps.

    Attributes:
        unit: of the stamps, or None.
        drop_bad: whether samples without a stamp, or with that of the sample before, are to be left out.
        rebuild: whether the samples came evenly, so that even time takes the place of the stamps.
        stretch: which stretch of a clock that steps back is the record, from 1; None where it does not step back.
    """

    unit: str | None = None
    drop_bad: bool = False
    rebuild: bool = False
    stretch: int | None = None


def timed(
    time: Stamps, channels: Mapping[str, Stamps], settings: ClockSettings, rate: float | None, where: str
) -> tuple[Kept, dict[str, Kept], tuple[str, ...]]:
    """Time, s, and channels by what a record declares of its stamps and its sampling rate, Hz, if it does; and notices on what was done."""
    kept, said = dict(channels), []
    if settings.stretch is not None:
        parts, number = stretches(time), settings.stretch
        if number > len(parts) or len(parts) == 1:
            has = "never steps back" if len(parts) == 1 else f"has {len(parts)} stretches"
            raise ExperimentError(f"stretch of {where} is {number} and its clock {has}: expected one of them; correct or remove it")
        part = parts[number - 1]
        said.append(
            f"The clock steps back and parts {len(parts)} stretches; used is stretch {number}, sample {part.start + 1} "
            f"({time[part.start]:.6g} s) to {part.stop} ({time[part.stop - 1]:.6g} s)."
        )
        time, kept = time[part], {name: values[part] for name, values in kept.items()}
    if settings.rebuild:
        time, notice = rebuilt(time, rate, where)
        said.append(notice)
    else:
        time, notices = clocked(time, kept.values())
        said.extend(notices)
    if settings.drop_bad:
        time, kept, notices = drop_bad_time(time, kept)
        said.extend(notices)
    return time, kept, tuple(said)


def clocked(time: Stamps, channels: Iterable[Float64[np.ndarray, " _"]]) -> tuple[Stamps, tuple[str, ...]]:
    """Time stamps as exact as they show by themselves, and notices on what was done.

    Stamps that lie so far from 0 that double precision rounds them count from the first. Those that lack digits become even ones where a
    straight line over the number of the sample explains all of them within the last digit (`even_time`, which looks at the channels too).

    Example:
        >>> clocked(1.7e9 + np.arange(32) / 512, [])[1]
        ('The time stamps lie far from 0: they count from the first one, 1700000000 s.',)
    """
    sound, said = time[np.isfinite(time)], []
    digit = float(np.spacing(np.abs(sound).max(initial=0.0)))
    step = abs(float(sound[-1] - sound[0])) / (sound.size - 1) if sound.size > 1 else 0.0
    if step > 0.0 and digit > COARSEST_ROUNDING * step:
        said.append(f"The time stamps lie far from 0: they count from the first one, {sound[0]:.15g} s.")
        time = time - sound[0]
    else:
        digit = 0.0
    even, shared = even_time(time, channels, digit)
    if shared:
        rate = (even.size - 1) / float(even[-1] - even[0])
        said.append(
            f"The time stamps lack digits: {shared}. They are taken to come evenly, at {rate:.6g} Hz; the stamps scatter about that by "
            f"{np.std(time - even):.2g} s (standard deviation)."
        )
    return even, tuple(said)


def even_time(time: Stamps, channels: Iterable[Float64[np.ndarray, " _"]], digit: float = 0.0) -> tuple[Stamps, str]:
    """Even time stamps in place of those that were printed or stored with too few digits; others as they are.

    The last digit is the smallest step where several samples share a stamp, else the difference of the only two steps, a power of ten,
    else the given one, to which double precision rounds. Stamps are those of even samples, rounded or cut off, where a straight line over
    the number of the sample leaves a spread of one last digit or less; the line of least spread runs along an edge of the convex hull of
    the stamps. Where all channels repeat their values with the stamps, the samples are repeated ones.

    Returns:
        The stamps, and what shows that they lack digits; empty where they are as they were.

    Example:
        >>> even, why = even_time(np.array([0.0, 0.0, 0.001, 0.001, 0.002, 0.002]), [np.arange(6.0)])
        >>> even.round(9).tolist(), why
        ([0.0, 0.0005, 0.001, 0.0015, 0.002, 0.0025], '2 samples share each')
    """
    steps = np.diff(time)
    if steps.size < 2 or not np.isfinite(time).all() or not (steps >= 0.0).all() or not steps.any():
        return time, ""
    shares = bool((steps == 0.0).any())
    if shares and all_repeat(steps, channels):
        return time, ""
    unit = float(steps[steps > 0.0].min()) if shares else _last_digit(steps) or digit
    if unit == 0.0:
        return time, ""
    stamps = np.stack([np.arange(time.size), np.rint((time - time[0]) / unit)], axis=1)
    if np.ptp(np.diff(stamps[:, 1])) == 0.0:
        return time, ""
    corners = stamps[ConvexHull(stamps).vertices]
    across, up = (corners - np.roll(corners, 1, axis=0)).T
    slopes = up[across != 0.0] / across[across != 0.0]
    spreads = np.ptp(corners[:, 1] - slopes[:, None] * corners[:, 0], axis=1)
    slope, spread = float(slopes[np.argmin(spreads)]), float(spreads.min())
    if max(spread, 2.0 * slope if shares else 0.0) > 1.0 + COARSEST_ROUNDING:
        return time, ""
    why = f"{1.0 / slope:.4g} samples share each" if shares else f"their last digit is {1.0 / slope:.2g} of a sampling step"
    return time[0] + unit * slope * stamps[:, 0], why


def _last_digit(steps: Float64[np.ndarray, " steps"]) -> float:
    """The power of ten by which the only two sizes of step differ, where both are multiples of it; else 0."""
    low, high = float(steps.min()), float(steps.max())
    if high - low <= IRREGULAR_SPREAD * low:
        return 0.0
    digit, near = float(10.0 ** np.rint(np.log10(high - low))), COARSEST_ROUNDING * high
    two = bool(np.all((steps < low + near) | (steps > high - near))) and abs(high - low - digit) < near
    digits = low / digit  # in the shorter step; of one digit, the longer may be a lost sample
    return digit if two and digits > 1.5 and abs(digits - np.rint(digits)) < IRREGULAR_SPREAD else 0.0


def all_repeat(steps: Float64[np.ndarray, " steps"], channels: Iterable[Float64[np.ndarray, " _"]]) -> bool:
    """Whether all channels keep their values wherever a stamp is repeated: those samples are copies."""
    same = steps == 0.0
    return all(np.array_equal(np.diff(values)[same], 0.0 * steps[same]) for values in channels if values.size == steps.size + 1)


def rebuilt(time: Stamps, rate: float | None, where: str) -> tuple[Stamps, str]:
    """Even time in place of stamps that jitter or come in blocks, and a notice with the jitter.

    The step is that of the declared `rate`, Hz, else the slope of the least-squares line of the stamps, each where it stands first, over
    the number of the sample; the beginning is such that the stamps scatter about the even time with mean zero.

    Raises:
        ExperimentError: fewer stamps than a record needs; the stamps do not grow; they show another rate than the declared one; or they
            show that samples were lost between two of them, so that the samples did not come evenly.

    Example:
        >>> rebuilt(np.repeat(np.arange(4) * 0.25, 8), 32.0, "record 'a.csv'")[1][:64]
        'Time was rebuilt evenly, at 32 Hz: the stamps scatter about it b'
    """
    number, sound = np.arange(time.size), np.isfinite(time)
    if sound.sum() < MIN_SAMPLES:
        raise ExperimentError(
            f"{where} has {sound.sum()} time stamps: expected at least {MIN_SAMPLES} to rebuild its time; export it again"
        )
    steps = np.diff(time[sound])
    back, new = np.flatnonzero(steps < 0.0), np.flatnonzero(steps > 0.0) + 1
    seen = number[sound] if new.size < 2 else number[sound][new]  # of a block, the first sample alone: its stamps lie on a line
    slope = float(np.polyfit(seen, time[seen] - time[sound][0], 1)[0])
    if slope <= 0.0 or back.size:
        at = time[sound][back[0]] if back.size else time[sound][0]
        raise ExperimentError(
            f"rebuild_time of {where} is set and its clock steps back at {at:.6g} s: expected stamps that grow or repeat; choose one of "
            "the stretches with stretch = 1 or 2 in the record"
        )
    if rate is not None and abs(slope * rate - 1.0) > 0.01:  # clocks differ by less
        raise ExperimentError(
            f"sampling_frequency of {where} is {rate:.6g} Hz, and its time stamps come at {1.0 / slope:.6g} Hz: expected one rate; correct "
            "it, or remove it to rebuild the time at the rate of the stamps"
        )
    step = slope if rate is None else 1.0 / rate
    phase = time - step * number
    _check_none_lost(time[sound], phase[sound], step, where)
    even = np.nanmean(phase) + step * number
    scatter = (time - even)[sound]
    return even, (
        f"Time was rebuilt evenly, at {1.0 / step:.6g} Hz: the stamps scatter about it by {np.std(scatter):.2g} s (standard deviation), at "
        f"most {np.abs(scatter).max():.2g} s."
    )


def _check_none_lost(time: Stamps, phase: Stamps, step: float, where: str) -> None:
    """Refuse stamps that stay late, by half of it, after a pause longer than most: a late stamp is caught up with, a lost sample is not.

    How late is a step in a straight line through 64 stamps at either side, of blocks the first ones, by least squares.
    """
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(time)) + 1])
    time, phase = time[firsts], phase[firsts]
    pauses = np.diff(time)
    beyond = pauses - np.median(pauses) if pauses.size else pauses
    for at in np.flatnonzero(beyond > 0.5 * step):
        part = slice(max(0, at - 63), at + 65)
        later = np.arange(time.size)[part] > at
        if min(later.sum(), (~later).sum()) < MIN_SAMPLES:
            continue
        columns = np.column_stack([np.ones(later.size), firsts[part] - firsts[at], later])
        found, *_ = np.linalg.lstsq(columns, phase[part])
        spread = np.std(phase[part] - columns @ found) * np.sqrt(np.linalg.inv(columns.T @ columns)[2, 2])
        late = float(found[2])
        if late > max(0.5 * beyond[at], 4.0 * spread):
            raise ExperimentError(
                f"rebuild_time of {where} is set and its stamps stay {late:.4g} s late after {time[at]:.6g} s: expected samples that came "
                "evenly, some seem to be lost there; cut the record with crop, use its stamps as they are, or, where the intervals only "
                f"jitter, give its sampling_frequency (about {1.0 / step:.4g} Hz) without a column of time, in 'columns' or called time"
            )


def drop_bad_time(time: Stamps, channels: dict[str, Stamps]) -> tuple[Kept, dict[str, Kept], tuple[str, ...]]:
    """Leave out samples without a time stamp, or with that of the sample before; a notice says how many.

    Time that runs backwards is left as it is.
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


def check_time(time: Stamps, where: str) -> tuple[str, ...]:
    """Refuse time stamps, s, that are too few, not finite, or that do not grow; `where` names the record.

    Given is a notice if the spread of the sampling step, largest minus smallest, exceeds 1 % of its median; else nothing.
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
        repeated = (
            "leave repeated ones out with drop_bad_time = true in the record, or, where the samples came evenly and only their stamps are "
            "bad, set rebuild_time = true there"
        )
        remedy = repeated if steps[i] == 0.0 else _of_backwards(time)
        raise ExperimentError(
            f"time of {where} does not grow at sample {i + 2} ({time[i]:.9g} s is followed by {time[i + 1]:.9g} s): "
            f"expected strictly increasing time stamps; {remedy}"
        )
    smallest, median, largest = float(steps.min()), float(np.median(steps)), float(steps.max())
    if largest - smallest <= IRREGULAR_SPREAD * median:
        return ()
    at = time[int(np.argmax(steps))]
    return (f"The sampling is irregular: steps of {smallest:.4g} to {largest:.4g} s, median {median:.4g}; the longest follows {at:.6g} s.",)


def stretches(time: Stamps) -> list[slice]:
    """The stretches between the instants at which a clock steps back; one where it never does.

    Example:
        >>> stretches(np.array([0.0, 1.0, 2.0, 1.5, 2.5]))
        [slice(0, 3, None), slice(3, 5, None)]
    """
    edges = [0, *(np.flatnonzero(np.diff(time) < 0.0) + 1).tolist(), time.size]
    return [slice(begin, end) for begin, end in zip(edges[:-1], edges[1:], strict=True)]


def steps_back(time: Stamps) -> bool:
    """Whether the clock stepped back and went on from there, rather than that samples are out of order or single stamps wrong.

    Sorted, samples out of order come no closer than before, and those of two stretches that overlap do.
    """
    steps = np.diff(time)
    forward, back = steps[steps > 0.0], np.flatnonzero(steps[:-1] < 0.0)
    if back.size == 0 or forward.size == 0 or bool((steps[back + 1] > LONG * np.median(forward)).any()):
        return False
    return bool(np.diff(np.sort(time)).min() < (1.0 - IRREGULAR_SPREAD) * forward.min())


def _of_backwards(time: Stamps) -> str:
    """What to do about time that runs backwards: sort samples that are out of order, or choose a stretch of a clock that steps back."""
    if not steps_back(time):
        return "sort them"
    parts = stretches(time)
    back = float(np.median(np.diff(time)) - (time[parts[1].start] - time[parts[0].stop - 1]))
    said = [f"{n} ({time[one.start]:.6g} to {time[one.stop - 1]:.6g} s)" for n, one in enumerate(parts[:3], start=1)]
    more = f" or one of the {len(parts)}" if len(parts) > len(said) else ""
    return (
        f"split at {time[parts[0].stop - 1]:.9g} s, where the clock steps back by {back:.6g} s and parts {len(parts)} stretches: "
        f"choose one with stretch = {' or '.join(said)}{more} in the record, or export each as a file of its own"
    )


def check_drive_sampling(frequency: float | None, time: Stamps, where: str) -> None:
    """Refuse a drive, Hz, with fewer than two samples in a period; pauses between samples do not count."""
    sampling = 1.0 / float(np.median(np.diff(time)))
    if frequency is not None and frequency > 0.5 * sampling * (1.0 + COARSEST_ROUNDING):
        in_ms = frequency < 500.0 * sampling  # well sampled then
        hint = ', or add time_unit = "ms" to the record if its time stamps are in ms' if in_ms else ", and the unit of the time"
        raise ExperimentError(
            f"excitation_frequency of {where} is {frequency:g} Hz, and its samples come at {sampling:.4g} Hz: expected at most half of"
            f" that; check that it is in Hz{hint}"
        )


def declared_time(duration: float | None, sampling_frequency: float | None, where: str) -> Float64[np.ndarray, " samples"]:
    """Time stamps, s, of a record that has no file: from 0 to `duration`, s, inclusive, at `sampling_frequency`, Hz.

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
