"""Gaps and drives that a record shows to be slips, and those that it does not."""

import numpy as np
import pytest

from identification.experiment.errors import ExperimentError
from identification.experiment.geometry import check_geometry
from identification.experiment.record import Record
from identification.experiment.sensor import Sensor

TIME = np.arange(200) / 1000.0
SWING = 2e-3 * np.sin(60.0 * TIME)
SENSORS = {name: Sensor(unit="m") for name in ("hammer_displacement", "cart_displacement", "relative_displacement", "hammer_acceleration")}


def record(kind: str = "drop-test", gap: float = -1.0, **more) -> Record:
    """A hammer that swings by 4 mm, 1 m beyond the gap if nothing else is said."""
    return Record(file="one.csv", kind=kind, gap=gap, time=TIME, **({"channels": {"hammer_displacement": SWING}} | more))


@pytest.mark.parametrize(
    "channels",
    [
        {"hammer_displacement": SWING},
        {"relative_displacement": np.where(TIME > 0.1, np.nan, SWING)},
        {"hammer_displacement": SWING + 0.2 * TIME, "cart_displacement": 0.2 * TIME},
    ],
)
def test_a_hammer_inside_the_stop_all_the_time_is_refused(channels):
    with pytest.raises(ExperimentError, match=r"gap of record 'one\.csv' is -1 m"):
        check_geometry(record(channels=channels), SENSORS, has_stop=True)


@pytest.mark.parametrize(
    ("one", "sensors", "has_stop"),
    [
        (record(gap=-5e-3), SENSORS, True),
        (record(gap=1.0), SENSORS, True),
        (record(), SENSORS, False),
        (record(kind="free-decay"), SENSORS, True),
        (record(), SENSORS | {"hammer_displacement": Sensor(unit="m", zero=2.0)}, True),
        (record(kind="cart-excitation", excitation_frequency=5.0), SENSORS, True),
        (record(channels={"hammer_acceleration": SWING}), SENSORS, True),
        (record(channels={"hammer_displacement": np.full(200, np.nan)}), SENSORS, True),
        (record(channels={}), SENSORS, True),
    ],
    ids=["pressed", "out of reach", "no stop", "no contact", "unknown zero", "cart unseen", "no displacement", "no sample", "no channel"],
)
def test_what_a_record_does_not_show_is_believed(one, sensors, has_stop):
    check_geometry(one, sensors, has_stop=has_stop)


@pytest.mark.parametrize(("frequency", "refused"), [(499.0, False), (501.0, True)])
def test_a_drive_must_be_slower_than_half_the_sampling(frequency, refused):
    one = record(kind="cart-excitation", gap=0.0, excitation_frequency=frequency)
    if refused:
        with pytest.raises(ExperimentError, match=r"is 501 Hz, and its samples come at 1000 Hz"):
            check_geometry(one, SENSORS, has_stop=True)
    else:
        check_geometry(one, SENSORS, has_stop=True)


@pytest.mark.parametrize(
    ("kind", "base", "refused"), [("drop-test", "sine", True), ("free-decay", "sine", True), ("drop-test", "measured", False)]
)
def test_a_cart_at_rest_has_no_frequency(kind, base, refused):
    one = record(kind=kind, gap=0.0, base=base, excitation_frequency=5.0)
    if refused:
        with pytest.raises(ExperimentError, match="in which the cart rests"):
            check_geometry(one, SENSORS, has_stop=True)
    else:
        check_geometry(one, SENSORS, has_stop=True)
