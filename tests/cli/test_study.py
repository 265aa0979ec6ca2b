"""The study commands: what they hand on, and how they refuse."""

import sys
import types

import numpy as np
import pytest
import xarray as xr

from tests.batch.rigs import model
from tests.studies.made_fit import written_fit
from vibrojax.cli import main, study
from vibrojax.model_file import write_model
from vibrojax.studies.draws import read_fit


def call(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["vibrojax", *arguments])
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


@pytest.mark.parametrize("name", list(study.COMMANDS))
def test_every_command_has_help_with_its_example(monkeypatch, capsys, name):
    assert call(monkeypatch, name, "--help") == 0
    said = capsys.readouterr().out
    assert f"vibrojax {name} --model" in said
    assert all(option in said for option in ("--store", "--cluster", "--fit", "--draws", "--seed", "--tile", "--out", "--quiet"))


def test_values():
    np.testing.assert_allclose(study._values("--gaps", "0,1e-3"), [0.0, 1e-3])
    np.testing.assert_allclose(study._values("--ratios", "1:2:5"), np.linspace(1, 2, 5))
    assert study._values("--ratios", "3:9:1") == [3.0]


@pytest.mark.parametrize("text", ["1:2", "a,b", "1:2:0", "1:2:100000000000", ""])
def test_bad_values_end_in_one_line(monkeypatch, capsys, tmp_path, text):
    (tmp_path / "model.json").touch()
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", "--ratios", text, *rest) == 2
    assert f"error: --ratios is {text!r}: expected A:B:N" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_model_that_cannot_be_read_ends_in_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    (tmp_path / "no.json").write_text("{")
    rest = ("--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", "--model", str(tmp_path / "no.json"), *rest) == 2
    assert "is not valid JSON" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((), "neither --model nor --fit is given: expected one of the two"),
        (("--model", "m.json", "--fit", "fit"), "both --model and --fit are given: expected one of the two"),
        (("--model", "m.json", "--draws", "5"), "--draws is given without --fit"),
        (("--model", "m.json", "--cluster", "tcp://127.0.0.1:1"), "--cluster is given without --store"),
        (("--model", "m.json", "--tile", "64"), "--tile is given without --store"),
    ],
)
def test_options_that_do_not_go_together_end_in_one_line(monkeypatch, capsys, tmp_path, given, message):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    assert call(monkeypatch, "peterka", *given, "--base-amplitude", "1e-3", "--out", str(tmp_path / "out")) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if "loading JAX" not in line]
    assert len(said) == 1 and said[0].startswith("error: ") and message in said[0]
    assert not (tmp_path / "out").exists()


