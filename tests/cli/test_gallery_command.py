"""`vibrojax gallery`: the plates of presets and models, the page, and refusals in one line."""

import re
import sys
import tomllib

import numpy as np
import pytest

from vibrojax import gallery
from vibrojax.cli import gallery as command
from vibrojax.cli import main
from vibrojax.contact import HuntCrossley
from vibrojax.data_files import data_path
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.gallery import Made, Plate, make_gallery, model_plates, preset_plates
from vibrojax.model import Model
from vibrojax.model_file import write_model
from vibrojax.presets import NAMES, read_preset
from vibrojax.studies.job import STUDIES, Job
from vibrojax.suspension import Free, Linear

RIG = Model(1.0, Linear(0.05, 5.0), HuntCrossley(1e6, 1.5, 0.3))


def call(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["vibrojax", "gallery", *arguments])
    monkeypatch.setattr("vibrojax.cli.gallery.prepare_jax", lambda: None)
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


def test_the_studies_that_the_command_names_are_all():
    assert set(command._STUDIES) == {*STUDIES, "continue"} - {"basins_along"}


@pytest.mark.parametrize("name", NAMES)
def test_every_row_of_a_preset_is_a_plate_of_its_own(name):
    rows = [row for row in tomllib.loads(data_path("gallery.toml").read_text())["figure"] if row["preset"] == name]
    preset = read_preset(name)
    plates = preset_plates(preset)
    assert [plate.answers for plate in plates] == [row["answers"] for row in rows]
    assert len({plate.stem for plate in plates}) == len(plates)
    stated = {row["name"] for row in tomllib.loads(data_path("thesis", f"{preset.thesis}.toml").read_text())["value"]}
    assert {row for plate in plates for row in plate.stated} <= stated
    for plate in plates:
        if plate.study != "continue":
            Job(study=plate.study, model=preset.model(), axes=plate.axes, settings=plate.settings)


def test_every_basin_that_is_stated_has_a_plate():
    for name in NAMES:
        rows = {row["name"]: row for row in tomllib.loads(data_path("thesis", f"{read_preset(name).thesis}.toml").read_text())["value"]}
        prefix = f"basin_{name[-3:]}" if name.startswith("beam") else "basin"
        points = {
            (row["value"], rows[key.replace("frequency", "gap")]["value"])
            for key, row in rows.items()
            if re.fullmatch(rf"{prefix}_\d_frequency_ratio", key) and name != "drilling_hammer"
        }
        f_n = read_preset(name)["natural_frequency_hz"]
        amplitude = read_preset(name)["base_amplitude"]
        basins = [plate.settings for plate in preset_plates(read_preset(name)) if plate.study == "basins"]
        found = {(round(one["frequency_hz"] / f_n, 6), round(one["gap"] / amplitude, 6)) for one in basins}
        assert found == points


def test_a_motion_that_a_start_from_rest_misses_starts_on_the_rigid_stops():
    plates = {plate.stem: plate for plate in preset_plates(read_preset("wires"))}
    assert plates["section_gap-0mm_ratio-3.8"].settings["u0"] == 0.0
    on_band = plates["section_gap-1mm_ratio-3.3"].settings
    assert on_band["u0"] != 0.0 and abs(on_band["u0"]) < 0.1


def test_a_model_has_every_study_and_design_where_its_spring_stays():
    plates = model_plates(RIG, base_amplitude=1e-3, gaps=[0.0, 1e-3])
    assert {plate.study for plate in plates} == {*STUDIES, "continue"} - {"basins_along"}
    assert len({plate.stem for plate in plates}) == len(plates)
    with pytest.raises(InputError, match="a gallery needs a natural frequency"):
        model_plates(Model(1.0, Free(), HuntCrossley(1e6, 1.5, 0.3)), base_amplitude=1e-3, gaps=[0.0])


