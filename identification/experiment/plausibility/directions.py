"""Whether channels point the right way."""

from identification.experiment.channels import MOTION_CHANNELS
from identification.experiment.errors import DoubtError, ExperimentError, shown
from identification.experiment.plausibility.impulses import FEWEST_IMPACTS, Impact, Response, response
from identification.experiment.record import Record


def check_directions(record: Record, impacts: list[Impact]) -> Response | None:
    """Compare what the load cell feels with the way in which hammer and cart change their speed.

    The stop pushes the hammer back: the force is positive, and the hammer's displacement, which grows towards the stop, loses speed. The
    cart gets what the hammer loses, or nothing.

    Args:
        record: with its channels.
        impacts: that its load cell shows.

    Returns:
        How the hammer answers to the impacts; None where that is not recorded.

    Raises:
        ExperimentError: the load cell points the other way; the message says what to write.
        DoubtError: another channel does, or hammer and cart are exchanged. A channel that is late or early shows the same.
    """
    if not impacts:
        return None
    backwards = sum(impact.impulse for impact in impacts if impact.impulse < 0.0)
    forwards = sum(impact.impulse for impact in impacts if impact.impulse > 0.0)
    if len(impacts) >= FEWEST_IMPACTS and -backwards > forwards:
        raise ExperimentError(
            f"impact_force of record {shown(record.file)} falls in {len(impacts)} impacts: expected a force that is positive in "
            "compression; set sign = -1 in [sensors.impact_force]"
        )
    channel = next((name for name in MOTION_CHANNELS if name in record.channels), None)
    hammer = None if channel is None else response(record, channel, impacts)
    if hammer is None or channel is None:
        return None
    cart = response(record, "cart_displacement", impacts) if "cart_displacement" in record.channels else None
    if cart is not None and cart.sign < 0 and channel == "hammer_displacement" and cart.slope < hammer.slope:
        raise DoubtError(
            f"cart_displacement of record {shown(record.file)} loses speed in its {cart.impacts} impacts, and hammer_displacement does "
            "not: expected that the stop pushes the hammer back; exchange the two in 'columns' of the record, unless a channel is late or "
            "early"
        )
    if hammer.sign > 0:
        raise DoubtError(
            f"{channel} of record {shown(record.file)} gains speed in its {hammer.impacts} impacts: expected that it grows towards the "
            f"stop, which pushes the hammer back; set sign = -1 in [sensors.{channel}], unless a channel is late or early"
        )
    return hammer
