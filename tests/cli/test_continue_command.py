"""`vibrojax continue` and `vibrojax presets`: from files to files, and refusals in one line."""

import json
import sys

import pytest

from vibrojax.cli import main
from vibrojax.contact import HuntCrossley
from vibrojax.model import Model
from vibrojax.model_file import read_model, write_model
from vibrojax.presets import NAMES, read_preset
from vibrojax.suspension import Linear


@pytest.fixture
def model(tmp_path, monkeypatch):
    for module in ("continuation", "presets"):
        monkeypatch.setattr(f"vibrojax.cli.{module}.prepare_jax", lambda: None)
    monkeypatch.setenv("COLUMNS", "200")
    path = tmp_path / "model.json"
    write_model(Model(1.0, Linear(0.05, 5.0), HuntCrossley(1e6, 1.5, 0.3)), path)
    return path


def call(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["vibrojax", *arguments])
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


@pytest.mark.parametrize("option", ["--amplitude", "--base-amplitude"])
def test_a_branch_is_written(option, model, monkeypatch, tmp_path, capsys):
    out = tmp_path / "branch"
    options = ["--gap", "3e-3", option, "1e-3", "--sweep", "4.2:4.5", "--quiet"]
    assert call(monkeypatch, "continue", "--model", str(model), "--out", str(out), *options) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "branch.csv",
        "branch.md",
        "branch.pdf",
        "branch.png",
        "branch.svg",
        "special.json",
    ]
    document = json.loads((out / "special.json").read_text())
    assert [place["kind"] for place in document["special"]] == ["grazing"]
    assert document["special"][0]["frequency"] == pytest.approx(4.3635, abs=1e-3)
    assert (out / "branch.png").read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr() == ("", "")


def test_a_branch_for_each_gap_says_what_it_shows(model, monkeypatch, tmp_path, capsys):
    out = tmp_path / "branch"
    options = ["--gap", "3e-3,3.1e-3", "--base-amplitude", "1e-3", "--sweep", "frequency=4.2:4.5", "--style", "paper", "--quiet"]
    assert call(monkeypatch, "continue", "--model", str(model), "--out", str(out), *options) == 0
    assert {path.name for path in out.glob("*.csv")} == {"branch_gap-0.003.csv", "branch_gap-0.0031.csv"}
    found = (out / "branch_gap-0.003.md").read_text()
    assert "Found: z = 1/1 stable from" in found and "no impact stable from" in found and "grazing at 4.363 Hz" in found
    assert "- gap: 3 mm" in found and "- A0: 1 mm" in found and "Omega 4.2 to 4.5 Hz" in found
    one, other = (json.loads((out / f"special_gap-{gap}.json").read_text())["provenance"]["settings"]["gap"] for gap in ("0.003", "0.0031"))
    assert (one, other) == (3e-3, 3.1e-3)


def test_borders_are_followed_in_a_second_parameter(model, monkeypatch, tmp_path, capsys):
    out = tmp_path / "branch"
    options = ["--gap", "3e-3", "--base-amplitude", "1e-3", "--sweep", "frequency=4.2:4.5", "--along", "gap=2.8e-3:3.2e-3", "--quiet"]
    assert call(monkeypatch, "continue", "--model", str(model), "--out", str(out), *options) == 0
    assert {path.suffix for path in out.glob("borders.*")} == {".csv", ".md", ".pdf", ".png", ".svg"}
    rows = (out / "borders.csv").read_text().splitlines()
    assert rows[0].startswith("border,kind,cycles,touches,frequency,gap") and rows[1].startswith("1,grazing,1,0,")
    assert "Found: grazing of the motion without impact at frequency 4." in (out / "borders.md").read_text()


