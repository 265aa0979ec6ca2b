"""Plausible mistakes in the embedded example: each stated in one line when it is loaded, with the value that would be right."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.experiment import ExperimentError, Record, load_experiment
from identification.experiment.checks import Declared, check_bodies, check_directions, check_records
from identification.experiment.signals import pulls
from vibrojax.data_files import data_path

COLUMNS = ("time", "hammer_displacement", "cart_displacement", "impact_force", "hammer_acceleration")
RECORDS = ("drop", "cart1", "cart2", "cart3")
EXPERIMENT = (data_path("example") / "experiment.toml").read_text(encoding="utf-8")
Change = Callable[[dict[str, np.ndarray]], None]


@pytest.fixture(scope="session")
def tables() -> dict[str, dict[str, np.ndarray]]:
    """The first second of every record."""
    found = {}
    for name in RECORDS:
        table = np.genfromtxt(data_path("example") / f"{name}.csv.gz", delimiter=",", names=True)
        found[name] = {column: table[column][:4000] for column in COLUMNS}
    return found


def written(folder: Path, tables, text: str, change: Change = lambda columns: None, *, leave_out: tuple[str, ...] = ()) -> Path:
    """An experiment folder with every record changed, and channels left out."""
    for name, table in tables.items():
        columns = {column: values.copy() for column, values in table.items() if column not in leave_out}
        change(columns)
        np.savez(folder / f"{name}.npz", **columns)
    for channel in leave_out:
        text = re.sub(rf"\[sensors\.{channel}\]\n(?:[^\[\n].*\n|\n)*", "", text)
    (folder / "experiment.toml").write_text(text.replace(".csv.gz", ".npz"), encoding="utf-8")
    return folder


def times(channel: str, factor: float) -> Change:
    """A channel multiplied."""
    return lambda columns: columns.update({channel: factor * columns[channel]})


def exchanged(columns: dict[str, np.ndarray]) -> None:
    """Hammer and cart exchanged."""
    columns.update(hammer_displacement=columns["cart_displacement"], cart_displacement=columns["hammer_displacement"])


def without_impacts(columns: dict[str, np.ndarray]) -> None:
    """A load cell whose cable is off."""
    columns["impact_force"] = np.random.default_rng(1).normal(0.0, 0.15, columns["time"].size)


def nothing(columns: dict[str, np.ndarray]) -> None:
    """The mistake is in the experiment file."""


ACC, CELL = ("hammer_acceleration",), ("impact_force",)
ONLY_CARTS = EXPERIMENT.replace('file = "drop.csv.gz"\nkind = "drop-test"\ngap = 0.0\n\n[[record]]\n', "")
FIRST_CART = ONLY_CARTS[: ONLY_CARTS.index('[[record]]\nfile = "cart2')]
ONLY_DROP = EXPERIMENT[: EXPERIMENT.index('[[record]]\nfile = "cart1')]


def said(old: str, new: str) -> str:
    """The experiment file with one passage replaced."""
    assert old in EXPERIMENT
    return EXPERIMENT.replace(old, new)


DRIVE = 'kind = "cart-excitation"\ngap = 0.0005\nexcitation_frequency = 6.5 # Hz, as set; the cart\'s amplitude and phase are estimated\n'
AS_DROP_TEST = said(DRIVE, 'kind = "drop-test"\ngap = 0.0005\n')


MISTAKES: dict[str, tuple[str, Change, tuple[str, ...], str]] = {
    "frequency": (
        said("= 6.5 #", "= 7.5 #"),
        nothing,
        (),
        r"cart_displacement of record 'cart1.npz' is a sine of 6.5 Hz.*set excitation_f.* = 6.5$",
    ),
    "frequency in rad/s": (
        said("= 6.5 #", "= 40.84 #"),
        nothing,
        (),
        r"is 40.84 Hz: .*it is 6.283 times that of the cart, as if it were in rad/s",
    ),
    "frequency in rpm": (said("= 6.5 #", "= 390 #"), nothing, (), r"is 390 Hz: .*it is 60 times .*as if it were in revolutions per minute"),
    "time in ms": (EXPERIMENT, times("time", 1e3), (), r"is 6.5 Hz, and its samples come at 4 Hz: .*add time_unit = \"ms\" to the record"),
    "time in s, read as ms": (EXPERIMENT, times("time", 1e-3), (), r"is a sine of 6500 Hz.* set time_unit = \"s\" in the record"),
    "time of a drop test in ms": (ONLY_DROP, times("time", 1e3), ACC, r"is 1.1e-06 times the impulse .*as it is if time were in ms; "),
    "channels exchanged": (
        EXPERIMENT,
        exchanged,
        CELL + ACC,
        r"in record 'drop.npz' cart_displacement moves more .*exchange the two in 'columns'",
    ),
    "kind of a driven cart": (
        AS_DROP_TEST,
        nothing,
        (),
        r"in record 'cart1.npz' cart_displacement is a sine of 6.5 Hz: .*set kind = \"cart-excitation\" and excitation_frequency = 6.5$",
    ),
    "channels exchanged, load cell": (
        ONLY_CARTS,
        exchanged,
        ACC,
        r"'cart1.npz' loses speed in its 9 impacts, .*exchange the two in 'columns'",
    ),
    "channels exchanged, accelerometer": (
        FIRST_CART,
        exchanged,
        CELL,
        r"is that of cart_displacement and not of hammer_disp.*exchange the two",
    ),
    "gap in mm": (
        said("gap = 0.001", "gap = 1.0"),
        nothing,
        (),
        r"gap of record 'cart2.npz' is 1 m, .*at 0.000991 m: .*1 mm would be gap = 0.001$",
    ),
    "gap in mm, accelerometer": (
        said("gap = 0.001", "gap = 1.0"),
        nothing,
        CELL,
        r"gap of record 'cart2.npz' is 1 m, .*stands at 0.00112 m",
    ),
    "gap of a drop test in mm": (
        said("gap = 0.0\n", "gap = 5.0\n"),
        nothing,
        CELL + ACC,
        r"'drop.npz' is 5 m, and its hammer comes no further than",
    ),
    "sign of the hammer": (
        EXPERIMENT,
        times("hammer_displacement", -1.0),
        ACC,
        r"gains speed in its 9 .*set sign = -1 in \[sensors.hammer_displacement\]",
    ),
    "sign of the cart": (
        EXPERIMENT,
        times("cart_displacement", -1.0),
        ACC,
        r"points away from the stop.*set sign = -1 in \[sensors.cart_disp",
    ),
    "sign of the load cell": (
        EXPERIMENT,
        times("impact_force", -1.0),
        (),
        r"impact_force .* falls in 9 .*set sign = -1 in \[sensors.impact_force\]",
    ),
    "sign of the accelerometer": (
        EXPERIMENT,
        times("hammer_acceleration", -1.0),
        (),
        r"opposite ways.*set sign = -1 in \[sensors.hammer_accel",
    ),
    "no impact": (
        EXPERIMENT,
        without_impacts,
        (),
        r"'drop.npz' is a drop-test, and impact_force shows no impact .*set kind = \"free-decay\"",
    ),
    "displacement in mm": (
        said('unit = "mm"', 'unit = "m"'),
        nothing,
        ACC,
        r"is 1.1e\+03 times the impulse .*if hammer_displacement were in mm or",
    ),
    "mass in g": (
        said("mass = 0.431", "mass = 431"),
        nothing,
        ACC,
        r"is 1.1e\+03 times the impulse .*or mass were in g; correct 'mass', which is in kg",
    ),
}
"""Experiment file, change of the records, channels that the rig lacks, and what must be said."""


DOUBTED = {
    "frequency",
    "kind of a driven cart",
    "channels exchanged",
    "channels exchanged, load cell",
    "channels exchanged, accelerometer",
    "sign of the hammer",
    "sign of the cart",
    "no impact",
}
"""Mistakes that records make likely and do not prove: warnings."""


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_stated_with_what_would_be_right(name, tables, tmp_path):
    text, change, leave_out, message = MISTAKES[name]
    folder = written(tmp_path, tables, text, change, leave_out=leave_out)
    if name in DOUBTED:
        found = load_experiment(folder).warnings
        assert any(re.search(message, warning) for warning in found), found
    else:
        with pytest.raises(ExperimentError, match=message) as caught:
            load_experiment(folder)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["sign of the load cell", "gap in mm", "no impact", "channels exchanged, load cell", "mass in g"])
def test_the_sample_at_which_a_mistake_shows_is_named(name, tables, tmp_path):
    text, change, leave_out, _ = MISTAKES[name]
    folder = written(tmp_path, tables, text, change, leave_out=leave_out)
    try:
        (said, *_) = load_experiment(folder).warnings
    except ExperimentError as error:
        said = str(error)
    record, sample, seconds = re.search(r"'(\w+).npz'.* at sample (\d+), ([\d.]+) s", said).groups()
    assert float(seconds) == pytest.approx(tables[record]["time"][int(sample) - 1], rel=1e-5)


def test_a_preload_that_impacts_relieve_is_no_turned_load_cell():
    """Its force falls from 8 N to none and never below."""
    time = np.arange(4000) / 4000.0
    force = np.where(np.arange(time.size) % 800 < 20, 0.0, 8.0) + np.random.default_rng(0).normal(0.0, 0.01, time.size)
    record = Record(file="a.csv", kind="forced", gap=0.0, time=time, channels={"impact_force": force}, noise={"impact_force": 0.01})
    assert list(check_directions(record, Declared())) == []
    turned = replace(record, channels={"impact_force": force - 8.0})
    assert [found.refuses for found in check_directions(turned, Declared())] == [True]


@pytest.mark.parametrize("leave_out", [(), ACC, CELL, ACC + CELL, ("cart_displacement",), ("hammer_displacement",)], ids=" ".join)
def test_nothing_is_said_of_a_sound_experiment(leave_out, tables, tmp_path):
    assert load_experiment(written(tmp_path, tables, EXPERIMENT, leave_out=leave_out)).warnings == ()


@pytest.mark.parametrize("cycles", [0.5, 1.0, 2.0, 3.0])
def test_a_drive_whose_frequency_changes_is_left_to_the_diagnosis(cycles):
    """The frequency begins as set and gains `cycles` in a record of ten seconds."""
    time = np.arange(10000) / 1000.0
    for seed in range(10):
        noise = np.random.default_rng(seed).normal(0.0, 1e-5, time.size)
        cart = 1e-3 * np.sin(2.0 * np.pi * (6.5 * time + cycles * (time / time[-1]) ** 2)) + noise
        channels = {"cart_displacement": cart}
        record = Record(file="a.csv", kind="cart-excitation", gap=0.0, time=time, channels=channels, excitation_frequency=6.5)
        assert check_records([record], [{"cart_displacement": "m"}], {}, mass=None, law="none") == (), seed


@pytest.mark.parametrize("late", [-0.007, -0.002, 0.002, 0.007])
def test_a_load_cell_that_is_late_or_early_is_one_cause_of_what_is_doubted(late, tables, tmp_path):
    def shifted(columns):
        columns["impact_force"] = np.interp(columns["time"] - late, columns["time"], columns["impact_force"])

    found = load_experiment(written(tmp_path, tables, EXPERIMENT, shifted, leave_out=ACC))
    assert len(found.records) == len(RECORDS)
    assert [warning for warning in found.warnings if "sign = -1" in warning and "late or early" not in warning] == []


@pytest.mark.parametrize("addition", [0.03, 0.3])
def test_harmonics_and_hum_of_a_drive_without_impacts_raise_no_doubt(addition):
    """A suspension filters harmonics, so that the hammer may be a purer sine than its cart."""
    time = np.arange(8000) / 1000.0
    rng = np.random.default_rng(0)
    hammer = 1e-3 * np.sin(2.0 * np.pi * 6.25 * time + 0.3) + rng.normal(0.0, 1e-5, time.size)
    cart = 1e-3 * (np.sin(2.0 * np.pi * 6.25 * time) + addition * np.sin(2.0 * np.pi * 12.5 * time)) + rng.normal(0.0, 1e-5, time.size)
    channels = {"hammer_displacement": hammer, "cart_displacement": cart}
    noise = dict.fromkeys(channels, 1e-5)
    record = Record(file="a.csv", kind="cart-excitation", gap=1.0, time=time, channels=channels, noise=noise, excitation_frequency=6.25)
    units = {name: "m" for name in channels}
    assert check_records([record], [units], {}, mass=0.4, law="none") == ()


@pytest.mark.parametrize("channel", ["hammer_displacement", "hammer_acceleration", "impact_force"])
def test_sign_turns_a_channel_round(channel, tables, tmp_path):
    turned = EXPERIMENT.replace(f"[sensors.{channel}]", f"[sensors.{channel}]\nsign = -1", 1)
    one = load_experiment(written(tmp_path, tables, turned, times(channel, -1.0))).records[0]
    (tmp_path / "other").mkdir()
    other = load_experiment(written(tmp_path / "other", tables, EXPERIMENT)).records[0]
    np.testing.assert_array_equal(one.channels[channel], other.channels[channel])


@pytest.mark.parametrize("sign", ["0", "-2", '"-1"', "true"])
def test_a_sign_that_is_none(sign, tables, tmp_path):
    wrong = EXPERIMENT.replace("[sensors.impact_force]", f"[sensors.impact_force]\nsign = {sign}", 1)
    with pytest.raises(ExperimentError, match=r"sign in \[sensors.impact_force\] is .*: expected 1 or -1; write sign = -1"):
        load_experiment(written(tmp_path, tables, wrong))


def test_sensors_that_disagree_by_a_factor_are_told_and_left_to_the_diagnosis(tables, tmp_path):
    (warning, other) = load_experiment(written(tmp_path, tables, EXPERIMENT, times("hammer_acceleration", 1.5))).warnings
    assert warning.startswith(
        "hammer_acceleration is 1.49 times what hammer_displacement gives for it, in 4 records: check the calibration"
    )
    assert other.startswith("impact_force is 0.658 times mass times deceleration, in 4 records")


def test_a_factor_that_changes_between_records_is_no_calibration(tables, tmp_path):
    factors = iter((0.9, 1.5, 1.1, 1.6))

    def other_each_time(columns):
        columns["hammer_acceleration"] = next(factors) * columns["hammer_acceleration"]

    assert load_experiment(written(tmp_path, tables, EXPERIMENT, other_each_time, leave_out=CELL)).warnings == ()


def doubt(hammer: np.ndarray, cart: np.ndarray, time: np.ndarray) -> str:
    """What is doubted in a free decay with these motions; empty where nothing is."""
    noise = np.random.default_rng(0).normal(0.0, 1e-6, (2, time.size))
    channels = {"hammer_displacement": hammer + noise[0], "cart_displacement": cart + noise[1]}
    record = Record(file="a.csv", kind="free-decay", gap=0.0, time=time, channels=channels)
    return next((found.sentence for found in check_bodies(record, Declared())), "")


@pytest.mark.parametrize("zeta", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("seconds", [1.5, 4.0])
@pytest.mark.parametrize("begin", [0.0, 0.3])
def test_a_frame_that_yields_is_no_driven_cart(zeta, seconds, begin):
    """It rings at the hammer's frequency from the start, or from an impact on; beside the same hammer a driven cart is doubted."""
    time = np.arange(round(2000 * seconds)) / 2000.0
    since = np.clip(time - begin, 0.0, None)
    ringing = np.exp(-zeta * 2.0 * np.pi * 6.0 * since) * np.sin(2.0 * np.pi * 6.0 * since)
    assert doubt(1e-3 * ringing, 3e-4 * ringing, time) == ""
    assert "cart_displacement is a sine of 7 Hz" in doubt(1e-3 * ringing, 3e-4 * np.sin(2.0 * np.pi * 7.0 * time), time)


@pytest.mark.parametrize("dead", ["hammer_displacement", "cart_displacement"])
def test_a_dead_channel_pulls_nothing(dead):
    time = np.arange(4000) / 2000.0
    moving = {f"{body}_displacement": 1e-3 * np.sin(2.0 * np.pi * 7.0 * time + phase) for body, phase in (("hammer", 0.3), ("cart", 0.0))}
    noisy = {name: values + np.random.default_rng(2).normal(0.0, 1e-6, time.size) for name, values in moving.items()}
    record = Record(file="a.csv", kind="cart-excitation", gap=0.001, time=time, channels=noisy, excitation_frequency=7.0)
    assert pulls(record, []) is not None
    assert pulls(replace(record, channels=noisy | {dead: np.zeros(time.size)}), []) is None
