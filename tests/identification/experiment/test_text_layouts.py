"""Rows above the samples, marks and faults of text files that the layouts of whole recorders do not show."""

import numpy as np
import pytest

from identification.experiment import ExperimentError, load_experiment
from identification.experiment.readers import read_columns
from tests.identification.experiment.malformed import add, csv, write_valid


def read(tmp_path, text, *wanted, name="a.csv", encoding="utf-8"):
    (tmp_path / name).write_text(text, encoding=encoding)
    return read_columns(tmp_path / name, frozenset(wanted), name)


def test_a_decimal_comma_is_found_beside_each_delimiter(tmp_path):
    for mark in (";", "\t", " "):
        found = read(tmp_path, f"t{mark}F\n0,5{mark}-1,5e-3\n1,0{mark}2\n", "t", "F")
        assert (found.values["t"].tolist(), found.values["F"].tolist()) == ([0.5, 1.0], [-1.5e-3, 2.0])
    found = read(tmp_path, 't,F\n"0,5","1,5"\n"0,6","2,5"\n', "t", "F")
    assert found.values["F"].tolist() == [1.5, 2.5]


def test_whole_numbers_between_commas_are_no_decimals(tmp_path):
    assert read(tmp_path, "t,F\n0,15\n1,25\n", "F").values["F"].tolist() == [15.0, 25.0]


def test_units_below_the_header_are_those_of_the_file(tmp_path):
    found = read(tmp_path, "rig 7\nt;F;note\n[s];(kN);-\n0;1;2\n1;2;3\n", "t", "F", "note")
    assert (found.names, found.units) == (("t", "F", "note"), {"t": "s", "F": "kN"})
    assert found.values["F"].tolist() == [1.0, 2.0]


def test_a_percent_sign_is_a_unit_in_a_table_and_a_comment_before_text(tmp_path):
    found = read(tmp_path, "load;x;time\n%;mm;s\n1;2;3\n% stop tightened\n2;3;4\n", "load", "x", "time")
    assert found.units == {"load": "%", "x": "mm", "time": "s"}
    assert found.values["x"].tolist() == [2.0, 3.0]
    assert read(tmp_path, "time,x\n% s, mm\n0,1\n1,2\n", "x").units == {"x": "mm"}


@pytest.mark.parametrize("mark", ["1.034", "1.034,0"])
def test_marks_between_thousands_count_where_a_decimal_mark_follows(tmp_path, mark):
    text = f"t;F\n0,0;{mark}\n0,5;2,5\n1,0;3,5\n1,5;1,5\n"
    if "," in mark:
        assert read(tmp_path, text, "F").values["F"][0] == 1034.0
    else:
        with pytest.raises(ExperimentError, match="'1.034' is not a number: .* no mark between thousands"):
            read(tmp_path, text, "F")


@pytest.mark.parametrize(
    ("line", "header", "rate"),
    [
        ("dt: 0.002 s", "x,F", 500.0),
        ("Sample interval: 500 ns", "x,F", 2e6),
        ("Increment: 5 mm", "x,F", None),
        ("dt: 0.001,0.0005", "x,F", None),
        ("dt: 0.002", "Elapsed [s],x", None),
    ],
)
def test_a_stated_step_counts_in_seconds_and_where_no_column_is_the_time(tmp_path, line, header, rate):
    found = read(tmp_path, f"{line}\n{header}\n0,3\n1,4\n2,5\n", "time", "x")
    assert ("time" in found.names) == (rate is not None)
    if rate is not None:
        np.testing.assert_allclose(found.values["time"], np.arange(3) / rate, rtol=1e-12)


def test_what_stands_below_a_header_that_comes_again_is_left_out(tmp_path):
    found = read(tmp_path, "time,F\n0,1\n1,2\n2,3\ntime,F\n5,3\n6,4\n", "time", "F")
    assert found.values["F"].tolist() == [1.0, 2.0, 3.0]
    assert "from line 5 on ('time,F'), is left out" in " ".join(found.notices)


