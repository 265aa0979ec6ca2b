"""Whether gap and drive fit the record: a slip in either is told before anything is fitted."""

from collections.abc import Mapping

import numpy as np

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.record import Record
from identification.experiment.sensor import Sensor

AT_REST = ("drop-test", "free-decay")
"""Kinds in which the cart rests, unless its motion was measured."""
STRIKING = ("drop-test", "cart-excitation")
# So many times its own travel beyond the stop from first to last sample, no hammer has been in flight.
FAR = 10.0


def check_geometry(record: Record, sensors: Mapping[str, Sensor], *, has_stop: bool) -> None:
    """Compare the gap with the recorded motion, and the drive with kind and sampling.

    Args:
        record: with its channels.
        sensors: by channel; a displacement whose zero is not known tells nothing of the gap.
        has_stop: False where the nominal model knows no contact.

    Raises:
        ExperimentError: the hammer would be deep inside the stop all the time, the cart rests but has a frequency, or the samples
            are too far apart to show the drive.
    """
    frequency = record.excitation_frequency
    if frequency is not None and record.kind in AT_REST and record.base != "measured":
        raise ExperimentError(
            f"record {shown(record.file)} is {shown(record.kind)}, in which the cart rests, and has an excitation_frequency: expected "
            "none; remove it, or set kind = 'cart-excitation'"
        )
    sampling = (len(record.time) - 1) / float(record.time[-1] - record.time[0]) if len(record.time) > 1 else np.inf
    if frequency is not None and frequency > 0.5 * sampling:
        raise ExperimentError(
            f"excitation_frequency of record {shown(record.file)} is {frequency:g} Hz, and its samples come at {sampling:.4g} Hz: expected "
            "less than half of that; correct it, it is in Hz, or the unit of the time"
        )
    channels = _telling(record)
    if not has_stop or record.kind not in STRIKING or not channels or any(sensors[channel].zero is not None for channel in channels):
        return
    relative = record.channels[channels[0]] - sum(record.channels[channel] for channel in channels[1:])
    if not np.isfinite(relative).any():
        return
    lowest, travel = float(np.nanmin(relative)), float(np.nanmax(relative) - np.nanmin(relative))
    if lowest - record.gap > FAR * travel:
        raise ExperimentError(
            f"gap of record {shown(record.file)} is {record.gap:g} m, and its hammer stays between {lowest:.4g} m and "
            f"{lowest + travel:.4g} m: expected a gap, in m, that it is clear of at times; correct it, or the offset of the displacement"
        )


def _telling(record: Record) -> tuple[str, ...]:
    """Channel that tells where hammer and stop are, after it the one to take off it; empty where none does."""
    if "relative_displacement" in record.channels:
        return ("relative_displacement",)
    if "hammer_displacement" not in record.channels:
        return ()
    if "cart_displacement" in record.channels:
        return "hammer_displacement", "cart_displacement"
    return ("hammer_displacement",) if record.kind in AT_REST else ()
