"""Recipes: what comes with the project is consistent, raw layouts are read, wrong recordings are refused, real ones are fitted."""

import dataclasses
import hashlib

import numpy as np
import pytest
from scipy.io import savemat

from identification.estimation.estimate import fit_experiment
from identification.experiment import ExperimentError, load_experiment
from identification.recipes import layouts
from identification.recipes.layouts import RAW_READERS, Cut
from identification.recipes.load import Recipe, find_recordings, load_recipe, read_recipe, recipe_experiment, recipe_names
from vibrojax.errors import InputError

RECIPES = recipe_names()


def cut(source: str, start: float, stop: float, **options) -> Cut:
    return Cut(file="record.npz", source=source, start=start, stop=stop, options=options)


@pytest.fixture(scope="session")
def recordings(shared):
    folder = shared / "recordings"
    if not folder.is_dir():
        pytest.skip("needs the shared recordings")
    return folder


@pytest.fixture
def made(tmp_path) -> Recipe:
    """A recipe and its recording, both made here."""
    folder, data = tmp_path / "toy", tmp_path / "data" / "toy-set"
    folder.mkdir()
    data.mkdir(parents=True)
    t = np.arange(200) / layouts.SILVERBOX_HZ
    savemat(data / "raw.mat", {"V1": np.sin(90.0 * t)[None] + 3.0, "V2": np.cos(70.0 * t)[None] - 1.0})
    digest = hashlib.sha256((data / "raw.mat").read_bytes()).hexdigest()
    (folder / "experiment.toml").write_text(
        'schema = 1\n[experiment]\nname = "toy"\n[hammer]\nmass = 1.0\n[suspension]\nkind = "linear"\n'
        '[sensors.hammer_displacement]\nunit = "V"\n[sensors.applied_force]\nunit = "V"\n[[record]]\nfile = "a.npz"\nkind = "forced"\n'
        'gap = 9.0\ncolumns = { hammer_displacement = "output", applied_force = "input" }\n'
    )
    (folder / "recipe.toml").write_text(
        'schema = 1\ntitle = "Toy"\norigin = "https://example.org/toy"\nlicence = "none"\ncitation = "nobody"\nobtain = "Ask."\n'
        'expect = "little"\n'
        f'reader = "silverbox"\ndata_folder = "toy-set"\n[[file]]\npath = "raw.mat"\nsha256 = "{digest}"\n'
        '[[record]]\nfile = "a.npz"\nsource = "raw.mat"\nstart = 0.1\nstop = 0.2\n'
    )
    return read_recipe(folder)


@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_is_consistent(name):
    recipe = load_recipe(name)
    assert recipe.reader in RAW_READERS
    assert {cut.source for cut in recipe.cuts} == set(recipe.sha256)
    assert all(len(digest) == 64 for digest in recipe.sha256.values())
    declared = load_experiment_records(recipe)
    assert declared == [cut.file for cut in recipe.cuts]
    assert (recipe.folder / "README.md").is_file()


def load_experiment_records(recipe: Recipe) -> list[str]:
    import tomllib

    return [record["file"] for record in tomllib.loads((recipe.folder / "experiment.toml").read_text(encoding="utf-8"))["record"]]


def test_an_unknown_recipe_lists_the_known_ones():
    with pytest.raises(InputError, match=r"unknown recipe 'billiards': expected one of airtrack_collisions, airtrack_fast, .*silverbox"):
        load_recipe("billiards")


@pytest.mark.parametrize("folder", ["data", "data/toy-set"])
def test_the_data_set_is_found_in_its_folder_or_above(made, tmp_path, folder):
    assert find_recordings(made, tmp_path / folder) == tmp_path / "data" / "toy-set"


def test_a_missing_recording_is_named_with_its_origin(made, tmp_path):
    with pytest.raises(InputError, match=r"lacks 1 of 1 files of recipe 'toy', the first 'raw.mat': get .* https://example.org/toy"):
        find_recordings(made, tmp_path)


def test_another_recording_is_refused(made, tmp_path):
    (tmp_path / "data" / "toy-set" / "raw.mat").write_bytes(b"something else")
    with pytest.raises(InputError, match=r"raw.mat is not the file that recipe 'toy' was written for \(sha256 "):
        find_recordings(made, tmp_path / "data")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("schema = 1", "schema = 2", "schema in toy/recipe.toml is 2: expected 1"),
        ('title = "Toy"\n', "", "title is missing in toy/recipe.toml"),
        ("[[file]]", "[[files]]", "unknown key 'files' in toy/recipe.toml"),
        ("start = 0.1", "", "start is missing in a record of toy/recipe.toml"),
    ],
)
def test_a_faulty_recipe_is_refused(made, old, new, message):
    file = made.folder / "recipe.toml"
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(ExperimentError, match=message):
        read_recipe(made.folder)


