import dataclasses
import io
import json
import re

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNDECIDED, UNLISTED
from identification.diagnosis.files import diagnosis_provenance
from identification.report import diagnosis_summary, write_diagnosis_report
from identification.report.base import PRINT, SCREEN
from identification.report.decay import ring_downs_of_both
from identification.report.diagnosis_figures import stretches
from identification.report.diagnosis_tables import changes, scatter
from identification.report.page import FIGURES_OF_DIAGNOSIS as FIGURES
from identification.result.files import plain
from identification.wording.names import equation_html
from identification.wording.numbers import NONE
from tests.identification.diagnosis.made_diagnosis import FRICTION, made_diagnosis
from tests.identification.made_result import made_result
from tests.identification.report.page_reader import is_grey, read
from vibrojax.drawing import style
from vibrojax.effects import EFFECTS, GainError
from vibrojax.json_file import write_json

VERDICTS = (MISSING, UNLISTED, UNDECIDED, ADEQUATE, RESTLESS)


@pytest.fixture(scope="module")
def made():
    result = made_result()
    return {verdict: made_diagnosis(result, verdict) for verdict in VERDICTS}


@pytest.fixture(scope="module")
def pages(made, tmp_path_factory):
    found = {}
    for verdict, diagnosis in made.items():
        folder = tmp_path_factory.mktemp(verdict)
        found[verdict] = write_diagnosis_report(diagnosis, folder)
    return found


def draw(diagnosis):
    with style():
        return [picture for drawer in FIGURES for picture in drawer(diagnosis, SCREEN)]


def changed(diagnosis, **location):
    """The same with another location."""
    return dataclasses.replace(diagnosis, location=dataclasses.replace(diagnosis.location, **location))


def printed(diagnosis) -> str:
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(diagnosis_summary(diagnosis))
    return console.export_text()


@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_page_stands_alone(pages, verdict):
    written = pages[verdict]
    page, text = read(written[0]), written[0].read_text(encoding="utf-8")
    assert sorted(written) == sorted(written[0].parent.iterdir())
    assert len(page.alts) == len(page.images) == len(written) - 1
    assert sorted(page.images) == sorted(path.read_bytes() for path in written[1:])
    assert all(address.startswith("data:image/png;base64,") for address in page.addresses)
    assert not re.search(r"https?://|@import|url\(|<script", text)
    assert all(len(alt) > 30 for alt in page.alts)
    assert re.findall(r"<h2>(.*?)</h2>", text) == ["Numbers", "Pictures", "What to do next", "Details", "Provenance"]


@pytest.mark.parametrize("verdict", [MISSING, UNLISTED])
def test_the_missing_force_stands_right_under_the_headline(pages, verdict):
    text = pages[verdict][0].read_text(encoding="utf-8")
    missing = text.index('alt="Missing force over the velocity')
    assert text.index('class="verdict') < missing < text.index("<h2>Numbers")
    assert missing == text.index("alt="), "it is the first picture"


@pytest.mark.parametrize("verdict", [MISSING, UNLISTED, ADEQUATE])
def test_in_black_and_white_nothing_has_a_hue(made, verdict, tmp_path):
    written = write_diagnosis_report(made[verdict], tmp_path, style=PRINT)
    assert all(map(is_grey, read(written[0]).images))
    assert not re.search(r"\b(blue|orange)\b", read(written[0]).text)


def test_further_candidates_are_folded_on_screen_and_open_on_paper(pages, made, tmp_path):
    """A page in colours opens them through its rule for print."""
    on_screen = pages[MISSING][0].read_text(encoding="utf-8")
    on_paper = write_diagnosis_report(made[MISSING], tmp_path, style=PRINT)[0].read_text(encoding="utf-8")
    assert "<details><summary>4 further candidates" in on_screen
    assert "details::details-content { content-visibility: visible; }" in on_screen.partition("@media print")[2]
    assert "<details open><summary>4 further candidates" in on_paper


