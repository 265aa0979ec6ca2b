"""Files as recorders and spreadsheets write them: `inspect` proposes an experiment that loads once mass and gap are filled in."""

import numpy as np
import pytest

from identification.experiment import ExperimentError, load_experiment
from identification.inspection import inspect_path, propose
from tests.identification.inspection.logger_files import LAYOUTS, NUMBERS, SCOPES, TIME, qualisys, record, rows

EXACT = 1e-8


def proposed(folder):
    """The experiment as proposed, with the operator's part."""
    text = propose(inspect_path(folder), folder)
    filled = text.replace("# mass = 0.4", "mass = 0.4").replace("# gap = 0.0", "gap = 0.001")
    (folder / "experiment.toml").write_text(filled, encoding="utf-8")
    return load_experiment(folder)


@pytest.mark.parametrize(("file", "write"), LAYOUTS.values(), ids=LAYOUTS)
def test_a_recorders_file_fits_as_proposed(file, write, tmp_path):
    write(tmp_path / file)
    (found,) = proposed(tmp_path).records
    np.testing.assert_allclose(found.time, TIME, rtol=0, atol=2e-9 if file != "a.csv" else 1e-6)
    assert (found.kind, found.excitation_frequency) == ("cart-excitation", 6.25)
    for name in NUMBERS:
        np.testing.assert_allclose(found.channels[name], record()[name], rtol=EXACT, atol=1e-12)


@pytest.mark.parametrize(("head", "row", "names", "unit"), SCOPES.values(), ids=SCOPES)
def test_channels_without_a_known_quantity(head, row, names, unit, tmp_path):
    one, two = np.array([[0.5, -0.25, 0.125, 2.0, 1.5], [1.0, 2.5, -1.0, 0.5, 0.25]])
    body = [row.format(i=i, j=i + 1, t=i / 1e3, ms=i, a=a, b=b) for i, (a, b) in enumerate(zip(one, two, strict=True))]
    (tmp_path / "a.txt").write_text(head + "\n".join(body))
    (inspected,) = inspect_path(tmp_path / "a.txt").files
    found = inspected.found
    np.testing.assert_allclose(found.seconds - found.seconds[0], np.arange(5) / 1e3, rtol=0, atol=1e-12)
    assert [(column.name, column.unit) for column in found.columns] == [(name, unit) for name in names]
    for column, values in zip(found.columns, (one, two), strict=True):
        np.testing.assert_array_equal(column.values, values)


@pytest.mark.parametrize(
    ("first", "second", "time", "kept"),
    [
        ("Index", "y_mm", "", False),
        ("Elapsed (ms)", "y_mm", "Elapsed (ms)", False),
        ("Encoder [mm]", "t", "t", True),
        ("hammer_displacement", "t", "t", True),
    ],
)
def test_whole_numbers_are_a_count_unless_their_name_or_unit_says_otherwise(first, second, time, kept, tmp_path):
    rows = [f"{place},{0.5 * place if second == 't' else place % 4},{place % 3}" for place in range(9)]
    (tmp_path / "a.csv").write_text("\n".join([f"{first},{second},x_g", *rows]))
    (inspected,) = inspect_path(tmp_path / "a.csv").files
    found = inspected.found
    assert (found.time.name, first in [column.name for column in found.columns]) == (time, kept)
    assert {one.column.name: one.channel for one in inspected.mapped}["x_g"] == "hammer_acceleration", "a unit goes before a symbol"


@pytest.mark.parametrize("header", [True, False])
def test_markers_of_qualisys_are_read_in_the_direction_in_which_they_move(header, tmp_path):
    qualisys(tmp_path / "a.tsv", header=header)
    (found,) = proposed(tmp_path).records
    np.testing.assert_allclose(found.time, TIME, rtol=0, atol=1e-8)
    for name in NUMBERS[:2]:
        np.testing.assert_allclose(found.channels[name], record()[name], rtol=0, atol=1e-9)
    assert found.excitation_frequency == 6.25


def test_what_was_concluded_in_reading_is_told(tmp_path):
    for name in ("Excel, German", "rate in a comment"):
        file, write = LAYOUTS[name]
        write(tmp_path / f"{name[:4]}{file}")
    notices = {found.file: " ".join(found.notices) for found in proposed(tmp_path).records}
    assert "The file is not UTF-8; it was read as Windows-1252 (Latin-1)." in notices["Excea.csv"]
    assert "no time stamps; they follow from its sampling rate of 2048 Hz" in notices["ratea.csv"].replace("states no", "no")


