"""LabVIEW measurement files: comments, a time column for each channel, segments, few samples below a long head."""

import numpy as np
import pytest

from identification.experiment import ExperimentError
from identification.experiment.readers import read_columns
from identification.inspection.columns import read_file

ONE, MULTI = "\t", "\t\t"


def head(between=ONE, *, mark=",", units=("mm", "N")):
    """The lines above the samples of a file's first segment."""
    first = ["LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", *([f"Decimal_Separator\t{mark}"] if mark else [])]
    return [*first, "Multi_Headings\tYes", "Date\t2024/03/01", "***End_of_Header***\t", "\t", *segment(between, units)]


def segment(between=ONE, units=("mm", "N")):
    """The lines above the samples of two channels, "x" and "F"."""
    entries = {"Channels": ("2", ""), "Samples": ("3", "3"), "Y_Unit_Label": units, "X_Dimension": ("Time", "Time")}
    entries |= {"X0": ("0,0E+0", "0,0E+0"), "Delta_X": ("0,5", "0,5"), "***End_of_Header***": ("", "")}
    names = "X_Value\tx\tF\tComment" if between == ONE else "X_Value\tx\tX_Value\tF\tComment"
    return [*(f"{key}\t{between.join(both)}\t" for key, both in entries.items()), names]


def read(tmp_path, lines, *wanted):
    (tmp_path / "a.lvm").write_text("\r\n".join([*lines, ""]), newline="")
    return read_columns(tmp_path / "a.lvm", frozenset(wanted), "a.lvm")


@pytest.mark.parametrize("comment", ["Run 1", "2", "#1, soft stop", 'the 3" stop', "a\tb", ""])
@pytest.mark.parametrize("row", [0, 1, 2])
def test_a_comment_moves_no_column_and_drops_no_sample(tmp_path, comment, row):
    body = ["0,0\t1,5\t-2,5", "0,5\t2,5\t-3,5", "1,0\t3,5\t-4,5"]
    body[row] += f"\t{comment}"
    found = read(tmp_path, head() + body, "X_Value", "x", "F")
    assert (found.names, found.units) == (("X_Value", "x", "F"), {"X_Value": "s", "x": "mm", "F": "N"})
    assert [found.values[name].tolist() for name in found.names] == [[0.0, 0.5, 1.0], [1.5, 2.5, 3.5], [-2.5, -3.5, -4.5]]


def test_a_channel_without_unit_takes_none_from_its_neighbour(tmp_path):
    for between, row in ((ONE, "0,0\t1,5\t2"), (MULTI, "0,0\t1,5\t0,0\t2")):
        found = read(tmp_path, [*head(between, units=("", "N")), row], "x", "F")
        assert found.units == {"F": "N"}


def test_a_row_with_too_many_numbers_is_refused(tmp_path):
    with pytest.raises(ExperimentError, match="line 18 has 5 cells: expected 3"):
        read(tmp_path, [*head(), "0,0\t1,5\t2", "0,5\t1,5\t2\t3\t4", "1,0\t1,5\t2"], "F")


def test_equal_time_columns_become_one(tmp_path):
    body = ["0,0\t1,5\t0,0\t-2,5\tRun 1", "0,5\t2,5\t0,5000001\t-3,5", "\t\t1,0\t-4,5"]
    found = read(tmp_path, head(MULTI) + body, "time", "x", "F")
    assert (found.names, found.units) == (("time", "x", "F"), {"time": "s", "x": "mm", "F": "N"})
    assert (found.values["time"].tolist(), found.values["F"].tolist()) == ([0.0, 0.5, 1.0], [-2.5, -3.5, -4.5])
    np.testing.assert_array_equal(found.values["x"], [1.5, 2.5, np.nan])


def test_unequal_time_columns_are_refused(tmp_path):
    body = [f"{0.5 * k}\t{k}.5\t{0.25 * k}\t-{k}.5" for k in range(3)]
    message = r"'x' \(3 samples from 0 at steps of 0.5\) and 'F' \(3 .* steps of 0.25\) are sampled differently: .*; resample"
    with pytest.raises(ExperimentError, match=message):
        read(tmp_path, head(MULTI, mark=".") + body, "time", "x", "F")
    assert read(tmp_path, head(MULTI, mark=".") + body, "time", "F").values["time"].tolist() == [0.0, 0.25, 0.5]
    assert "on another time axis" in read_file(tmp_path / "a.lvm").unusable["F"]


def test_the_second_segment_is_named(tmp_path):
    body = ["0,0\t1,5\t2\tRun 1", "0,5\t2,5\t3", "1,0\t3,5\t4"]
    again = segment() + body
    for between in ([""], []):
        line = len(head() + body + between + segment())
        with pytest.raises(
            ExperimentError, match=f"holds 3 segments, the second has its columns in line {line}: expected one.*; export each segment"
        ):
            read(tmp_path, head() + body + between + again + between + again)
    with pytest.raises(ExperimentError, match=f"holds 2 segments, the second has its columns in line {len(head() + body + head())}:"):
        read(tmp_path, head() + body + head() + body)


@pytest.mark.parametrize("samples", [0, 1, 3])
@pytest.mark.parametrize("mark", [",", ""])
def test_few_samples_below_a_long_head(tmp_path, samples, mark):
    body = [f"{k},5\t1,5\t{k},5\t2" for k in range(samples)]
    found = read(tmp_path, head(MULTI, mark=mark) + body, "time", "x", "F")
    assert (found.names, found.values["time"].tolist()) == (("time", "x", "F"), [k + 0.5 for k in range(samples)])