def test_every_picture_is_drawn_and_legible(made):
    expected = {
        "missing",
        "missing-others",
        "restitution",
        "damping-and-frequency",
        "residual-maps",
        "record-01-before-after",
        "record-02-before-after",
    }
    for verdict in (MISSING, UNLISTED, UNDECIDED):
        assert {image.name for image in draw(made[verdict])} == expected
    for verdict in (ADEQUATE, RESTLESS):
        drawn = {"damping-and-frequency", "record-01-nominal", "record-02-nominal"}
        assert {image.name for image in draw(made[verdict])} == drawn


def test_every_image_is_legible(pages):
    for content in read(pages[UNLISTED][0]).images:
        with Image.open(io.BytesIO(content)) as opened:
            assert opened.size[0] > 1000
            assert len(np.unique(np.asarray(opened.convert("L")))) > 5


def test_a_missing_effect_is_named_located_and_compared(pages):
    text = read(pages[MISSING][0]).text
    in_order = (
        "made <by> hand",
        "Missing: dry friction in the suspension",
        "Warning: the search stopped after as many effects as it adds to <one> model",
        "What it is",
        "force = −Fc sign(u′)",
        "> 99.9 %",
        "Coulomb 1785",
        "Parameters before and after",
        "−4.0 σ",
        "Prediction before and after",
        "0.187",
        "0.0123",
        "Error of the readings",
        "autocorrelated, order 3",
        "Where it acts",
        "mostly between −10.0 and 10.0 mm/s",
        "What to do next",
        "What else was considered",
        "Provenance",
    )
    places = [text.find(piece) for piece in in_order]
    assert -1 not in places, dict(zip(in_order, places, strict=True))
    assert places == sorted(places)


def test_a_parameter_that_varies_between_records_is_shown_with_the_records_furthest_apart(made, pages):
    text = pages[MISSING][0].read_text(encoding="utf-8")
    assert "From record to record" in text
    ((symbol, before, after, apart),) = scatter(made[MISSING]).rows
    assert (symbol, after) == ("k_i", NONE)
    assert before.startswith("87.3 of 1 (9.4")
    assert apart.startswith("drop.csv") and "cart1.csv" in apart


def test_nothing_missing_is_said_plainly_and_nothing_is_asserted(pages):
    text = read(pages[ADEQUATE][0]).text
    assert "Nothing is missing beyond the noise" in text
    assert "none explains more than chance would" in text
    assert "0.24" in text
    for piece in ("Where it acts", "What it is", "augmented", "The shift is"):
        assert piece not in text.partition("Provenance")[0], piece


def test_what_is_undecided_says_so_and_asserts_nothing(made, pages):
    text = read(pages[UNDECIDED][0]).text
    assert "Undecided: the budget ended the search" in text
    assert "Warning: not finished: the budget of <5> minutes" in text
    assert f"without being asserted: {EFFECTS['cubic_stiffness'].summary}." in text
    for piece in ("What it is", "What was learned", "more than chance would"):
        assert piece not in text, piece
    assert 'class="verdict undecided"' in pages[UNDECIDED][0].read_text(encoding="utf-8")
    assert "Undecided: the model has not converged" in printed(dataclasses.replace(made[UNDECIDED], warnings=()))


def test_free_forms_are_drawn_in_the_unit_of_what_they_are(made):
    pictures = {image.name: image for image in draw(made[MISSING])}
    assert "No other free form raises the likelihood as much" in pictures["missing"].caption
    labels = [axes.get_ylabel() for axes in pictures["missing-others"].figure.axes if axes.axison]
    assert labels == ["(N)", "(N)", "(mm)", "(σ)"], "one that gains nothing is left out"
    assert "error of impact force over its own value (gains 2 % of the first)" in pictures["missing-others"].alt


def test_a_restless_rig_lacks_nothing_and_its_random_force_is_stated(made, pages):
    text = read(pages[RESTLESS][0]).text
    assert "No listed effect is missing, but a random force acts on the hammer" in text
    assert "random force on the hammer is 0.021 N rms" in text and "correlation time of 8.2 ms" in text
    for piece in ("Where it acts", "What it is", "What was learned", "augmented", "The shift is"):
        assert piece not in text.partition("Provenance")[0], piece
    assert "a random force acts on the hammer" in printed(made[RESTLESS])


