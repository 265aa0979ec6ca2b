"""`vibrojax inspect` and `vibrojax new` as a user meets them."""

import shutil
import sys
import tomllib

import pytest

from vibrojax.cli import main
from vibrojax.data_files import data_path


@pytest.fixture
def rig(tmp_path, monkeypatch):
    """A folder with two records of the embedded example and no experiment file."""
    folder = tmp_path / "rig"
    folder.mkdir()
    for name in ("drop.csv.gz", "cart1.csv.gz"):
        shutil.copy(data_path("example") / name, folder)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.chdir(tmp_path)
    return folder


def call(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["vibrojax", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


def test_a_file_is_shown_and_an_experiment_proposed(rig, monkeypatch, capsys):
    assert call(monkeypatch, "inspect", rig / "drop.csv.gz") == 0
    shown = capsys.readouterr().out
    assert "6001 samples in 1.5 s from 0 s; 4000 Hz" in shown
    assert "looks like drop-test: the cart is at rest and impacts occur" in shown
    proposed = tomllib.loads(shown[shown.index("# Proposed") :])
    assert [record["file"] for record in proposed["record"]] == ["drop.csv.gz"]
    assert sorted(path.name for path in rig.iterdir()) == ["cart1.csv.gz", "drop.csv.gz"]


def test_the_table_fits_a_terminal_of_80_characters(rig, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    assert call(monkeypatch, "inspect", rig / "drop.csv.gz") == 0
    table = capsys.readouterr().out.partition("# Proposed")[0]
    assert sum(line.split()[:1] == ["hammer_acceleration"] for line in table.splitlines()) == 1
    assert table.count("as named") == 4 and "remarks" not in table


def test_a_guessed_unit_of_time_is_stated(rig, monkeypatch, capsys):
    (rig / "slow.csv").write_text("t,x\n" + "\n".join(f"{0.25 * i},{i % 7}" for i in range(400)))
    assert call(monkeypatch, "inspect", rig / "slow.csv") == 0
    assert "time taken to be in s: the file states none, and the numbers come in steps of 0.25; is 4 Hz right?" in capsys.readouterr().out


@pytest.mark.parametrize(("out", "file"), [("rig", "cart1.csv.gz"), ("rig/e.toml", "cart1.csv.gz"), ("e.toml", "rig/cart1.csv.gz")])
def test_the_proposal_is_written_beside_or_above_the_records(out, file, rig, monkeypatch, capsys):
    assert call(monkeypatch, "inspect", rig, "--out", out, "--quiet") == 0
    assert capsys.readouterr() == ("", "")
    target = rig / "experiment.toml" if out == "rig" else rig.parent / out
    assert tomllib.loads(target.read_text())["record"][0]["file"] == file


def test_nothing_is_overwritten(rig, monkeypatch, capsys):
    (rig / "experiment.toml").write_text("mine")
    for arguments in (("inspect", rig, "--out", rig), ("new", rig)):
        assert call(monkeypatch, *arguments) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert told.err.startswith("error: ")
        assert "exists: expected a file that is not there yet" in told.err
        assert len(told.err.splitlines()) == 1
    assert (rig / "experiment.toml").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nowhere",), "does not exist"),
        (("rig", "--out", "other/e.toml"), "lies outside the folder of the records"),
        (("rig", "--out", "rig/e.json"), "is neither a folder nor a .toml file"),
        (("rig/drop.csv.gz.part",), "does not exist"),
    ],
)
def test_bad_input_is_one_line(arguments, message, rig, monkeypatch, capsys):
    before = sorted(rig.parent.rglob("*"))
    assert call(monkeypatch, "inspect", *arguments) == 2
    told = capsys.readouterr()
    assert (told.out, len(told.err.splitlines())) == ("", 1)
    assert message in told.err
    assert sorted(rig.parent.rglob("*")) == before


def test_new_writes_the_template(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert call(monkeypatch, "new", "rigs/b") == 0
    assert call(monkeypatch, "new") == 0
    assert (
        (tmp_path / "rigs/b/experiment.toml").read_text()
        == data_path("template.toml").read_text(encoding="utf-8")
        == (tmp_path / "experiment.toml").read_text()
    )
