"""Whether records hold what any fit needs: a motion of the hammer, and a force where the mass is to be estimated."""

from collections.abc import Sequence

from identification.experiment.channels import CHANNELS, MOTION_CHANNELS
from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.record import Record

_MOTION = (*MOTION_CHANNELS, "hammer_acceleration")


def check_fittable(records: Sequence[Record], *, mass_is_known: bool) -> None:
    """Refuse what no fit could say anything of.

    Args:
        records: with their channels.
        mass_is_known: False where the mass is to be estimated.

    Raises:
        ExperimentError: a record does not show the hammer's motion, or no fitted one holds the force that identifies the mass.
    """
    for record in records:
        if not record.channels.keys() & set(_MOTION):
            raise ExperimentError(
                f"record {shown(record.file)} shows no motion of the hammer, only {listed(record.channels)}: expected one of "
                f"{listed(_MOTION)}; add its table [sensors.…] and name its column in 'columns' of the record"
            )
    forces = [channel for channel, dimension in CHANNELS.items() if dimension == "force"]
    held = {channel for record in records if not record.held_back for channel in record.channels}
    if not mass_is_known and not held & set(forces):
        raise ExperimentError(
            f"the mass is to be estimated, and no fitted record holds a force: expected one of {listed(forces)}, since motion alone "
            "identifies only ratios to the mass; weigh the hammer and remove 'estimate_mass'"
        )
