"""The study commands: what they hand on, and how they refuse."""

import sys
import types

import numpy as np
import pytest
import xarray as xr

from tests.batch.rigs import model
from tests.studies.made_fit import written_fit
from vibrojax.cli import grammar, main, options, study
from vibrojax.model_file import write_model
from vibrojax.presets import NAMES, read_preset
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
    assert all(option in said for option in ("--preset", "--sweep", "--gap", "--frequency", "--vary", "--style", "--base-amplitude"))
    assert all(option in said for option in ("--store", "--cluster", "--fit", "--draws", "--seed", "--tile", "--out", "--quiet"))


def test_values():
    np.testing.assert_allclose(grammar.values("--gap", "0,1e-3"), [0.0, 1e-3])
    np.testing.assert_allclose(grammar.values("--sweep", "1:2:5"), np.linspace(1, 2, 5))
    assert grammar.values("--sweep", "3:9:1") == [3.0]


@pytest.mark.parametrize("text", ["1:2", "a,b", "1:2:0", "1:2:100000000000", ""])
def test_bad_values_end_in_one_line(monkeypatch, capsys, tmp_path, text):
    (tmp_path / "model.json").touch()
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", "--sweep", text, *rest) == 2
    assert f"error: --sweep is {text!r}: expected {'A:B:N' if text else 'NAME=VALUES'}" in capsys.readouterr().err
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
        ((), "none of --model, --preset and --fit is given: expected one of them"),
        (("--model", "m.json", "--fit", "fit"), "both --model and --fit are given: expected one of them"),
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
    assert call(monkeypatch, "response", "--sweep", "5:7:3", *store, *rest) == 0
    ended = capsys.readouterr()
    assert "3 of 3 operating points" in ended.err and "response.nc and response.png" in ended.out
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == [
        f"response.{suffix}" for suffix in ("md", "nc", "pdf", "png", "svg")
    ]
    assert call(monkeypatch, "response", "--sweep", "5:8:3", *store, *rest) == 2
    assert "begun with other settings: axes.frequency_hz is [5.0, 6.0, 7.0] in the store, [5.0, 6.5, 8.0] now" in capsys.readouterr().err


def test_stages_are_shown_with_the_seconds_since_the_command_began(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    clock = [100.0]
    for module in ("vibrojax.cli.study", "vibrojax.cli.progress"):
        monkeypatch.setattr(f"{module}.time", types.SimpleNamespace(perf_counter=lambda: clock[-1]))
    facts = {"title": "map", "engine": "none", "lanes_that_failed": "{}"}
    monkeypatch.setattr("vibrojax.studies.run.make", lambda job: clock.append(100.3) or xr.Dataset(attrs=facts))
    monkeypatch.setattr("vibrojax.studies.finding.finding", lambda name, data: "found")
    monkeypatch.setattr("vibrojax.studies.write.write_study", lambda name, data, folder, **how: [])
    write_model(model(), tmp_path / "model.json")
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--out", str(tmp_path / "out"))
    assert call(monkeypatch, "peterka", *rest) == 0
    told = {line.split(" s  ")[1]: float(line.split(" s  ")[0]) for line in capsys.readouterr().err.splitlines()}
    assert told == {"loading JAX": 0.0, "integrating": 0.0, "drawing": 0.3}


def test_a_scheduler_that_does_not_answer_ends_in_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    monkeypatch.setattr("vibrojax.cli.environment._PATIENCE", 1)
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
        "--sweep",
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
        (("--gap", "1e-3", "--frequency", "7"), "--base-amplitude is missing"),
        (("--base-amplitude", "1e-3", "--frequency", "7"), "--gap is missing"),
        (("--base-amplitude", "1e-3", "--gap", "1e-3", "--frequency", "7", "--along", "gap=1e-3:2e-3:5"), "--gap is given, but"),
        (("--base-amplitude", "1e-3", "--along", "gap=1e-3:2e-3:5"), "--frequency is missing"),
        (("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap"), "--along is 'gap': expected NAME=A:B:N"),
        (("--base-amplitude", "1e-3", "--gap", "1e-3", "--frequency", "7", "--along", "frequency=1:2:5"), "--frequency is given, but"),
        (("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap=3"), "gap has 1 values: expected at least 3 that increase"),
        (("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap=1:2"), "--along is '1:2': expected A:B:N"),
        (("--base-amplitude", "1e-3", "--gap", "1e-3", "--frequency", "7", "--along", "spin=1:2:5"), "unknown setting 'spin'"),
        (
            ("--base-amplitude", "1e-3", "--frequency", "7", "--along", "gap=1e-3:2e-3:5", "--manifolds", "1"),
            "--manifolds is given with --along: expected one picture of one model; leave one of them out",
        ),
    ],
)
def test_basins_ask_for_the_operating_point_but_for_what_they_follow(monkeypatch, capsys, tmp_path, given, message):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    write_model(model(), tmp_path / "model.json")
    rest = ("--sweep", "u0=0:1e-3:3", "--sweep", "v0=0:0.1:3", "--model", str(tmp_path / "model.json"), "--out", str(tmp_path / "o"))
    assert call(monkeypatch, "basins", *given, *rest, "--quiet") == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and message in said[0] and not (tmp_path / "o").exists()