def test_a_gallery_is_a_page_with_its_figures(tmp_path):
    point = dict(base_amplitude=1e-3, gap=1e-3, frequency_hz=7.0, strobes=20, transient=20)
    good = Plate(
        stem="section_one", study="section", axes={}, settings=point, answers="3.16 and 3.17", caption="Poincaré map", stated=("k_i",)
    )
    branch = Plate(
        stem="branch_one",
        study="continue",
        axes=dict(frequency=(4.2, 4.5)),
        settings=dict(base_amplitude=1e-3, gap=3e-3, at=4.2, start=(0.0, 0.0)),
    )
    said = []
    made = make_gallery(RIG, [good, branch], tmp_path, title="Rig B", thesis="figure_3_3", progress=said.append)
    assert said == ["1 of 2: section_one", "2 of 2: branch_one"] and not any(one.failed for one in made)
    text = (tmp_path / "index.md").read_text()
    assert text.startswith("# Rig B\n")
    assert '- Thesis: figures 3.16 and 3.17, "Poincaré map".' in text
    assert "k_i = 2.1e+08" in text and "grazing at 4.363 Hz" in text
    for target in re.findall(r"\]\(([^)]+)\)", text):
        assert (tmp_path / target).is_file()


def test_a_figure_that_cannot_be_made_is_named_with_the_reason(tmp_path, monkeypatch):
    def fails(job):
        raise NoConvergenceError("chatter on a rigid stop")

    monkeypatch.setattr(gallery, "make", fails)
    plate = Plate(stem="peterka", study="peterka", axes=dict(ratio=[1.0], clearance=[1.0]), settings=dict(base_amplitude=1e-3))
    assert make_gallery(RIG, [plate], tmp_path, title="Rig")[0].failed
    text = (tmp_path / "index.md").read_text()
    assert "Not made: chatter on a rigid stop." in text and "peterka.png" not in text


def test_the_command_makes_only_the_studies_that_are_asked_for(tmp_path, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(
        "vibrojax.gallery.make_gallery", lambda model, plates, folder, **how: asked.append((plates, how)) or [Made(plates[0], "")]
    )
    assert call(monkeypatch, "beam_150", "--only", "basins", "--style", "paper", "--out", str(tmp_path / "out"), "--quiet") == 0
    (plates, how) = asked[0]
    assert [plate.study for plate in plates] == ["basins", "basins"]
    assert how["look"].name == "paper" and how["thesis"] == "rig_beam"
    write_model(RIG, tmp_path / "model.json")
    given = (str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--gap", "0,1e-3", "--out", str(tmp_path / "two"), "--quiet")
    assert call(monkeypatch, *given) == 0
    np.testing.assert_allclose(asked[1][0][0].axes["gap"], [0.0, 1e-3])


def test_a_gallery_without_any_figure_ends_with_status_3_and_leaves_the_reasons(tmp_path, monkeypatch, capsys):
    def fails(job):
        raise NoConvergenceError("chatter on a rigid stop")

    monkeypatch.setattr(gallery, "make", fails)
    assert call(monkeypatch, "beam_150", "--only", "basins", "--out", str(tmp_path / "out"), "--quiet") == 3
    assert "no figure of beam_150 could be made" in capsys.readouterr().err
    assert "Not made: chatter on a rigid stop." in (tmp_path / "out" / "index.md").read_text()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("wires", "--gap", "0"), "wires has its own A0 and gaps"),
        (("wire",), "wire cannot be read (no such file): expected a model.json, or one of the presets wires, "),
        (("{model}", "--gap", "0"), "--base-amplitude or --gap is missing: expected both beside a model.json"),
        (("drilling_hammer", "--only", "basins"), "drilling_hammer has no figure of basins"),
        (("wires", "--only", "map"), "'map' is no study"),
    ],
)
def test_bad_input_is_refused(tmp_path, monkeypatch, capsys, given, message):
    monkeypatch.setenv("COLUMNS", "300")
    write_model(RIG, tmp_path / "model.json")
    given = [part.format(model=tmp_path / "model.json") for part in given]
    assert call(monkeypatch, *given, "--out", str(tmp_path / "out"), "--quiet") == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
