"""A batch of fits as a table, as CSV and as a page."""

import csv
import dataclasses
import io

import pytest
from matplotlib.figure import Figure
from rich.console import Console

from identification.report import batch
from identification.report.base import PRINT, SCREEN
from identification.result.batch import BAD_INPUT, BatchParameter, BatchRow

STIFFNESS = BatchParameter(name="k_i", symbol="k_i", unit="N/m^n", value=2e6, stderr=3e3, status="ok")
EXPONENT = BatchParameter(name="n", symbol="n", unit="1", value=1.5, stderr=None, status="fixed")
LINEAR = dataclasses.replace(STIFFNESS, unit="N/m", value=5e5, stderr=1e3)
GOOD = BatchRow(
    experiment="a", digest="", status="good", law="hunt-crossley", parameters=(STIFFNESS, EXPONENT), chi2_reduced=1.01, seconds=6.2
)
ROWS = (
    GOOD,
    BatchRow(experiment="<b>", digest="", status=BAD_INPUT, seconds=0.1, failure="no [mass] & no <force>"),
    dataclasses.replace(GOOD, experiment="c, 2", status="poor", law="kelvin-voigt", parameters=(LINEAR,), chi2_reduced=None),
)


def test_one_name_in_two_units_is_two_columns_and_what_is_missing_a_dash():
    table = batch.batch_table(ROWS)
    assert table.columns == ("experiment", "no.", "verdict", "kᵢ (N/mⁿ)", "n", "kᵢ (N/m)", "χ²", "s")
    assert table.rows[0] == ("a", "1", "good", "(2.0000±0.0030) × 10⁶", "1.5", "–", "1.01", "6.2")
    assert table.rows[1] == ("<b>", "2", "bad input", "–", "–", "–", "–", "0.10")
    assert table.rows[2][3:7] == ("–", "–", "(5.000±0.010) × 10⁵", "–")


def test_the_terminal_gives_the_reason_of_each_that_failed():
    stream = io.StringIO()
    Console(file=stream, width=160).print(batch.batch_summary(ROWS))
    assert "<b>: no [mass] & no <force>" in stream.getvalue()
    assert "2 of 3 experiments fitted: 1 explained to the noise, 1 not explained and 1 with bad input." in stream.getvalue()


def written(rows, folder, style=SCREEN) -> str:
    batch.write_batch(rows, folder, name="week 3", options={"seed": 0, "law": None, "style": style.name}, style=style)
    return (folder / "batch.html").read_text(encoding="utf-8")


def test_a_page_links_what_was_fitted_and_escapes_names(tmp_path):
    page = written(ROWS, tmp_path, PRINT)
    assert '<a href="a/report.html">a</a>' in page and '<a href="c%2C%202/report.html">c, 2</a>' in page
    assert "<b>" not in page and page.count("<a href") == 2
    assert "<li>&lt;b&gt;: no [mass] &amp; no &lt;force&gt;</li>" in page
    assert 'class="verdict poor"' in page and "<code>vibrojax diagnose</code>" in page and "begin with c, 2" in page
    assert page.count('src="data:image/png') == 1 and "<dt>seed</dt><dd>0</dd>" in page and "<dt>law</dt>" not in page
    assert {path.name for path in tmp_path.iterdir()} == {"batch.csv", "batch.html", "batch-parameters.png", "batch-parameters.pdf"}


def test_numbers_in_the_file_are_whole(tmp_path):
    written(ROWS, tmp_path)
    with (tmp_path / "batch.csv").open(encoding="utf-8", newline="") as file:
        first, failed, _ = csv.DictReader(file)
    assert (float(first["k_i"]), float(first["k_i_stderr"]), first["n_stderr"], first["n_status"]) == (2e6, 3e3, "", "fixed")
    assert (failed["failure"], failed["k_i"], failed["seconds"]) == ("no [mass] & no <force>", "", "0.1")


@pytest.mark.parametrize(("rows", "level"), [(ROWS[:1], "good"), ((dataclasses.replace(GOOD, status="partly"),), "partly")])
def test_the_page_has_the_level_of_the_worst(tmp_path, rows, level):
    assert f'class="verdict {level}"' in written(rows, tmp_path)


def test_a_batch_without_any_fit_has_a_page_without_picture(tmp_path):
    page = written(ROWS[1:2], tmp_path)
    assert "0 of 1 experiments fitted: 1 with bad input." in page and "data:image" not in page


def test_each_parameter_stands_at_the_number_of_its_experiment_with_its_error():
    (picture,) = batch._parameters(ROWS, SCREEN)
    assert isinstance(picture.figure, Figure)
    stiffness, exponent, linear = picture.figure.axes
    assert stiffness.containers[0].lines[0].get_xydata().tolist() == [[1.0, 2e6]]
    assert stiffness.containers[0].lines[2][0].get_segments()[0].tolist() == [[1.0, 2e6 - 3e3], [1.0, 2e6 + 3e3]]
    assert exponent.lines[-1].get_xydata().tolist() == [[1.0, 1.5]] and not len(exponent.containers[0].lines[0].get_xydata())
    assert linear.containers[0].lines[0].get_xydata().tolist() == [[3.0, 5e5]]