def test_basins_say_what_they_found(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    write_model(model(), tmp_path / "model.json")
    plane = ("--sweep", "u0=-2e-3:2e-3:4", "--sweep", "v0=-0.2:0.3:4", "--cycles", "100")
    rest = (*plane, "--model", str(tmp_path / "model.json"), "--base-amplitude", "2e-3")
    assert call(monkeypatch, "basins", "--frequency", "7", "--gap", "4e-3", *rest, "--out", str(tmp_path / "o")) == 0
    said = capsys.readouterr().out
    assert "2 attractors: " in said and "no impact takes" in said and "z = 1/1 takes" in said
    assert {path.suffix for path in (tmp_path / "o").iterdir()} == {".json", ".nc", ".png", ".pdf", ".svg", ".md"}
    with_curves = ("basins", "--frequency", "7", "--gap", "4e-3", "--manifolds", "1")
    assert call(monkeypatch, *with_curves, *rest, "--out", str(tmp_path / "m")) == 0
    heard = capsys.readouterr()
    assert "1 saddle of 1 cycle: z = 1/1 at" in heard.out and "manifolds of saddle 1 of 1: branch 2 of 2" in heard.err
    assert (tmp_path / "m" / "manifolds.csv").read_text().startswith("curve,saddle,manifold,u_m,v_m_per_s\n1,1,stable,")
    follow = ("basins", "--frequency", "7", "--along", "gap=3.8e-3:4.2e-3:3")
    assert call(monkeypatch, *follow, *rest, "--out", str(tmp_path / "a"), "--quiet") == 0
    assert {path.name for path in (tmp_path / "a").iterdir()} >= {"basins_along.json", "basins_along.nc", "basins_along.png"}


def asked(monkeypatch, tmp_path, *arguments: str):
    """The jobs of a command line, and its exit status; nothing is integrated."""
    monkeypatch.setattr("vibrojax.cli.study.prepare_jax", lambda: None)
    facts = {"title": "study", "engine": "none", "lanes_that_failed": "{}"}
    jobs, stems = [], []
    monkeypatch.setattr("vibrojax.studies.run.make", lambda job: jobs.append(job) or xr.Dataset(attrs=facts))
    monkeypatch.setattr(
        "vibrojax.studies.write.write_study", lambda name, data, folder, *, look, stem: stems.append((stem, look.name)) or []
    )
    monkeypatch.setattr("vibrojax.studies.finding.finding", lambda name, data: "what was found")
    status = call(monkeypatch, *arguments, "--out", str(tmp_path / "out"))
    return status, jobs, stems


def test_the_presets_that_the_command_line_lists_are_all():
    assert options.PRESETS == NAMES


def test_a_preset_takes_the_place_of_model_amplitude_and_gaps(monkeypatch, tmp_path, capsys):
    arguments = ("bifurcation", "--preset", "wires", "--sweep", "frequency=2:4:5", "--style", "paper")
    status, jobs, stems = asked(monkeypatch, tmp_path, *arguments)
    assert status == 0
    preset = read_preset("wires")
    assert [job.settings["gap"] for job in jobs] == list(preset.gaps)
    assert {job.settings["base_amplitude"] for job in jobs} == {preset["base_amplitude"]}
    assert stems == [("bifurcation_gap-0", "paper"), ("bifurcation_gap-0.001", "paper"), ("bifurcation_gap-0.0024", "paper")]
    assert capsys.readouterr().out.count("what was found") == 3


@pytest.mark.parametrize(
    ("given", "axes"),
    [
        (("peterka", "--sweep", "1:2:2", "--sweep", "clearance=0:1:2"), {"ratio": [1.0, 2.0], "clearance": [0.0, 1.0]}),
        (
            ("basins", "--sweep", "u0=-1e-3,0", "--sweep", "v0=-1,1", "--gap", "0", "--frequency", "7"),
            {"u0": [-1e-3, 0.0], "v0": [-1.0, 1.0]},
        ),
        (("lyapunov", "--sweep", "3:5:2", "--gap", "0"), {"values": [3.0, 5.0]}),
        (("design", "--sweep", "1:2:2", "--frequency", "3,4.5", "--gap", "0"), {"mass_ratio": [1.0, 2.0], "frequency_hz": [3.0, 4.5]}),
    ],
)
def test_axes_take_their_values(monkeypatch, tmp_path, given, axes):
    write_model(model(), tmp_path / "model.json")
    status, [job], _ = asked(monkeypatch, tmp_path, *given, "--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3")
    assert (status, {name: values.tolist() for name, values in job.axes.items()}) == (0, axes)


def test_a_parameter_alone_is_swept_over_the_range_of_the_preset(monkeypatch, tmp_path):
    status, [job], _ = asked(monkeypatch, tmp_path, "bifurcation", "--preset", "wires", "--frequency", "7", "--sweep", "gap")
    low, high = read_preset("wires").ranges["gap"]
    assert status == 0
    assert (job.settings["parameter"], job.axes["values"][0], len(job.axes["values"])) == ("gap", low, 101)
    assert job.axes["values"][-1] == pytest.approx(high, rel=1e-8)


def test_stiffnesses_make_a_study_each_or_an_axis(monkeypatch, tmp_path):
    write_model(model(), tmp_path / "model.json")
    rig = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--vary", "f_n=4,5")
    _, jobs, stems = asked(monkeypatch, tmp_path, "section", *rig, "--gap", "0,1e-3", "--frequency", "7")
    assert [(job.settings["gap"], float(job.model.values()["f_n"])) for job in jobs] == [(0.0, 4.0), (0.0, 5.0), (1e-3, 4.0), (1e-3, 5.0)]
    assert stems[0][0] == "section_gap-0_f_n-4"
    _, [job], _ = asked(monkeypatch, tmp_path, "response", *rig, "--gap", "0", "--sweep", "3:5:3")
    assert job.settings["also"] == {"f_n": [4.0, 5.0]}


def test_amplitudes_may_vary_too(monkeypatch, tmp_path):
    write_model(model(), tmp_path / "model.json")
    rig = ("--model", str(tmp_path / "model.json"), "--vary", "amplitude=1e-3,2e-3", "--gap", "0")
    _, jobs, stems = asked(monkeypatch, tmp_path, "response", *rig, "--sweep", "3:5:3")
    assert [job.settings["base_amplitude"] for job in jobs] == [1e-3, 2e-3]
    assert [stem for stem, _ in stems] == ["response_base_amplitude-0.001", "response_base_amplitude-0.002"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("bifurcation", "--sweep", "3:5:3", "--sweep", "gap=0:1:3"), "--sweep is given 2 times: expected one parameter"),
        (("peterka", "--sweep", "gap=0:1:3"), "--sweep names 'gap': expected one of ratio, clearance"),
        (("peterka", "--gap", "0"), "--gap is given, but peterka does not take it"),
        (("peterka", "--borders", "none.csv"), "none.csv cannot be read (no such file): expected the borders.csv"),
        (
            ("bifurcation", "--sweep", "3:5:3", "--gap", "0", "--branches", "none.csv"),
            "none.csv cannot be read (no such file): expected a branch",
        ),
        (("response", "--gap", "0"), "--sweep frequency=A:B:N is missing"),
        (("response", "--sweep", "3:5:3"), "--gap is missing"),
        (("response", "--sweep", "=3:5:3", "--gap", "0"), "--sweep is '=3:5:3': expected NAME=VALUES"),
        (("section", "--gap", "0"), "--frequency is missing"),
        (("peterka", "--sweep", "1:2:3", "--sweep", "ratio=1:2:2"), "--sweep names ratio twice"),
        (("bifurcation", "--sweep", "zeta=0.01:0.1:3", "--gap", "0", "--frequency", "7", "--vary", "zeta=0.02,0.05"), "which is swept"),
        (("bifurcation", "--sweep", "amplitude=1e-3:2e-3:3", "--gap", "0", "--frequency", "7"), "but bifurcation sweeps it"),
        (("section", "--gap", "1e-3,1e-3", "--frequency", "7"), "values are equal to six digits (gap-0.001)"),
        (("section", "--gap", "0", "--frequency", "7", "--vary", "mu=1,2"), "--vary names 'mu': expected one of m, "),
        (("section", "--gap", "0", "--frequency", "7", "--vary", "gap=1,2"), "gap is given twice"),
    ],
)
def test_what_the_grammar_does_not_know_ends_in_one_line(monkeypatch, capsys, tmp_path, given, message):
    write_model(model(), tmp_path / "model.json")
    status, jobs, _ = asked(monkeypatch, tmp_path, *given, "--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3")
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert status == 2 and not jobs
    assert len(said) == 1 and message in said[0]


def test_branches_are_drawn_over_one_diagram_of_one_model(monkeypatch, capsys, tmp_path):
    write_model(model(), tmp_path / "model.json")
    (tmp_path / "branch.csv").write_text("frequency,u_m,stable\n3,0,1\n")
    rest = ("--model", str(tmp_path / "model.json"), "--base-amplitude", "1e-3", "--branches", str(tmp_path / "branch.csv"))
    status, jobs, _ = asked(monkeypatch, tmp_path, "bifurcation", "--sweep", "3:5:3", "--gap", "0,1e-3", *rest)
    assert status == 2 and not jobs
    assert "--branches is given with 2 diagrams: expected one, that of the branches" in capsys.readouterr().err


def test_an_unknown_style_or_preset_is_refused(monkeypatch, capsys, tmp_path):
    for option, value in (("--style", "print"), ("--preset", "wire")):
        assert call(monkeypatch, "peterka", option, value, "--base-amplitude", "1e-3", "--out", str(tmp_path / "out")) == 2
        assert f"{value!r} is no {option[2:]}" in capsys.readouterr().err