def test_a_study_lands_in_its_store_and_another_is_refused(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    write_model(model(), tmp_path / "model.json")
    store = ("--store", str(tmp_path / "a.zarr"), "--tile", "2")
    rest = (
        "--model",
        str(tmp_path / "model.json"),
        "--base-amplitude",
        "2e-3",
        "--gaps",
        "1e-3",
        "--cycles",
        "24",
        "--out",
        str(tmp_path / "o"),
    )
    assert call(monkeypatch, "response", "--frequencies", "5:7:3", *store, *rest) == 0
    ended = capsys.readouterr()
    assert "3 of 3 operating points" in ended.err and "response.nc and response.png" in ended.out
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == ["response.nc", "response.png"]
    assert call(monkeypatch, "response", "--frequencies", "5:8:3", *store, *rest) == 2
    assert "begun with other settings: axes.frequency_hz is [5.0, 6.0, 7.0] in the store, [5.0, 6.5, 8.0] now" in capsys.readouterr().err


def test_stages_are_shown_with_the_seconds_since_the_command_began(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    clock = [100.0]
    for module in ("vibrojax.cli.study", "vibrojax.cli.progress"):
        monkeypatch.setattr(f"{module}.time", types.SimpleNamespace(perf_counter=lambda: clock[-1]))
    facts = {"title": "map", "engine": "none", "lanes_that_failed": "{}"}
    monkeypatch.setattr("vibrojax.studies.run.make", lambda job: clock.append(100.3) or xr.Dataset(attrs=facts))
    monkeypatch.setattr("vibrojax.studies.write.write_study", lambda name, data, folder: [])
    write_model(model(), tmp_path / "model.json")
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", *rest) == 0
    told = {line.split(" s  ")[1]: float(line.split(" s  ")[0]) for line in capsys.readouterr().err.splitlines()}
    assert told == {"loading JAX": 0.0, "integrating": 0.0, "drawing": 0.3}


def test_a_scheduler_that_does_not_answer_ends_in_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    monkeypatch.setattr("vibrojax.cli.cluster._PATIENCE", 1)
    write_model(model(), tmp_path / "model.json")
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", "--cluster", "tcp://127.0.0.1:9", "--store", str(tmp_path / "a.zarr"), *rest) == 2
    assert "no Dask scheduler answers at 'tcp://127.0.0.1:9'" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]


def test_a_study_over_draws_of_a_fit(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    written_fit(tmp_path)
    rest = (
        "--base-amplitude",
        "2e-3",
        "--gaps",
        "1e-3",
        "--frequencies",
        "5:7:3",
        "--cycles",
        "24",
        "--out",
        str(tmp_path / "o"),
        "--quiet",
    )
    assert call(monkeypatch, "response", "--fit", str(tmp_path), "--draws", "2", "--seed", "7", *rest) == 0
    assert capsys.readouterr() == ("", "")
    with xr.open_dataset(tmp_path / "o" / "response.nc", engine="scipy") as found:
        np.testing.assert_allclose(found["drawn"], read_fit(tmp_path).draw(2, seed=7).values)
        assert found["impact_force"].dims == ("quantile", "gap", "frequency_hz")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--gap", "1e-3", "--frequency", "7"), "--base-amplitude is missing: expected --base-amplitude and --gap and --frequency"),
        (("--base-amplitude", "1e-3", "--frequency", "7"), "--gap is missing"),
        (("--base-amplitude", "1e-3", "--gap", "1e-3", "--along", "gap=1e-3:2e-3:5"), "--gap is given beside --along gap"),
        (("--base-amplitude", "1e-3", "--along", "gap=1e-3:2e-3:5"), "--frequency is missing"),
        (("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap"), "--along is 'gap': expected NAME=A:B:N"),
        (
            ("--base-amplitude", "1e-3", "--gap", "1e-3", "--frequency", "7", "--along", "frequency=1:2:5"),
            "--frequency is given beside --along frequency",
        ),
        (("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap=3"), "gap has 1 values: expected at least 3 that increase"),
        (("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap=1:2"), "--along is '1:2': expected A:B:N"),
        (("--base-amplitude", "1e-3", "--gap", "1e-3", "--frequency", "7", "--along", "spin=1:2:5"), "unknown setting 'spin'"),
    ],
)
def test_basins_ask_for_the_operating_point_but_for_what_they_follow(monkeypatch, capsys, tmp_path, given, message):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    write_model(model(), tmp_path / "model.json")
    rest = ("--displacements", "0:1e-3:3", "--velocities", "0:0.1:3", "--model", str(tmp_path / "model.json"), "--out", str(tmp_path / "o"))
    assert call(monkeypatch, "basins", *given, *rest, "--quiet") == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and message in said[0] and not (tmp_path / "o").exists()


def test_basins_say_what_they_found(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    write_model(model(), tmp_path / "model.json")
    plane = ("--displacements=-2e-3:2e-3:4", "--velocities=-0.2:0.3:4", "--cycles", "100")
    rest = (*plane, "--model", str(tmp_path / "model.json"), "--base-amplitude", "2e-3")
    assert call(monkeypatch, "basins", "--frequency", "7", "--gap", "4e-3", *rest, "--out", str(tmp_path / "o")) == 0
    said = capsys.readouterr().out
    assert "2 attractors: " in said and "no impact takes" in said and "z = 1/1 takes" in said
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == ["basins.json", "basins.nc", "basins.png"]
    follow = ("basins", "--frequency", "7", "--along", "gap=3.8e-3:4.2e-3:3")
    assert call(monkeypatch, *follow, *rest, "--out", str(tmp_path / "a"), "--quiet") == 0
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["basins_along.json", "basins_along.nc", "basins_along.png"]
