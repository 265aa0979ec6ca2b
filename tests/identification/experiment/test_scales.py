"""A unit mistaken for another, or a turned sign, is reported before anything is fitted; a calibration that is a little off is not."""

import re

import numpy as np
import pytest

from identification.experiment.checks import Declared, check_scales
from identification.experiment.experiment import Record

MASS, OMEGA = 0.5, 40.0
UNITS: dict[str, str | None] = {"hammer_displacement": "m", "hammer_acceleration": "m/s^2", "impact_force": "N"}


def bouncing(*, displacement: float = 1.0, acceleration: float = 1.0, force: float = 1.0) -> Record:
    """A driven oscillator between which and its stop a spring is pressed, with noise; every channel times a factor."""
    time = np.arange(8000) / 4000.0
    x, v, hammer, push = 0.0, 0.0, np.empty(8000), np.empty(8000)
    for step, t in enumerate(time):
        hammer[step], push[step] = x, max(2e4 * (x - 1e-3), 0.0)
        v += (3.0 * np.sin(35.0 * t) - OMEGA**2 * x - push[step] / MASS) / 4000.0
        x += v / 4000.0
    rng = np.random.default_rng(3)
    felt = 3.0 * np.sin(35.0 * time) - OMEGA**2 * hammer - push / MASS + 0.3 + rng.normal(0.0, 0.05, time.size)
    seen = hammer + rng.normal(0.0, 1e-5, time.size)
    channels = {"hammer_displacement": seen * displacement, "hammer_acceleration": felt * acceleration, "impact_force": push * force}
    return Record(file="cart1.csv", kind="cart-excitation", gap=0.001, time=time, channels=channels)


def message_of(record: Record, mass: float | None = MASS, through: frozenset[str] = frozenset(), **units: str | None) -> str:
    """What is found wrong; empty where nothing is."""
    found = next(check_scales(record, Declared(units=UNITS | units, mass=mass, through=through)), None)
    assert found is None or found.refuses
    return "" if found is None else found.sentence


@pytest.mark.parametrize("off", [1e3, 1e-3, 9.80665])
@pytest.mark.parametrize("through", [{"hammer_acceleration"}, {"hammer_displacement", "hammer_acceleration"}])
def test_a_slip_in_a_sensitivity_blames_it_and_not_its_partner_alone(off, through):
    said = message_of(bouncing(acceleration=off), through=frozenset(through), **dict.fromkeys(through))
    assert "a factor between units: expected one motion; correct " in said
    assert all(f"sensitivity or unit in [sensors.{name}]" in said for name in through)
    assert message_of(bouncing(acceleration=1.3), through=frozenset(through), **dict.fromkeys(through)) == ""


@pytest.mark.parametrize("off", [1.0, 0.8, 1.3])
@pytest.mark.parametrize("channel", ["displacement", "acceleration", "force"])
def test_what_is_a_little_off_is_left_to_the_diagnosis(channel, off):
    assert message_of(bouncing(**{channel: off})) == ""


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({"displacement": 1e3}, "hammer_displacement is 1e+03 times what hammer_acceleration gives for it in record 'cart1.csv', .*in mm:"),
        ({"displacement": 1.0 / 0.0254}, "hammer_displacement is 39 times .*as if its numbers were in in:"),
        ({"acceleration": 1.0 / 9.80665}, r"hammer_acceleration is 0.1 times .* in g: .*correct 'unit' in \[sensors.hammer_acceleration\]"),
        ({"force": 1e-3}, "impact_force is 0.001 times .* in kN:"),
        ({"acceleration": -1.0}, "hammer_acceleration and hammer_displacement point opposite ways in record 'cart1.csv'"),
        ({"acceleration": -0.8}, "hammer_acceleration and hammer_displacement point opposite ways"),
        ({"displacement": -1e3}, "hammer_acceleration and hammer_displacement point opposite ways"),
        ({"force": -1.3}, "impact_force and hammer_acceleration point opposite ways"),
    ],
)
def test_a_mistaken_unit_or_sign_is_reported_with_its_channel(factors, message):
    assert re.search(message.replace("+", r"\+"), message_of(bouncing(**factors)))


def test_an_unknown_mass_leaves_the_force_unchecked():
    assert message_of(bouncing(force=1e-3))
    assert message_of(bouncing(force=1e-3), mass=None) == ""


@pytest.mark.parametrize(("mass", "message"), [(1e-6, "impact_force is .* times mass times deceleration"), (500.0, "or mass in .hammer")])
def test_a_mass_that_is_far_off_is_reported(mass, message):
    assert re.search(message, message_of(bouncing(), mass=mass))


@pytest.mark.parametrize("offset", [2.0, -2.0])
def test_a_load_cell_with_an_offset_alone_is_not_reported(offset):
    resting = bouncing()
    noise = np.random.default_rng(4).normal(0.0, 0.01, (2, resting.time.size))
    resting.channels["impact_force"][:] = offset + noise[0]
    resting.channels["hammer_acceleration"][:] = -0.3 + noise[1]
    assert message_of(resting) == ""


def test_gaps_in_the_record_or_channels_that_do_not_belong_together_are_not_compared():
    holed = bouncing(displacement=1e3)
    assert message_of(holed)
    holed.channels["hammer_displacement"][100] = np.nan
    assert message_of(holed) == ""
    strange = bouncing()
    strange.channels["hammer_displacement"][:] = np.random.default_rng(1).normal(0.0, 1.0, strange.time.size)
    assert message_of(strange) == ""


def test_the_unit_in_the_message_is_the_declared_one_and_never_a_stand_in():
    metres_as_mm = bouncing(displacement=1e-3)
    assert "as if its numbers were in m:" in message_of(metres_as_mm, hammer_displacement="mm")
    assert "as if its numbers were in m/s^2:" in message_of(bouncing(acceleration=9.80665), hammer_acceleration="g")
    assert message_of(metres_as_mm, hammer_displacement="V") == ""
    assert message_of(metres_as_mm, hammer_displacement="Volts") == ""
    assert message_of(metres_as_mm, hammer_displacement=None) == ""
