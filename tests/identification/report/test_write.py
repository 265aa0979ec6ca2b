import dataclasses
import re

import pytest

from identification.report import write_report
from identification.report.base import PRINT, STYLES, subject
from identification.result.reference import read_reference
from identification.wording import STYLE_NAMES
from tests.identification.made_result import with_unknown
from tests.identification.report.page_reader import is_grey, read
from vibrojax.data_files import data_path
from vibrojax.errors import InputError


@pytest.fixture(scope="module")
def written(poor, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return write_report(with_unknown(poor, "zeta"), folder, provenance={"seed": 7, "sha256": {"drop.csv": "ab"}})


def test_the_files_are_the_page_and_one_a_plot(written):
    assert written[0].name == "report.html"
    assert sorted(written) == sorted(written[0].parent.iterdir())
    assert {path.suffix for path in written[1:]} == {".png"}
    assert sorted(read(written[0]).images) == sorted(path.read_bytes() for path in written[1:]), "each is rendered once"


def test_on_paper_every_plot_is_a_pdf_file_too(good, tmp_path):
    written = write_report(good, tmp_path, style=PRINT)
    names = {suffix: {path.stem for path in written[1:] if path.suffix == suffix} for suffix in (".png", ".pdf")}
    assert names[".png"] == names[".pdf"] and len(names[".pdf"]) == len(read(written[0]).images)
    assert all(path.read_bytes().startswith(b"%PDF") for path in written if path.suffix == ".pdf")


def test_a_dollar_in_a_file_name_starts_no_formula(poor, tmp_path):
    records = tuple(dataclasses.replace(record, file=rf"$\foo${record.file}") for record in poor.records)
    page = write_report(dataclasses.replace(poor, records=records), tmp_path)[0]
    assert all(record.file in page.read_text(encoding="utf-8") for record in records)


def test_names_in_any_script_are_themselves_in_the_page(poor, tmp_path):
    records = tuple(dataclasses.replace(record, file=f"试验🧪{record.file}") for record in poor.records)
    text = read(write_report(dataclasses.replace(poor, records=records), tmp_path)[0]).text
    assert all(record.file in text for record in records)
    assert "\\u" not in text


def test_the_page_stands_alone(written):
    page, text = read(written[0]), written[0].read_text(encoding="utf-8")
    assert all(address.startswith("data:image/png;base64,") for address in page.addresses)
    assert not re.search(r"https?://|@import|url\(|<script", text)
    assert len(page.alts) == len(page.images) == len(written) - 1
    assert all(len(alt) > 30 for alt in page.alts)


def test_no_element_has_an_empty_class(written):
    assert 'class=""' not in written[0].read_text(encoding="utf-8")


def test_sections_come_in_one_order(written):
    text = written[0].read_text(encoding="utf-8")
    assert re.findall(r"<h2>(.*?)</h2>", text) == ["Numbers", "Pictures", "What to do next", "Details", "Provenance"]
    in_order = ('class="verdict', "<h2>Numbers", "What they rest on", "<img", "<details>")
    assert sorted(map(text.index, in_order)) == list(map(text.index, in_order))


def test_long_tables_are_folded_on_screen_and_open_on_paper(written, good, tmp_path):
    """A page in colours opens them through its rule for print."""
    on_screen = written[0].read_text(encoding="utf-8")
    assert on_screen.count("<details><summary>") == read(written[0]).details >= 4
    assert "details::details-content { content-visibility: visible; }" in on_screen.partition("@media print")[2]
    for heading in ("Misfit of each channel of each record", "Each record alone", "Correlations"):
        assert f"<summary>{heading}</summary>" in on_screen
    on_paper = write_report(good, tmp_path, style=PRINT)[0].read_text(encoding="utf-8")
    assert "<details>" not in on_paper and "<details open><summary>" in on_paper


def test_what_to_do_next_follows_from_the_verdict(written, good, tmp_path):
    assert "vibrojax diagnose with the same experiment" in read(written[0]).text
    assert "Add records in which ζ shows" in read(written[0]).text
    text = read(write_report(good, tmp_path)[0]).text
    assert "vibrojax diagnose" not in text and "Impacts at other speeds would separate n and kᵢ" in text


def test_every_picture_states_rig_record_gap_and_drive(poor):
    experiment, records = poor.experiment, poor.records
    assert subject(experiment, records, "drop.csv") == "made <by> hand; drop.csv; gap 0 mm; drop test"
    assert subject(experiment, records, "cart1.csv") == "made <by> hand; cart1.csv; gap 0.5000 mm; drive 8.000 Hz"
    assert subject(experiment, records, None) == "made <by> hand; 2 records"


def test_in_black_and_white_nothing_has_a_hue(good, tmp_path):
    page = write_report(good, tmp_path, style=PRINT)[0]
    assert all(map(is_grey, read(page).images))
    assert '<body class="print">' in page.read_text(encoding="utf-8")
    assert not re.search(r"\b(blue|orange)\b", read(page).text)


def test_in_colours_there_are_hues(good, tmp_path):
    assert not any(map(is_grey, read(write_report(good, tmp_path)[0]).images[:2]))


def test_a_page_drawn_again_is_the_same_to_the_last_byte(good, tmp_path):
    first, again = (tmp_path / name for name in ("first", "again"))
    for folder in (first, again):
        folder.mkdir()
        write_report(good, folder, provenance={"seed": 7})
    assert {path.name: path.read_bytes() for path in first.iterdir()} == {path.name: path.read_bytes() for path in again.iterdir()}


def test_on_a_phone_every_table_scrolls_within_its_box(written):
    page = read(written[0])
    assert len(page.boxes) >= 3
    assert set(page.boxes) == {'<div class="wide">'}
    assert 'name="viewport" content="width=device-width, initial-scale=1"' in written[0].read_text(encoding="utf-8")


def test_the_page_says_first_whether_the_fit_is_good_and_hides_nothing(written):
    text = read(written[0]).text
    assert text.index("does NOT explain the records") < text.index("What they rest on")
    for piece in (
        "made <by> hand",
        "ζ: not identifiable from these records: nothing <moves> it.",
        "impact_force: one <odd> sample",
        "0.0020 × 10⁶",
        "0.50000 ± 0.00020",
        "Noise of the sensors: declared for cart displacement, hammer acceleration, hammer displacement and impact force.",
        "sha256 ab",
        "moves no parameter by more than 0.012 of its standard error",
        "misfit/σ",
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
    bare = dataclasses.replace(good, derived=(), correlated=(), correlation=good.correlation[:0, :0])
    assert read(write_report(bare, tmp_path)[0]).text


def test_every_style_that_the_command_line_lists_is_there():
    assert tuple(STYLES) == STYLE_NAMES


def test_each_record_alone_and_what_has_no_decay_are_on_the_page(written):
    text = read(written[0]).text
    in_order = r"Each record alone.*drop\.csv.*2\.000 ± 0\.020.*cart1\.csv.*2\.020 ± 0\.020.*all together.*mean over"
    assert re.search(in_order, text, re.DOTALL)
    assert "0.500 of 1 (0.48)" in text
    assert "No decay was read in cart1.csv: driven <throughout>, so that nothing decays." in text
