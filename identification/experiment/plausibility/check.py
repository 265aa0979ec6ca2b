"""All checks of records against their description."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from identification.experiment.errors import DoubtError
from identification.experiment.plausibility.bodies import check_bodies
from identification.experiment.plausibility.directions import check_directions
from identification.experiment.plausibility.drive import check_drive_frequency
from identification.experiment.plausibility.impulses import felt_impacts, impacts_of
from identification.experiment.plausibility.momentum import check_momentum
from identification.experiment.plausibility.reach import check_gap, check_impacts
from identification.experiment.record import Record
from identification.experiment.sensor import Sensor
from identification.experiment.settings.scales import check_scales, disagreements

NO_STOP = "none"
"""Contact law of a rig without a stop."""


def check_plausible(
    records: Sequence[Record],
    units: Sequence[dict[str, str | None]],
    sensors: Mapping[str, Sensor],
    *,
    mass: float | None,
    law: str | None,
) -> tuple[str, ...]:
    """Refuse a description that the records contradict, and doubt one that they make unlikely.

    Args:
        records: with channels and noise.
        units: declared for the channels of each record.
        sensors: of the experiment.
        mass: of the hammer, kg; None where it is to be estimated.
        law: name of the contact law, or None for the nominal one.

    Returns:
        Sentences on what is odd and may be right.

    Raises:
        ExperimentError: what is wrong, in one line, with the value that would be right where the records show it.
    """
    offset = any(sensor.zero is not None for channel, sensor in sensors.items() if channel.endswith("displacement"))
    through = frozenset(channel for channel, sensor in sensors.items() if sensor.sensitivity is not None)
    doubts: list[str] = []
    for record, declared in zip(records, units, strict=True):
        with _doubted(doubts):  # one doubt a record: what follows from the first would only mislead
            check_drive_frequency(record)
            hammer = check_directions(record, impacts_of(record))
            check_bodies(record, felt_impacts(record))
            check_scales(record, declared, mass, through)
            check_momentum(record, hammer, mass, declared, through)
            if law != NO_STOP:
                check_impacts(record)
                check_gap(record, felt_impacts(record), offset=offset)
    return (*doubts, *disagreements(records, mass))


@contextmanager
def _doubted(found: list[str]) -> Iterator[None]:
    """Add what a check doubts to `found`."""
    try:
        yield
    except DoubtError as doubt:
        found.append(str(doubt))