def test_an_unlisted_cause_without_a_term_has_one_model(made, tmp_path):
    one = dataclasses.replace(made[UNLISTED], augmented=made[UNLISTED].nominal, free_form="")
    written = write_diagnosis_report(one, tmp_path)
    assert {"record-01-nominal.png", "record-02-nominal.png"} <= {path.name for path in written}
    text = read(written[0]).text
    assert "augmented" not in text and "learned" not in text and "more than chance would" not in text


def test_an_unlisted_cause_shows_what_was_learned(pages):
    text = read(pages[UNLISTED][0]).text
    assert "Something is missing that no listed effect explains" in text
    assert "force = −a1 u3 + a2 |u′| u′" in text
    assert "Where it acts" in text
    assert "What it is" not in text


def test_json_holds_no_number_that_json_does_not_know(made, tmp_path):
    odd = dataclasses.replace(
        changed(made[MISSING], interval=(float("-inf"), 1.0)),
        nominal=dataclasses.replace(made[MISSING].nominal, held_out_nrmse=float("nan")),
    )
    write_json(plain(odd.document(diagnosis_provenance(odd))), tmp_path / "diagnosis.json")
    read_back = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert read_back["location"]["interval"] == [None, 1.0]
    assert read_back["nominal"]["held_out_nrmse"] is None
    assert read_back["effects"][0]["parameters"]["friction_force"]["value"] == FRICTION
    assert {file: found["gap"] for file, found in read_back["augmented"]["records"].items()} == {
        r.file: r.gap for r in odd.augmented.records
    }
    assert read_back["provenance"]["versions"]["jax"]
    assert "mostly below 1000 mm/s" in read(write_diagnosis_report(odd, tmp_path)[0]).text


@pytest.mark.parametrize("verdict", VERDICTS)
def test_json_has_every_key_that_programs_read(made, verdict):
    """The names are fixed; a value that is not known is null, never left out."""
    document = made[verdict].document({"seed": 0})
    assert (document["schema"], document["verdict"], document["provenance"]) == (1, verdict, {"seed": 0})
    assert isinstance(document["ambiguous_with"], list) and isinstance(document["next_experiment"], str)
    assert document["ring_downs"].keys() == {"measured", "models", "left_out"}
    assert all(len(one["amplitude"]) for found in document["ring_downs"]["models"].values() for one in found)
    assert all({"chi2_reduced", "held_out_nrmse"} <= document[side].keys() for side in ("nominal", "augmented"))
    assert len(document["effects"]) == (verdict == MISSING)
    for effect in document["effects"]:
        assert {"name", "probability", "parameters"} <= effect.keys()
        assert all(number.keys() == {"value", "stderr", "unit"} for number in effect["parameters"].values())
    places = {"channel", "records", "phase", "coordinate", "interval", "time", "record", "sentence"}
    assert document["location"] is None if verdict in (ADEQUATE, RESTLESS) else places <= document["location"].keys()
    of_force = {"force_rms", "memory", "share", "share_of"}
    assert document["unrest"] is None if verdict != RESTLESS else of_force == document["unrest"].keys()
    assert verdict != RESTLESS or document["unrest"]["force_rms"] == {"value": 0.021, "stderr": 0.0015, "unit": "N"}
    assert document["reading_error"]["hammer_acceleration"] == {"rms": pytest.approx(0.051), "unit": "m/s^2", "order": 2}


def test_the_terminal_says_the_verdict_first_then_numbers_then_candidates(made):
    text = printed(made[MISSING])
    in_order = (
        "Missing: dry friction",
        "With it the misfit falls",
        "coulomb_friction",
        "augmented",
        "candidate",
        "2 more in the report",
        "next:",
    )
    places = [text.find(piece) for piece in in_order]
    assert -1 not in places and places == sorted(places)
    assert "⁻" not in text
    assert "Nothing is missing" in printed(made[ADEQUATE])
    assert "learned in its place: force = -a_1 u^3" in printed(made[UNLISTED])


