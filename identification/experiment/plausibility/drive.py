"""Whether the cart moves at the frequency that was set."""

import numpy as np

from identification.experiment.channels import CART_CHANNELS
from identification.experiment.errors import DoubtError, ExperimentError, shown
from identification.experiment.plausibility.sine import fit_sine, share_at
from identification.experiment.record import Record

MOSTLY_SINE = 0.5
"""Share of a channel's variance beyond which a sine explains most of it."""
MISTAKEN = {
    2.0 * np.pi: "as if it were in rad/s; excitation_frequency is in Hz",
    60.0: "as if it were in revolutions per minute; excitation_frequency is in Hz",
    1e3: 'as if its time stamps were in ms; add time_unit = "ms" to the record',
    1e6: 'as if its time stamps were in us; add time_unit = "us" to the record',
    1e-3: 'as if its time stamps were in s and not in ms; set time_unit = "s" in the record',
    1e-6: 'as if its time stamps were in s and not in us; set time_unit = "s" in the record',
}
"""What a set frequency may be that is so many times that of the cart."""


def check_drive_frequency(record: Record) -> None:
    """Compare the set frequency with the sine that the cart's own motion is.

    They contradict each other where a sine explains most of the motion and one of the set frequency does not, and where they are further
    apart than twice the change of the frequency from the record's first half to its second.

    Args:
        record: with its channels.

    Raises:
        ExperimentError: the cart moves at another frequency, which the set one is in another unit.
        DoubtError: it moves at another one; the message gives it.
    """
    channel = next((name for name in CART_CHANNELS if name in record.channels), None)
    asked = record.excitation_frequency
    if record.kind != "cart-excitation" or record.base != "sine" or asked is None or channel is None:
        return
    time, values = record.time, record.channels[channel]
    middle = time.size // 2
    whole, first, second = (fit_sine(time[part], values[part]) for part in (slice(None), slice(middle), slice(middle, None)))
    if whole is None or first is None or second is None:
        return
    resolved, apart = 1.0 / float(time[-1] - time[0]), abs(whole.frequency - asked)
    explained = whole.share > MOSTLY_SINE and share_at(time, values, asked) < MOSTLY_SINE
    if not explained or apart <= 2.0 * abs(second.frequency - first.frequency):
        return
    hint = next((words for ratio, words in MISTAKEN.items() if abs(asked / ratio - whole.frequency) < resolved), "")
    seen = f"{whole.rounded:.6g} Hz"
    given = (
        f"{channel} of record {shown(record.file)} is a sine of {seen}, and excitation_frequency is {asked:g} Hz: expected one frequency"
    )
    if hint:
        raise ExperimentError(f"{given}; it is {asked / whole.frequency:.4g} times that of the cart, {hint}")
    raise DoubtError(f"{given}; set excitation_frequency = {whole.rounded:.6g}")