def test_a_recipe_becomes_an_experiment_and_leaves_nothing(made, tmp_path):
    with recipe_experiment(made, tmp_path / "data") as folder:
        (record,) = load_experiment(folder).records
    assert record.time[0] == 0.0
    assert record.time.size == np.floor(0.2 * layouts.SILVERBOX_HZ) - np.ceil(0.1 * layouts.SILVERBOX_HZ) + 1
    assert set(record.channels) == {"hammer_displacement", "applied_force"}
    assert not folder.exists()


def test_lost_markers_become_nan(tmp_path):
    rows = ["NO_OF_FRAMES\t6", "b X\tb Y\tb Z\ta X\ta Y\ta Z\t"]
    cells = ["200.0", "", "0.000", "lost", "190.0", "188.0"]
    rows += [f"{cell}\t0\t0\t-100.0\t0\t0" for cell in cells]
    (tmp_path / "m.tsv").write_text("\n".join(rows))
    columns = layouts.air_track(tmp_path, cut("m.tsv", 0.0, 0.0081))
    np.testing.assert_allclose(columns["closing"], [-300.0, np.nan, np.nan, np.nan, -290.0])
    np.testing.assert_allclose(columns["time"], 0.002 * np.arange(5), atol=1e-12)


def test_a_table_without_riders_is_refused(tmp_path):
    (tmp_path / "m.tsv").write_text("a X\ta Y\n1\t2\n")
    with pytest.raises(InputError, match="m.tsv has no line with the columns a X, b X"):
        layouts.air_track(tmp_path, cut("m.tsv", 0.0, 1.0))


def test_the_nose_is_the_body_less_the_compression(tmp_path):
    t = np.arange(3000) * layouts.STEP_S
    moving = np.where(t > 0.02, t - 0.02, 0.0)
    compression_um = np.round(40.0 + 5e5 * moving**2)  # 1 m/s^2
    counts = np.zeros((3, t.size), np.int16)
    counts[layouts.AXIAL] = 7
    run = {"run/t0_us": 0, "run/pos_um": compression_um.astype(np.int16), "run/acc_counts": counts}
    np.savez(tmp_path / "drops.npz", **run)
    columns = layouts.cyberdiver(tmp_path, cut("drops.npz", 0.03, 0.05, run="run", rest=[0.0, 0.015], every=5))
    assert columns["time"][1] == pytest.approx(1e-4)
    np.testing.assert_allclose(columns["compression"], 0.5e3 * (columns["time"] + 0.01) ** 2, atol=2e-3)
    np.testing.assert_allclose(columns["body"], 0.0, atol=1e-12)
    np.testing.assert_allclose(columns["nose"], -1.0, atol=3.0)
    assert columns["nose"].mean() == pytest.approx(-1.0, abs=0.1)


def test_strokes_are_read_with_their_force(tmp_path):
    t = np.arange(4096) / 1024.0
    table = np.stack([t, np.sin(t), np.cos(t), 0 * t, 0 * t, 0 * t], axis=1).astype(np.float32)
    np.savez(tmp_path / "tests.npz", **{"slow": table})
    columns = layouts.friction_backlash(tmp_path, cut("tests.npz", 1.0, 2.0, test="slow", every=4))
    assert len(columns["time"]) == 257
    np.testing.assert_allclose(columns["stroke"], np.sin(columns["time"] + 1.0), atol=1e-6)
    np.testing.assert_allclose(columns["force"], np.cos(columns["time"] + 1.0), atol=1e-6)


def test_what_the_amplifiers_read_before_the_hit_is_taken_off(tmp_path):
    t = np.arange(2000) / layouts.PCB_HZ
    hit = np.where(np.arange(2000) == 1200, 100.0, 0.0)
    np.savez(tmp_path / "table.npz", **{"one": np.stack([hit + 3.0, 2.0 * hit - 5.0], axis=1).astype(np.float32)})
    columns = layouts.pcb_shock(tmp_path, cut("table.npz", t[1190] - 1e-6, t[1210] + 1e-6, test="one"))
    assert len(columns["time"]) == 21
    assert (columns["table"][10], columns["board"][10]) == (pytest.approx(100.0), pytest.approx(200.0))
    assert np.abs(np.delete(columns["board"], 10)).max() < 1e-5


def test_segments_of_a_swing_follow_each_other(tmp_path):
    """Angles count from hanging, which the encoder counts as half a turn."""
    t = np.arange(400) / 1000.0
    parts = np.split(t, 4)

    def cells(arrays):
        column = np.empty((len(arrays), 1), object)
        column[:, 0] = arrays
        return column

    swings = [np.stack([np.pi + part, 0 * part]) for part in parts]
    file = {"Time_id": cells(parts[:3]), "Time_vad": cells(parts[3:]), "Y_id": cells(swings[:3]), "Y_vad": cells(swings[3:])}
    savemat(tmp_path / "segments.mat", file)
    columns = layouts.pendulum(tmp_path, cut("segments.mat", 0.05, 0.3505, every=10))
    np.testing.assert_allclose(columns["angle"], 0.05 + 0.01 * np.arange(31), atol=1e-12)
    np.testing.assert_allclose(columns["time"], 0.01 * np.arange(31), atol=1e-12)


