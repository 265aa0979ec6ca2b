"""From one `[[record]]` table to a record."""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from identification.experiment.channels import CART_CHANNELS, CHANNELS, MOTION_CHANNELS, TIME
from identification.experiment.columns.assignment import assign, wanted_columns
from identification.experiment.columns.channel_unit import channel_factor, stated_unit, time_factor
from identification.experiment.columns.location import file_exists, record_path, sha256_of
from identification.experiment.columns.missing import mark_missing, mask_range
from identification.experiment.columns.preparation import prepared
from identification.experiment.columns.saturation import saturation_notices
from identification.experiment.columns.timebase import check_drive, check_time, declared_time, drop_bad_time
from identification.experiment.errors import ExperimentError, listed
from identification.experiment.readers import read_columns
from identification.experiment.record import Record, Sensed
from identification.experiment.sensor import Sensor
from identification.experiment.settings.record_settings import RecordSettings

ANSWERS = ("reaction_force", "impact_force", "hammer_acceleration")
"""What a hammer on a prescribed path is compared by: `hammer_acceleration` is then all force on it over its mass."""


def load_record(settings: RecordSettings, folder: Path, sensors: dict[str, Sensor], *, need_file: bool) -> Record:
    """Load one record; its noise is filled in later, when all records are there.

    Args:
        settings: the checked table.
        folder: the experiment's folder.
        sensors: of the experiment.
        need_file: False lets a record go without its file or its channels, if its time stamps are known.

    Returns:
        The record, without noise.

    Raises:
        ExperimentError: the file is missing, damaged or not as it should be, or lacks a channel that the record's kind needs.
    """
    path = record_path(folder, settings.file)
    wanted = wanted_columns(settings, sensors)
    if not file_exists(path, settings.file):
        return _without_file(settings, need_file)
    columns = read_columns(path, frozenset(wanted.values()), settings.file)
    raw = assign(columns, wanted, settings, need_channels=need_file)
    time, recorded, dropped = drop_bad_time(raw.time, raw.channels) if settings.drop_bad_time else (raw.time, raw.channels, ())
    stated, odd = stated_unit(TIME, settings.time_unit, wanted[TIME], columns.units)
    time = time * time_factor(settings, stated)
    notices = [*odd, *columns.notices, *raw.notices, *dropped, *check_time(time, settings.where)]
    _check_initial_state(settings, float(time[0]))
    channels = {}
    for channel, values in recorded.items():
        declared = settings.units.get(channel, sensors[channel].unit)
        stated, odd = stated_unit(CHANNELS[channel], declared, wanted[channel], columns.units)
        factor = channel_factor(channel, sensors[channel], settings, stated)
        notices.extend(odd)
        cleaned, found = _cleaned(values * (factor * sensors[channel].sign), time, channel, sensors[channel])
        notices.extend(found)
        if cleaned is not None:
            channels[channel] = cleaned
    sensed: dict[str, Sensed] = {}
    if settings.preparation.words and channels:
        time, channels, sensed, done = prepared(time, channels, settings.preparation, settings.where)
        notices.extend(done)
    if need_file:
        check_drive(settings.numbers["excitation_frequency"], time, settings.where)
    if need_file and not channels:
        raise ExperimentError(f"{settings.where} has no usable sample in any channel: expected some; record it again or remove it")
    _check_driving_channels(settings, set(channels))
    return Record(
        **_declared(settings),
        time=time,
        channels=channels,
        preparation=settings.preparation,
        sensed=sensed,
        sha256=sha256_of(path),
        notices=tuple(notices),
    )


def _check_initial_state(settings: RecordSettings, begin: float) -> None:
    """An initial state is that of the first sample, s, of the file."""
    crop = settings.preparation.crop
    for name in ("initial_displacement", "initial_velocity"):
        if crop is not None and crop[0] > begin and settings.numbers[name] is not None:
            raise ExperimentError(
                f"{name} in {settings.where} is given beside a crop that begins at {crop[0]:g} s, {crop[0] - begin:g} s after the file: "
                f"expected none, after the crop the stated initial state no longer holds; remove {name}, or begin the crop with the file"
            )


def _declared(settings: RecordSettings) -> dict[str, Any]:
    """What the experiment file alone says of a record."""
    return {
        "file": settings.file,
        "kind": settings.kind,
        "gap": settings.gap,
        "base": settings.base,
        "held_back": settings.held_back,
        **settings.numbers,
    }


def _without_file(settings: RecordSettings, need_file: bool) -> Record:
    """Make a record from its declaration alone."""
    if need_file:
        raise ExperimentError(f"the file of {settings.where} is missing: expected it in the experiment's folder; put it there")
    _check_driving_channels(settings, set())
    time = declared_time(settings.numbers["duration"], settings.numbers["sampling_frequency"], settings.where)
    return Record(
        **_declared(settings),
        time=time,
        notices=("There is no file: the time stamps are those declared.",),
    )


def _cleaned(
    scaled: Float64[np.ndarray, " samples"], time: Float64[np.ndarray, " samples"], channel: str, sensor: Sensor
) -> tuple[Float64[np.ndarray, " samples"] | None, tuple[str, ...]]:
    """Mark what is not usable in a channel, SI; None where nothing is."""
    marked, lost = mark_missing(scaled, time, channel)
    masked, beyond = mask_range(marked, time, channel, sensor)
    if not np.isfinite(masked).any():
        return None, (*beyond, f"{channel}: no sample is usable; the channel counts as not recorded.")
    return masked, (*lost, *beyond, *saturation_notices(masked, channel))


def _check_driving_channels(settings: RecordSettings, channels: set[str]) -> None:
    """A record whose motion is driven by a recorded channel must hold that channel."""
    if settings.kind == "forced" and "applied_force" not in channels:
        raise ExperimentError(f"{settings.where} is 'forced' and has no applied_force: expected that channel; add column and sensor")
    if settings.kind == "prescribed":
        _check_prescribed(settings, channels)
    if settings.base == "measured" and not channels & set(CART_CHANNELS):
        raise ExperimentError(
            f"{settings.where} has base = 'measured' and no recorded cart motion: expected cart_displacement or cart_acceleration; "
            "add its column and its sensor"
        )


def _check_prescribed(settings: RecordSettings, channels: set[str]) -> None:
    """A prescribed motion must be recorded, and beside it something that the model can be compared with."""
    if not channels & set(MOTION_CHANNELS):
        raise ExperimentError(
            f"{settings.where} is 'prescribed' and its motion is not recorded: expected {MOTION_CHANNELS[0]} or {MOTION_CHANNELS[1]}; "
            "add its column and its sensor"
        )
    if not channels & set(ANSWERS):
        raise ExperimentError(
            f"{settings.where} is 'prescribed' and no force is recorded: expected one of {listed(ANSWERS)}; add its column and its sensor"
        )
