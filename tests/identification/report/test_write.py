import dataclasses
import re

import numpy as np
import pytest
from PIL import Image

from identification.report import write_report
from identification.report.page_style import PRINT, STYLES
from identification.result.reference import read_reference
from identification.result.result import residual
from identification.wording import STYLE_NAMES
from tests.identification.made_result import with_unknown
from tests.identification.report.page_reader import is_grey, read, svgs, unpacked
from vibrojax.data_files import data_path
from vibrojax.errors import InputError


@pytest.fixture(scope="module")
def written(poor, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    said = []
    paths = write_report(with_unknown(poor, "zeta"), folder, provenance={"seed": 7, "sha256": {"drop.csv": "ab"}}, progress=said.append)
    assert said == ["drawing the report"]
    return paths


def test_the_files_are_the_page_and_one_a_plot(written):
    assert written[0].name == "report.html"
    assert sorted(written) == sorted(written[0].parent.iterdir())
    assert len(svgs(written[0])) == len(written) - 1
    assert all(path.suffix == ".png" and path.read_bytes().startswith(b"\x89PNG") for path in written[1:])


def test_on_paper_every_plot_is_a_pdf_file_too(good, tmp_path):
    written = write_report(good, tmp_path, style=PRINT)
    names = {suffix: {path.stem for path in written[1:] if path.suffix == suffix} for suffix in (".png", ".pdf")}
    assert names[".png"] == names[".pdf"] and len(names[".pdf"]) == len(svgs(written[0]))
    assert all(path.read_bytes().startswith(b"%PDF") for path in written if path.suffix == ".pdf")


def test_a_dollar_in_a_file_name_starts_no_formula(poor, tmp_path):
    records = tuple(dataclasses.replace(record, file=rf"$\foo${record.file}") for record in poor.records)
    page = write_report(dataclasses.replace(poor, records=records), tmp_path)[0]
    assert all(record.file in page.read_text(encoding="utf-8") for record in records)


def test_names_in_any_script_are_themselves_in_the_page(poor, tmp_path):
    """Whichever fonts are installed: letters that only Matplotlib lacks are left to the browser."""
    records = tuple(dataclasses.replace(record, file=f"试验🧪{record.file}") for record in poor.records)
    written = write_report(dataclasses.replace(poor, records=records), tmp_path)
    drawn = "".join(text for svg in svgs(written[0]) for text in svg.itertext())
    assert all(f"试验🧪{record.file}" in drawn for record in poor.records)
    assert "\\u" not in drawn


def test_the_page_stands_alone(written):
    page, text = read(written[0]), written[0].read_text(encoding="utf-8")
    assert all(address.startswith(("data:image/png;base64,", "#")) for address in page.addresses)
    assert not re.search(r"https?://|@import|url\((?!#)", text)
    assert len(page.alts) == len(svgs(written[0]))
    assert all(len(alt) > 30 for alt in page.alts)


def test_names_inside_the_figures_are_unique_and_every_reference_is_met(written):
    page, text = read(written[0]), written[0].read_text(encoding="utf-8")
    assert len(set(page.ids)) == len(page.ids) > 100
    referred = set(re.findall(r"url\(#([^)]*)\)", text)) | {address[1:] for address in page.addresses if address.startswith("#")}
    assert referred and referred <= set(page.ids)


def test_the_overlay_of_a_whole_record_travels_in_the_page(written, poor):
    page = read(written[0])
    assert len(page.zooms) == len(poor.records)
    for record, (zoom, samples) in zip(poor.records, page.zooms, strict=True):
        series = unpacked(zoom, samples)
        assert len(zoom["panels"]) == 2 * len(record.chi2_reduced)
        above = next(panel for panel in zoom["panels"] if panel["words"] == "impact force")
        measured, model = (series[curve["track"]] for curve in above["curves"])
        assert [curve["name"] for curve in above["curves"]] == ["measured", "model"]
        assert np.abs(series[above["time"]] - record.time).max() < 1e-6
        assert np.abs(measured - record.measured["impact_force"]).max() < 0.06 * record.noise["impact_force"]
        assert np.abs(model - record.predicted["impact_force"]).max() < 0.06 * record.noise["impact_force"]
        below = zoom["panels"][zoom["panels"].index(above) + 1]["curves"][0]
        r = (series[below["track"]] - series[below["minus"]]) / below["noise"]
        assert np.abs(r - residual(record, "impact_force")).max() < 0.11


def test_the_script_finds_all_that_it_reads(written):
    """Data attributes, the places of the panels inside the picture, and the parts of it that make way for closer ones."""
    page = read(written[0])
    assert set(re.findall(r"dataset\.(\w+)", page.script)) == {"zoom", "samples"}
    zoomed = [svg for svg in svgs(written[0]) if svg.findall(".//*[@class='zoomed']")]
    for svg, (zoom, _) in zip(zoomed, page.zooms, strict=True):
        width, height = map(float, svg.attrib["viewBox"].split()[2:])
        assert len(svg.findall(".//*[@class='zoomed']")) == sum(len(panel["curves"]) for panel in zoom["panels"])
        assert svg.findall(".//*[@class='tick']")
        for left, top, wide, tall in (panel["box"] for panel in zoom["panels"]):
            assert 0 < left < left + wide <= width and 0 < top < top + tall <= height
    assert set(re.findall(r"querySelector(?:All)?\(\"([^\"]+)\"\)", page.script)) == {"[data-zoom]", "svg", ".zoomed, .tick"}


def test_a_page_without_an_overlay_needs_no_script(good, tmp_path):
    silent = tuple(dataclasses.replace(record, chi2_reduced={}) for record in good.records)
    assert read(write_report(dataclasses.replace(good, records=silent), tmp_path)[0]).script == ""


def test_sections_come_in_one_order(written):
    text = written[0].read_text(encoding="utf-8")
    assert re.findall(r"<h2>(.*?)</h2>", text) == ["Numbers", "Pictures", "What to do next", "Provenance"]
    assert text.index('class="verdict') < text.index("<h2>Numbers")


def test_what_to_do_next_follows_from_the_verdict(written, good, tmp_path):
    assert "vibrojax diagnose with the same experiment" in read(written[0]).text
    assert "Add records in which ζ shows" in read(written[0]).text
    text = read(write_report(good, tmp_path)[0]).text
    assert "vibrojax diagnose" not in text and "Impacts at other speeds would separate n and kᵢ" in text


def test_every_picture_states_rig_record_gap_and_drive(written, poor):
    stated = [" ".join(svg.itertext()) for svg in svgs(written[0])]
    assert sum("made <by> hand; drop.csv; gap 0 mm; drop test" in one for one in stated) >= 2
    assert sum("made <by> hand; cart1.csv; gap 0.5000 mm; drive 8.000 Hz" in one for one in stated) >= 2
    assert all("made <by> hand; 2 records" in one or ".csv; gap" in one for one in stated)


def test_in_black_and_white_nothing_has_a_hue(good, tmp_path):
    written = write_report(good, tmp_path, style=PRINT)
    assert all(is_grey(svg) for svg in svgs(written[0]))
    for path in written[1:]:
        if path.suffix == ".png":
            with Image.open(path) as image:
                assert np.ptp(np.asarray(image.convert("RGB")).astype(int), axis=2).max() <= 2, path.name
    page = read(written[0])
    colours = [curve["colour"] for zoom, _ in page.zooms for panel in zoom["panels"] for curve in panel["curves"]]
    assert all(colour[1:3] == colour[3:5] == colour[5:] for colour in colours)
    assert '<body class="print">' in written[0].read_text(encoding="utf-8")
    assert not re.search(r"\b(blue|orange)\b", page.text)


def test_in_colours_there_are_hues(good, tmp_path):
    assert not any(is_grey(svg) for svg in svgs(write_report(good, tmp_path)[0])[:2])


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


def test_every_style_that_the_command_line_lists_is_there():
    assert tuple(STYLES) == STYLE_NAMES


def test_each_record_alone_and_what_has_no_decay_are_on_the_page(written):
    text = read(written[0]).text
    assert re.search(r"Each record alone.*drop\.csv.*2\.0000 ± 0\.0020.*cart1\.csv.*2\.0200 ± 0\.0040.*mean over records", text, re.DOTALL)
    assert "23.1 of 1 (1.5 × 10⁻⁶)" in text
    assert "No decay was read in cart1.csv: driven <throughout>, so that nothing decays." in text