def test_one_swing_is_read_from_its_own_structure(tmp_path):
    t = 60.0 + np.arange(100) / 1e4
    signals = {"values": (np.pi + 0.1 * t)[:, None], "dimensions": 1, "label": ""}
    savemat(tmp_path / "swing.mat", {"Theta1": {"time": t[:, None], "signals": signals, "blockName": ""}})
    columns = layouts.pendulum(tmp_path, cut("swing.mat", 60.0, 61.0, every=2))
    np.testing.assert_allclose(columns["angle"], 0.1 * (60.0 + columns["time"]), atol=1e-9)
    assert len(columns["time"]) == 50


def test_a_swing_is_read_from_its_lines(tmp_path):
    (tmp_path / "swing.txt").write_text(
        "trigger_start_deg, sample_rate, duration_sec\n90, 500, 1 \n" + "".join(f"{0.5 * i}\n" for i in range(500))
    )
    columns = layouts.free_swing(tmp_path, cut("swing.txt", 0.1, 0.2))
    np.testing.assert_allclose(columns["angle"], 25.0 + 0.5 * np.arange(51))
    np.testing.assert_allclose(columns["time"], 0.002 * np.arange(51), atol=1e-12)


def test_a_table_is_read_by_its_header(tmp_path):
    (tmp_path / "run.csv").write_text("time,position,torque\n" + "".join(f"{0.5 * i},{2 * i},{-i}\n" for i in range(9)))
    columns = layouts.table(tmp_path, cut("run.csv", 1.0, 2.5))
    assert {name: values.tolist() for name, values in columns.items()} == {
        "time": [0.0, 0.5, 1.0, 1.5],
        "position": [4.0, 6.0, 8.0, 10.0],
        "torque": [-2.0, -3.0, -4.0, -5.0],
    }


@pytest.mark.parametrize("name", RECIPES)
def test_real_recordings_load(recordings, name):
    recipe = load_recipe(name)
    with recipe_experiment(recipe, recordings) as folder:
        experiment = load_experiment(folder)
    assert len(experiment.records) == len(recipe.cuts)
    assert all(np.isfinite(values).mean() > 0.9 for record in experiment.records for values in record.channels.values())


def fitted(recordings, name: str, records: slice):
    with recipe_experiment(load_recipe(name), recordings) as folder:
        experiment = load_experiment(folder)
    result = fit_experiment(dataclasses.replace(experiment, records=experiment.records[records]))
    assert result.converged
    return result


def value(result, name: str) -> float:
    return next(row.value for row in (*result.parameters, *result.derived) if getattr(row, "spec", row).name == name)


def test_a_programmed_spring_and_damper_are_found(recordings):
    result = fitted(recordings, "cyberdiver_damped", slice(0, 1))
    assert value(result, "k") == pytest.approx(15_000.0, rel=0.05)
    assert value(result, "c") == pytest.approx(23.4, rel=0.25)


@pytest.mark.thorough
def test_an_electronic_oscillator_is_found_and_its_cubic_spring_shows_as_misfit(recordings):
    result = fitted(recordings, "silverbox", slice(1, 2))
    assert value(result, "f_n") == pytest.approx(69.0, abs=1.5)
    assert result.chi2_reduced > 10.0


def test_a_rubber_band_is_fitted_and_said_to_be_fitted_to_a_random_force(recordings):
    result = fitted(recordings, "airtrack_rubber", slice(3, 9, 2))
    assert value(result, "lambda_i") == pytest.approx(0.7, abs=0.3)
    assert result.unrest is not None
    assert any("random force" in warning for warning in result.warnings)


@pytest.mark.thorough
def test_a_friction_damper_is_no_spring_and_damper(recordings):
    result = fitted(recordings, "friction_backlash", slice(None))
    assert value(result, "k") == pytest.approx(2.2e5, rel=0.2)
    assert all(record.nrmse["reaction_force"] > 0.3 for record in (*result.records, *result.held_back))


@pytest.mark.thorough
def test_a_board_on_a_drop_table_is_found_from_accelerations(recordings):
    result = fitted(recordings, "pcb_shock", slice(0, 3))
    assert value(result, "f_n") == pytest.approx(4136.0, rel=0.01)
    assert [record.file for record in result.held_back] == ["shock-03.npz"]
    assert result.held_back[0].nrmse["hammer_acceleration"] == pytest.approx(result.records[0].nrmse["hammer_acceleration"], abs=0.03)


@pytest.mark.thorough
def test_viscous_damping_does_not_predict_the_end_of_a_swing(recordings):
    result = fitted(recordings, "multiarm_pendulum", slice(None))
    assert value(result, "f_n") == pytest.approx(1.2737, rel=1e-3)
    assert max(record.nrmse["relative_displacement"] for record in result.records) < 0.01
    errors = {record.file: record.nrmse["relative_displacement"] for record in result.held_back}
    assert errors["swing-32deg.npz"] < errors["swing-23deg.npz"] < errors["swing-to-rest.npz"]
    assert errors["swing-to-rest.npz"] > 0.3
