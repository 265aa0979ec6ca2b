import dataclasses
import re

import pytest

from identification.report import write_report
from identification.result.reference import read_reference
from tests.identification.made_result import with_unknown
from tests.identification.report.page_reader import read
from vibrojax.data_files import data_path
from vibrojax.errors import InputError


@pytest.fixture(scope="module")
def written(poor, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    said = []
    paths = write_report(with_unknown(poor, "zeta"), folder, provenance={"seed": 7, "sha256": {"drop.csv": "ab"}}, progress=said.append)
    assert said == ["drawing the report"]
    return paths


def test_the_files_are_the_page_and_one_image_a_plot(written):
    assert written[0].name == "report.html"
    assert sorted(written) == sorted(written[0].parent.iterdir())
    assert {path.suffix for path in written[1:]} == {".png"}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in written[1:])


def test_the_page_stands_alone(written):
    page, text = read(written[0]), written[0].read_text(encoding="utf-8")
    assert len(page.addresses) == len(written) - 1
    assert all(address.startswith("data:image/png;base64,") for address in page.addresses)
    assert "<script" not in text
    assert not re.search(r"https?://|@import|url\(", text)
    assert all(len(alt) > 30 for alt in page.alts)


def test_on_a_phone_every_table_scrolls_within_its_box(written):
    page = read(written[0])
    assert len(page.boxes) >= 4
    assert set(page.boxes) == {'<div class="wide">'}
    assert 'name="viewport" content="width=device-width, initial-scale=1"' in written[0].read_text(encoding="utf-8")


def test_the_page_says_first_whether_the_fit_is_good_and_hides_nothing(written):
    text = read(written[0]).text
    assert text.index("does NOT explain the records") < text.index("Parameters")
    for piece in (
        "made <by> hand",
        "ζ: not identifiable from these records: nothing <moves> it.",
        "impact_force: one <odd> sample",
        "0.0020 × 10⁶",
        "gap as estimated 0.50000 ± 0.00020 mm",
        "3 windows",
        "sha256 ab",
        "moves no parameter by more than 0.012 of its standard error",
        "misfit / σ",
    ):
        assert piece in text, piece


def test_a_good_fit_is_called_good(good, tmp_path):
    reference = read_reference(data_path("thesis", "figure_3_3.toml"))
    text = read(write_report(good, tmp_path, reference=reference)[0]).text
    assert "The model explains the records to the noise" in text
    assert "NOT" not in text
    assert "figure 3.3" in text
    assert "vibrojax" in text


def test_a_reference_that_does_not_suit_leaves_nothing_behind(good, tmp_path):
    reference = read_reference(data_path("thesis", "rig_wires.toml"))
    with pytest.raises(InputError, match="no row for any parameter"):
        write_report(good, tmp_path, reference=reference)
    assert list(tmp_path.iterdir()) == []


def test_an_empty_multistart_and_no_derived_numbers(good, tmp_path):
    bare = dataclasses.replace(good, starts=(), derived=(), correlated=(), correlation=good.correlation[:0, :0])
    assert read(write_report(bare, tmp_path)[0]).text