def test_a_file_without_time_and_rate_lacks_one_number(tmp_path):
    head = "Hammer Weg [mm];Wagen Weg [mm];Kraft [N];Hammer Beschl [m/s²]"
    (tmp_path / "a.csv").write_text("\n".join([head, *rows(time=None)]), encoding="utf-8")
    text = propose(inspect_path(tmp_path), tmp_path)
    assert "# sampling_frequency = 1000.0 # TO FILL IN: Hz; the file has no time stamps" in text
    assert "# excitation_frequency = 6.25 # TO FILL IN" in text
    filled = text.replace("# mass", "mass").replace("# gap", "gap").replace("# excitation", "excitation")
    (tmp_path / "experiment.toml").write_text(filled)
    with pytest.raises(ExperimentError, match="no column 'time' for time: .*or give its sampling_frequency there"):
        load_experiment(tmp_path)
    (tmp_path / "experiment.toml").write_text(filled.replace("# sampling_frequency = 1000.0", "sampling_frequency = 2048.0"))
    (found,) = load_experiment(tmp_path).records
    np.testing.assert_allclose(found.time, TIME, rtol=0, atol=1e-12)
    assert "they follow from the declared sampling_frequency of 2048 Hz" in " ".join(found.notices)


def test_one_column_of_bare_numbers_takes_its_rate_from_the_rows_above(tmp_path):
    swing = np.round(90.0 * np.exp(-TIME) * np.cos(10.0 * TIME), 2)
    (tmp_path / "a.txt").write_text("start_deg, sample_rate, duration_sec\n90, 2048, 1 \n" + "\n".join(f"{value:g}" for value in swing))
    (tmp_path / "experiment.toml").write_text(
        'schema = 1\n[hammer]\nmass = 1.0\n[suspension]\nkind = "pivot"\nlength = 1.0\n[sensors.relative_displacement]\nunit = "deg"\n'
        '[[record]]\nfile = "a.txt"\nkind = "free-decay"\ngap = 100.0\ncolumns = { relative_displacement = "column 1" }\n'
    )
    (found,) = load_experiment(tmp_path).records
    np.testing.assert_allclose(found.time, TIME, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.channels["relative_displacement"], np.radians(swing), rtol=1e-12)


@pytest.mark.parametrize(
    ("columns", "channels"),
    [
        ({"angle": 1.0}, {"relative_displacement": ("angle", "rad")}),
        ({"angle": 50.0}, {"relative_displacement": ("angle", "deg")}),
        ({"x": 1e-3}, {"hammer_displacement": ("x", "m")}),
        ({"position": 1e-3}, {"hammer_displacement": ("position", "m")}),
        ({"LVDT": 1e-3, "Load cell": 10.0}, {"hammer_displacement": ("LVDT", "m"), "impact_force": ("Load cell", "N")}),
        ({"position": 1.0, "torque": 2.0}, {"relative_displacement": ("position", "rad"), "applied_force": ("torque", "N")}),
        ({"Winkel": 1.0, "Drehmoment": 2.0}, {"relative_displacement": ("Winkel", "rad"), "applied_force": ("Drehmoment", "N")}),
        ({"Accel": 1.0}, {"hammer_acceleration": ("Accel", "m/s^2")}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, dict) else "",
)
def test_usual_names_without_a_body_are_understood(columns, channels, tmp_path):
    rng = np.random.default_rng(2)
    swing = np.exp(-TIME) * np.cos(20.0 * TIME)
    table = np.column_stack([TIME, *(size * (swing + rng.normal(0.0, 1e-4, TIME.size)) for size in columns.values())])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header=",".join(["time", *columns]), comments="")
    (one,) = inspect_path(tmp_path).files
    assert {each.channel: (each.column.name, each.unit) for each in one.mapped} == channels


def test_a_pivot_and_its_motor_are_proposed_so_that_they_fit_without_editing(tmp_path):
    rng = np.random.default_rng(2)
    columns = [TIME, np.sin(4.0 * TIME) + rng.normal(0, 1e-4, TIME.size), np.cos(9.0 * TIME) + rng.normal(0, 1e-3, TIME.size)]
    np.savetxt(tmp_path / "a.csv", np.column_stack(columns), delimiter=",", header="time,position,torque", comments="")
    (tmp_path / "experiment.toml").write_text(propose(inspect_path(tmp_path), tmp_path))
    experiment = load_experiment(tmp_path)
    assert (experiment.suspension.kind, experiment.suspension.length, experiment.mass_is_known, experiment.law) == (
        "pivot",
        1.0,
        False,
        "none",
    )
    assert experiment.records[0].kind == "forced"


def test_two_columns_that_could_both_be_a_channel_are_left_to_the_operator(tmp_path):
    table = np.column_stack([TIME, np.sin(TIME), np.cos(TIME), 10.0 * np.sin(TIME)])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="time,LVDT 1 [mm],LVDT 2 [mm],F [N]", comments="")
    text = propose(inspect_path(tmp_path), tmp_path)
    assert '# not taken for a channel: "LVDT 1 [mm]", "LVDT 2 [mm]"; name what is one' in text