def test_shifts_are_in_standard_errors_of_the_nominal_fit(made):
    rows = {symbol: numbers for symbol, *numbers in changes(made[MISSING]).rows}
    assert rows["n"][-1] == "−4.0 σ"
    assert (rows["F_c"][0], rows["F_c"][-1]) == ("–", "new")


@pytest.mark.parametrize("phase", ["contact", "all"])
def test_other_phases_are_drawn_where_they_are(made, phase):
    other = changed(made[MISSING], phase=phase, channel="impact_force")
    parts = [one.part.stop - one.part.start for one in stretches(other)]
    assert {one.channel for one in stretches(other)} == {"impact_force"}
    assert (max(parts) < 200) == (phase == "contact")
    assert len(draw(other)) == 7


def test_an_instant_is_shown_where_it_is(made):
    other = changed(made[MISSING], time=0.5, record="cart1.csv", interval=None, coordinate="time")
    (stretch,) = (one for one in stretches(other) if one.before.file == "cart1.csv")
    shown = stretch.before.time[stretch.part]
    assert shown[0] < 0.5 < shown[-1]
    assert "dashed line is the instant" in {image.name: image.caption for image in draw(other)}["residual-maps"]


def test_a_fault_of_one_channel_in_one_record_says_so(made, tmp_path):
    effect = GainError(factor=1.02, of_channel="impact_force")
    asserted = dataclasses.replace(made[MISSING].effects[0], effect=effect, parameters=())
    nominal = made[MISSING].nominal
    model = dataclasses.replace(nominal.model, effects=(effect,))
    diagnosis = dataclasses.replace(
        made[MISSING],
        effects=(asserted,),
        augmented=dataclasses.replace(made[MISSING].augmented, model=model, parameters=nominal.parameters),
    )
    text = read(write_diagnosis_report(diagnosis, tmp_path)[0]).text
    assert "a channel whose calibration factor is wrong (impact force)" in text


def test_little_is_known(made, tmp_path):
    bare = dataclasses.replace(
        changed(made[MISSING], profiles=(), maps={}, records={}, channels={}, interval=None),
        considered=(),
        ambiguous_with=(),
        warnings=(),
        next_experiment="",
    )
    text = read(write_diagnosis_report(bare, tmp_path)[0]).text
    assert "There was no candidate" in text
    assert printed(bare)


def test_channels_and_samples_may_be_missing(tmp_path):
    result = made_result(channels=("hammer_acceleration",), samples=700)
    holes = [
        dataclasses.replace(r, measured={c: np.where(np.arange(700) % 7 < 3, np.nan, v) for c, v in r.measured.items()})
        for r in result.records
    ]
    for verdict in VERDICTS:
        assert write_diagnosis_report(made_diagnosis(dataclasses.replace(result, records=tuple(holes)), verdict), tmp_path)


def test_numbers_with_a_power_of_ten_are_written_as_such():
    assert str(equation_html("-1.2e-03 u + 3e+5")) == "−1.2 × 10<sup>−3</sup> u + 3 × 10<sup>5</sup>"
    assert str(equation_html("0.141(19) N sin(2 pi 6.27(3) Hz t)")) == "0.141(19) N sin(2 π 6.27(3) Hz t)"
    assert str(equation_html("-2.0(1) N s/(m^2 s) u'")) == "−2.0(1) N s/(m<sup>2</sup> s) u′"


@pytest.mark.parametrize("name", list(EFFECTS))
def test_every_listed_equation_can_be_written(name):
    html = str(equation_html(EFFECTS[name].equation))
    assert html.count("<sub>") == html.count("</sub>")
    assert "_" not in html and "^" not in html and "'" not in html


def test_damping_is_drawn_of_the_nominal_and_the_augmented_model(made):
    with style():
        legend = next(iter(ring_downs_of_both(made[MISSING], SCREEN))).figure.axes[0].get_legend()
        names = [text.get_text() for text in legend.get_texts()]
    assert names == ["nominal model", "with coulomb friction", "measured"]


def test_records_without_a_decay_are_stated(pages):
    assert "No decay was read in cart1.csv: driven <throughout>" in read(pages[MISSING][0]).text