def test_presets_are_listed(model, monkeypatch, capsys):
    assert call(monkeypatch, "presets", "list") == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in NAMES) and "0, 1, 2.4" in printed


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--gap", "1e-3", "--amplitude", "1e-3"], "--sweep is missing"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "frequency=3"], "--sweep is '3': expected [NAME=]A:B"),
        (["--preset", "wires", "--sweep", "3:9"], "both --model and --preset are given"),
        (["--amplitude", "1e-3", "--sweep", "4:5"], "--gap is missing: expected it where frequency is swept"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "zeta=0.1:1"], "--frequency is missing"),
        (["--gap", "1e-3", "--amplitude", "0", "--sweep", "4:5"], "amplitude is 0 m: expected a finite number above 0"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "5:4"], "frequency = 5: expected a value from 5 to 4"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "0:1"], "--along 0:1 names no parameter"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "frequency=4:5"], "--along and --sweep both name frequency"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "gap=2e-3:3e-3"], "a branch has gap = 0.001"),
        (["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "gp=0:1"], "unknown parameter 'gp'"),
        (
            ["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "gap=3e-3:1e-4"],
            "--along runs from 0.003 to 0.0001",
        ),
        (
            ["--gap", "1e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "zeta=-0.5:0.2"],
            "zeta is -0.5: expected a number",
        ),
        (["--gap", "1e-3,8e-3", "--amplitude", "1e-3", "--sweep", "4:5", "--along", "gap=0:5e-3"], "a branch has gap = 0.008"),
    ],
)
def test_bad_input_is_refused_in_one_line(model, monkeypatch, tmp_path, capsys, options, message):
    assert call(monkeypatch, "continue", "--model", str(model), "--out", str(tmp_path / "branch"), *options, "--quiet") == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and message in error and error.count("\n") == 1
    assert not (tmp_path / "branch").exists()


def test_a_preset_says_where_its_numbers_come_from(model, monkeypatch, capsys):
    assert call(monkeypatch, "presets", "show", "drilling_hammer") == 0
    printed = capsys.readouterr().out
    assert "stated in the thesis front matter" in printed and "assumed" in printed


def test_names_and_values_of_a_preset_are_whole_on_80_characters(model, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    assert call(monkeypatch, "presets", "show", "wires") == 0
    cells = [[cell.strip() for cell in line.split("│")] for line in capsys.readouterr().out.splitlines()]
    rows = {cell[1]: cell[2] for cell in cells if len(cell) > 2}
    assert rows["natural_frequency_hz"] == "1.82 Hz" and rows["damping_ratio"] == "0.01"


def test_a_preset_becomes_a_model_file(model, monkeypatch, tmp_path, capsys):
    assert call(monkeypatch, "presets", "write", "wires", "--out", str(tmp_path / "wires.json")) == 0
    assert read_model(tmp_path / "wires.json").values() == read_preset("wires").model().values()
    assert "the rig: --base-amplitude 0.000146 --gap 0 or 0.001 or 0.0024" in capsys.readouterr().out
    assert "estimated" in (tmp_path / "wires.json").read_text()


def test_a_preset_that_cannot_be_written_changes_no_file(model, monkeypatch, tmp_path, capsys):
    path = tmp_path / "wires.json"
    path.write_text("mine", encoding="utf-8")

    def full(path, text, **options):
        path.write_bytes(text[:20].encode())
        raise OSError(28, "No space left on device")

    assert call(monkeypatch, "presets", "write", "wires", "--out", str(tmp_path)) == 2
    assert "is a directory; expected FILE" in capsys.readouterr().err
    monkeypatch.setattr("pathlib.Path.write_text", full)
    assert call(monkeypatch, "presets", "write", "wires", "--out", str(path)) == 2
    error = capsys.readouterr().err
    assert error.endswith(f"{path}: No space left on device; make room, or name another place with --out\n")
    assert path.read_text() == "mine"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["model.json", "wires.json"]


def test_facts_are_printed_beside_what_the_preset_gives(model, monkeypatch, capsys):
    assert call(monkeypatch, "presets", "check", "drilling_hammer", "--quiet") == 0
    printed = capsys.readouterr().out
    assert "5.03 kg" in printed and "0 of 0 facts that were not used are reproduced" in printed
    assert "0 of 0 facts about motion are reproduced" in printed
    assert call(monkeypatch, "presets", "check", "beam") == 2