def test_a_second_row_of_names_is_no_row_of_units(tmp_path):
    found = read(tmp_path, "Channel 1;Channel 2\nTime;Force\n0;1\n1;2\n", "Time")
    assert (found.names, found.units) == (("Time", "Force"), {})


def test_the_first_sample_may_be_the_faulty_one(tmp_path):
    for row, message in (("0,oops", "line 2, column 'F': 'oops' is not a number"), ("0", "line 2 has 1 cells: expected 2")):
        with pytest.raises(ExperimentError, match=message):
            read(tmp_path, f"t,F\n{row}\n1,2\n2,3\n3,4\n", "t", "F")


def test_a_header_that_does_not_suit_the_samples(tmp_path):
    with pytest.raises(ExperimentError, match="line 2 has 3 cells: expected 2, one for each column of the header row"):
        read(tmp_path, "t,F\n0,1,2\n1,2,3\n", "t", "F")


@pytest.mark.parametrize("samples", [1, 2, 5])
def test_few_samples_below_a_long_head_are_no_header(tmp_path, samples):
    rows = [f"{k},5;{k}" for k in range(samples)]
    found = read(tmp_path, "\n".join([*(f"Remark {k}: nothing" for k in "abcdefghijklmnopqrst"), "t;F", *rows, ""]), "t", "F")
    assert (found.names, found.values["t"].tolist()) == (("t", "F"), [k + 0.5 for k in range(samples)])


def test_empty_rows_and_columns_of_a_spreadsheet_are_passed_over(tmp_path):
    found = read(tmp_path, "t;F;;\n0;1;;\n;;;\n1;;;\n;;;\n", "t", "F")
    assert found.names == ("t", "F")
    np.testing.assert_array_equal(found.values["F"], [1.0, np.nan])


def test_times_of_day_pass_midnight(tmp_path):
    found = read(tmp_path, "Time;F\n31.12.2024 23:59:59,75;1\n01.01.2025 00:00:00,25;2\n01.01.2025 00:00:00,75;3\n", "Time")
    np.testing.assert_allclose(found.values["Time"], [0.0, 0.5, 1.0], atol=1e-12)
    with pytest.raises(ExperimentError, match="column 'Time' holds times of day and numbers"):
        read(tmp_path, "Time;F\n10:00:00,75;1\n5;2\n10:00:01;3\n", "Time")


def test_time_stamps_beat_a_stated_rate(tmp_path):
    found = read(tmp_path, "Sample rate: 10 Hz\nt,F\n0,1\n1,2\n", "t", "time")
    assert (found.names, list(found.values)) == (("t", "F"), ["t"])


def test_a_frequency_in_a_comment_is_no_sampling_rate(tmp_path):
    assert "time" not in read(tmp_path, "# frequency: 6.25 Hz\nx,F\n0,1\n1,2\n", "time").names


@pytest.fixture
def rig(tmp_path):
    folder = tmp_path / "rig"
    write_valid(folder)
    return folder


def bad_time(lines):
    """One stamp twice, one not at all."""
    return [*lines[:11], lines[10], *lines[11:20], "nan," + lines[20].partition(",")[2], *lines[21:]]


def test_samples_with_bad_time_are_left_out_on_request_and_told(rig):
    csv(bad_time)(rig)
    with pytest.raises(ExperimentError, match="is not finite at sample 21: .*drop_bad_time = true in the record"):
        load_experiment(rig)
    add("drop_bad_time = true")(rig)
    (record,) = (one for one in load_experiment(rig).records if one.file == "cart1.csv")
    assert record.time.size == record.channels["impact_force"].size == 63
    said = "As drop_bad_time asks, 2 of 65 samples are left out: 1 without a time stamp, 1 with that of the sample before."
    assert said in record.notices


def test_time_that_runs_backwards_is_refused_all_the_same(rig):
    csv(lambda lines: [*lines[:11], lines[12], lines[11], *lines[13:]])(rig)
    add("drop_bad_time = true")(rig)
    with pytest.raises(ExperimentError, match="does not grow at sample 12 .*; sort them"):
        load_experiment(rig)
